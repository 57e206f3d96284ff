"""Where a frame's zones or bitmap rows wait for the stage after."""

from amaranth.hdl import Module
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.payloads import passed_layout
from contactfpga_hdl.util.queue import Queue


class Backlog(wiring.Component):
    """A queue for what comes faster than it is divided or packed.

    Its places, ``Derived.backlog`` or more, are enough for any frame, so ``passed`` is always ready. What comes in one
    clock is offered two clocks later at the earliest.

    passed (in): zones, or items where nothing is divided, and end marks.
    waiting (out): the same, in the same order.
    """

    def __init__(self, skin: Skin):
        self.derived = Derived(skin)
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
