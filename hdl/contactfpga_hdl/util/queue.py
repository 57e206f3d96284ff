"""A queue in block RAM that is right again soon after any of its registers was wrong."""

from amaranth.hdl import Module, Signal
from amaranth.lib import memory, stream, wiring
from amaranth.lib.wiring import In, Out


class Queue(wiring.Component):
    """Holds ``depth`` items, a power of two, and hands them on in order.

    It is empty when the two places, of the next item to come and of the next to go, are the same. Nothing else says how
    full it is, so after a flip of one of them items are lost or come again, and then the places meet.

    items (in): taken unless all places are. What comes in one clock is offered two clocks later at the earliest.
    waiting (out): the same, in the same order.
    """

    def __init__(self, width: int, depth: int):
        self.width, self.depth = width, depth
        super().__init__({"items": In(stream.Signature(width)), "waiting": Out(stream.Signature(width))})

    def elaborate(self, platform):
        m = Module()
        m.submodules.storage = storage = memory.Memory(shape=self.width, depth=self.depth, init=[])
        read, write = storage.read_port(), storage.write_port()
        put = Signal(range(self.depth))
        taken = Signal(range(self.depth))
        fetches = Signal()
        m.d.comb += [
            self.items.ready.eq((put + 1)[: len(put)] != taken),
            fetches.eq((taken != put) & (~self.waiting.valid | self.waiting.ready)),
            write.addr.eq(put),
            write.data.eq(self.items.payload),
            write.en.eq(self.items.valid & self.items.ready),
            read.addr.eq(taken),
            read.en.eq(fetches),
            self.waiting.payload.eq(read.data),
        ]
        m.d.sync += [
            put.eq(put + write.en),
            taken.eq(taken + fetches),
            self.waiting.valid.eq(fetches | self.waiting.valid & ~self.waiting.ready),
        ]
        return m
