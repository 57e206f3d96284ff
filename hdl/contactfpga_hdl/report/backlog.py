"""Where a frame's zones or bitmap rows wait for the stage after."""

from amaranth.hdl import Module
from amaranth.lib import stream, wiring
from amaranth.lib.fifo import SyncFIFOBuffered
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.payloads import passed_layout


class Backlog(wiring.Component):
    """A FIFO for what comes faster than it is divided or packed.

    Its ``Derived.backlog`` places are enough for any frame, so ``passed`` is always ready. What comes in one clock is
    offered two clocks later at the earliest.

    passed (in): zones, or items where nothing is divided, and end marks.
    waiting (out): the same, in the same order.
    """

    def __init__(self, skin: Skin):
        self.derived = Derived(skin)
        payload = stream.Signature(passed_layout(self.derived))
        super().__init__({"passed": In(payload), "waiting": Out(payload)})

    def elaborate(self, platform):
        m = Module()
        width = passed_layout(self.derived).size
        m.submodules.fifo = fifo = SyncFIFOBuffered(width=width, depth=self.derived.backlog)
        m.d.comb += [
            fifo.w_data.eq(self.passed.payload),
            fifo.w_en.eq(self.passed.valid),
            self.passed.ready.eq(fifo.w_rdy),
            self.waiting.payload.eq(fifo.r_data),
            self.waiting.valid.eq(fifo.r_rdy),
            fifo.r_en.eq(self.waiting.ready),
        ]
        return m
