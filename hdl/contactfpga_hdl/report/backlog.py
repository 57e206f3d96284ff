"""Queues of a frame's zones or bitmap rows."""

from amaranth.hdl import Module, Signal
from amaranth.lib import memory, stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga_hdl.payloads import passed_layout


class Queue(wiring.Component):
    """Queue of ``depth`` items, a power of two.

    The queue is empty when the places of the next item in and the next out are equal. There is no other count, so a
    flip in one of them loses or repeats items until the places meet.

    items (in): taken unless all places are.
    waiting (out): the items in order; each is offered two clocks later at the earliest.
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
    """Queue before the division or packing. Its places, ``Derived.backlog`` or more, suffice for any frame, so
    ``passed`` is always ready.

    passed (in): zones, or items if nothing is divided, and end marks.
    waiting (out): the same in order, each two clocks later at the earliest.
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
            self.passed.ready.eq(1),
            self.waiting.payload.eq(queue.waiting.payload),
            self.waiting.valid.eq(queue.waiting.valid),
            queue.waiting.ready.eq(self.waiting.ready),
        ]
        return m
