"""What a frame holds: its items for the packer, and a summary that was checked against its cells."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.payloads import (
    item_layout,
    moments_layout,
    passed_layout,
    record_layout,
    row_layout,
    summary_layout,
    zone_layout,
)
from contactfpga_hdl.report.tally import Change, Tally


class Audit(wiring.Component):
    """Counts a frame before and after the labeller; lets as many zones through as the frame can carry.

    taken, row (in): a row, in the clock in which the labeller takes it.
    free (out): that row can be counted.
    records (in): from the labeller.
    items (out): the same without delay, but no more than the frame can carry.
    summary (out): until the next frame's. ``zones``, ``overflow`` and ``changed`` are there one clock after the end
    mark, ``cells`` and ``mismatch`` at most seven, which is before the packer can come to them.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = Derived(skin)
        super().__init__(
            {
                "taken": In(1),
                "row": In(row_layout(self.derived)),
                "free": Out(1),
                "records": In(stream.Signature(record_layout(self.derived))),
                "items": Out(stream.Signature(passed_layout(self.derived))),
                "summary": Out(summary_layout(self.derived)),
            }
        )

    def elaborate(self, platform):
        m = Module()
        record, passed = self.records.payload, self.items.payload
        taken = self.records.valid & self.records.ready
        ends = taken & record.end
        zone = taken & ~record.end
        zones = Signal(self.derived.zones_bits)
        overflow = Signal()
        fits = zones < self.derived.zone_capacity
        passes = record.end | fits
        m.submodules.counts = counts = _Counts(self.skin)
        m.d.comb += [
            self.records.ready.eq(self.items.ready | ~passes),
            self.items.valid.eq(self.records.valid & passes),
            (passed.zone if self.skin.report == "barycenter" else passed.data).eq(record.zone.as_value()),
            self.items.payload.end.eq(record.end),
            counts.taken.eq(self.taken),
            counts.row.eq(self.row),
            self.free.eq(counts.free),
            counts.ends.eq(ends),
            counts.zone_valid.eq(zone),
            counts.zone.eq(record.zone),
        ]
        with m.If(zone):
            m.d.sync += [zones.eq(zones + 1), overflow.eq(overflow | ~fits)]
        with m.If(ends):
            m.d.sync += [
                zones.eq(0),
                overflow.eq(0),
                self.summary.zones.eq(zones),
                self.summary.overflow.eq(overflow),
            ]
        m.d.comb += [
            self.summary.cells.eq(counts.cells),
            self.summary.mismatch.eq(counts.mismatch),
            self.summary.changed.eq(counts.changed),
        ]
        return m


class Bitmap(wiring.Component):
    """With ``report = "cells"`` in the place of labeller and audit: rows go into the frame as they are.

    rows (in): a frame's rows in ascending order.
    free (out): the row on offer can be counted.
    items (out): the same without delay; the end mark follows the last one three clocks later, when that is counted.
    summary (out): as of :class:`Audit`, where it has no zones.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = Derived(skin)
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
        m.submodules.counts = counts = _Counts(self.skin)
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


class _Counts(wiring.Component):
    """What a frame's rows say of it, and whether its zones explain all of its cells.

    Rows with a pressed cell come at least ``Derived.min_row_clocks`` apart, or when they are ``free`` to.
    ``ends`` is the clock of the end mark.
    ``changed`` is captured in it, ``cells`` and ``mismatch`` as soon as the last row is counted as well; all hold until
    the next frame's.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = Derived(skin)
        super().__init__(
            {
                "taken": In(1),
                "row": In(row_layout(self.derived)),
                "free": Out(1),
                "ends": In(1),
                "zone_valid": In(1),
                "zone": In(zone_layout(self.derived)),
                "cells": Out(self.derived.area_bits),
                "mismatch": Out(1),
                "changed": Out(1),
            }
        )

    def elaborate(self, platform):
        m = Module()
        m.submodules.tally = tally = Tally(self.skin)
        m.d.comb += [
            tally.taken.eq(self.taken),
            tally.row.eq(self.row),
            self.free.eq(~tally.busy | ~self.row.cells.any()),
        ]
        self._explain(m, tally)
        if self.skin.send == "on_change":
            self._watch_change(m)
        else:
            m.d.comb += self.changed.eq(1)
        return m

    def _explain(self, m: Module, tally: Tally) -> None:
        """Cells are added as they are counted, zones subtracted as they pass; for these the counting holds."""
        cells = Signal.like(self.cells)
        unexplained = Signal(moments_layout(self.derived))
        m.d.comb += tally.hold.eq(self.zone_valid)
        with m.If(~self.zone_valid):
            m.d.sync += cells.eq(cells + tally.moments.area)
        for name in ("area", "sum_x", "sum_y"):
            less = self.zone_valid.replicate(len(self.zone[name]))
            share = Mux(self.zone_valid, self.zone[name], tally.moments[name])
            # One adder does both: minus a number is plus its complement and one.
            m.d.sync += unexplained[name].eq(
                (Cat(self.zone_valid, unexplained[name]) + Cat(self.zone_valid, share ^ less))[1:]
            )
        ended = Signal()
        m.d.sync += ended.eq(self.ends | ended & tally.busy)
        with m.If(ended & ~tally.busy):
            m.d.sync += [
                self.cells.eq(cells),
                self.mismatch.eq(unexplained.as_value() != 0),
                cells.eq(0),
                unexplained.eq(0),
            ]

    def _watch_change(self, m: Module) -> None:
        m.submodules.change = change = Change(self.skin)
        m.d.comb += [change.taken.eq(self.taken), change.row.eq(self.row), change.clear.eq(self.ends)]
        with m.If(self.ends):
            m.d.sync += self.changed.eq(change.changed)
