"""Where a frame's zones or bitmap rows wait for the stage after."""

from amaranth.hdl import Module, Signal
from amaranth.lib import memory, stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga_hdl.payloads import passed_layout


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


class Backlog(wiring.Component):
    """A queue for what comes faster than it is divided or packed.

    Its places, ``Derived.backlog`` or more, are enough for any frame, so ``passed`` is always ready. What comes in one
    clock is offered two clocks later at the earliest.

    passed (in): zones, or items where nothing is divided, and end marks.
    waiting (out): the same, in the same order.
    """

    def __init__(self, skin: Skin):
        self.derived = skin.derived
        payload = stream.Signature(passed_layout(self.derived))
        super().__init__({"passed": In(payload), "waiting": Out(payload)})

    def elaborate(self, platform):
        m = Module()
        depth = 1 << (self.derived.backlog - 1).bit_length()
        m.submodules.queue = queue = Queue(passed_layout(self.derived).size, depth)
        m.d.comb += [
            queue.items.payload.eq(self.passed.payload),
            queue.items.valid.eq(self.passed.valid),
            self.passed.ready.eq(queue.items.ready),
            self.waiting.payload.eq(queue.waiting.payload),
            self.waiting.valid.eq(queue.waiting.valid),
            queue.waiting.ready.eq(self.waiting.ready),
        ]
        return m
