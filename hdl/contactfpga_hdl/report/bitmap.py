"""Bitmap rows of a frame."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga_hdl.payloads import item_layout, row_layout, summary_layout
from contactfpga_hdl.report.audit import Counts


class Bitmap(wiring.Component):
    """With ``report = "cells"`` the replacement of labeller and audit: rows enter the frame unchanged.

    rows (in): a frame's rows in ascending order.
    free (out): the offered row can be counted.
    items (out): the rows without delay; the end mark follows the last one three clocks later, when it is counted.
    summary (out): as of :class:`Audit`, without zones.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = skin.derived
        super().__init__(
            {
                "rows": In(stream.Signature(row_layout(self.derived))),
                "free": Out(1),
                "items": Out(stream.Signature(item_layout(self.derived))),
                "summary": Out(summary_layout(self.derived)),
            }
        )

    def elaborate(self, platform):
        m = Module()
        taken = self.rows.valid & self.rows.ready
        countdown = Signal(range(4))
        counting = countdown != 0
        ends = countdown == 1
        with m.If(taken & self.rows.payload.last):
            m.d.sync += countdown.eq(3)
        with m.Elif(counting & (~ends | self.items.ready)):
            m.d.sync += countdown.eq(countdown - 1)
        m.submodules.counts = counts = Counts(self.skin)
        m.d.comb += [
            self.rows.ready.eq(~counting & self.items.ready),
            self.items.valid.eq(self.rows.valid & ~counting | ends),
            self.items.payload.data.eq(Mux(ends, 0, self.rows.payload.cells)),
            self.items.payload.end.eq(ends),
            counts.taken.eq(taken),
            counts.row.eq(self.rows.payload),
            self.free.eq(counts.free),
            counts.ends.eq(ends & self.items.ready),
            self.summary.cells.eq(counts.cells),
            self.summary.changed.eq(counts.changed),
        ]
        return m
