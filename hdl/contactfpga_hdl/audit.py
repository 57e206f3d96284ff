"""What a frame holds: its items for the packer, and a summary that was checked against its cells."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.derived import Derived
from contactfpga.skin import Skin
from contactfpga_hdl.payloads import item_layout, moments_layout, record_layout, row_layout, summary_layout, tag_layout
from contactfpga_hdl.tally import Change, Tally


class Audit(wiring.Component):
    """Counts a frame before and behind the labeller; lets as many zones through as the frame can carry.

    Records pass without delay. ``summary`` is complete one clock after the end mark and holds until the next one.
    ``tag`` is read with the frame's last row: behind a debounce the next frame may begin before the end mark.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = Derived(skin)
        super().__init__(
            {
                "taken": In(1),
                "row": In(row_layout(self.derived)),
                "tag": In(tag_layout()),
                "records": In(stream.Signature(record_layout(self.derived))),
                "items": Out(stream.Signature(item_layout(self.derived))),
                "summary": Out(summary_layout(self.derived)),
            }
        )

    def elaborate(self, platform):
        m = Module()
        record = self.records.payload
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
            self.items.payload.data.eq(record.zone.as_value()),
            self.items.payload.end.eq(record.end),
            counts.taken.eq(self.taken),
            counts.row.eq(self.row),
            counts.tag.eq(self.tag),
            counts.clear.eq(ends),
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
                self.summary.mismatch.eq(counts.mismatch),
            ]
            _summarise(m, self, counts)
        return m


class Bitmap(wiring.Component):
    """With ``report = "cells"`` in the place of labeller and audit: rows go into the frame as they are.

    The end mark follows the last row three clocks later, when that is counted.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = Derived(skin)
        super().__init__(
            {
                "rows": In(stream.Signature(row_layout(self.derived))),
                "tag": In(tag_layout()),
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
            counts.tag.eq(self.tag),
            counts.clear.eq(ends & self.items.ready),
        ]
        with m.If(ends & self.items.ready):
            _summarise(m, self, counts)
        return m


def _summarise(m, stage, counts):
    m.d.sync += [
        stage.summary.tag.eq(counts.last_tag),
        stage.summary.cells.eq(counts.cells),
        stage.summary.changed.eq(counts.changed),
    ]


class _Counts(wiring.Component):
    """Pressed cells of the frame, what the zones leave unexplained, whether it changed, and its tag.

    All of a row is counted three clocks after ``taken``. ``clear`` starts the next frame.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = Derived(skin)
        moments = moments_layout(self.derived)
        super().__init__(
            {
                "taken": In(1),
                "row": In(row_layout(self.derived)),
                "tag": In(tag_layout()),
                "clear": In(1),
                "zone_valid": In(1),
                "zone": In(moments),
                "cells": Out(self.derived.area_bits),
                "mismatch": Out(1),
                "changed": Out(1),
                "last_tag": Out(tag_layout()),
            }
        )

    def elaborate(self, platform):
        m = Module()
        m.submodules.tally = tally = Tally(self.skin)
        m.d.comb += [tally.taken.eq(self.taken), tally.row.eq(self.row)]
        with m.If(self.taken & self.row.last):
            m.d.sync += self.last_tag.eq(self.tag)
        m.d.sync += self.cells.eq(self.cells + tally.moments.area)
        with m.If(self.clear):
            m.d.sync += self.cells.eq(0)
        unexplained = Signal(moments_layout(self.derived))
        for name in ("area", "sum_x", "sum_y"):
            zone = Mux(self.zone_valid, self.zone[name], 0)
            m.d.sync += unexplained[name].eq(unexplained[name] + tally.moments[name] - zone)
        with m.If(self.clear):  # all rows are counted by then
            m.d.sync += unexplained.eq(0)
        m.d.comb += self.mismatch.eq(unexplained.as_value() != 0)
        if self.skin.send == "on_change":
            m.submodules.change = change = Change(self.skin)
            m.d.comb += [
                change.taken.eq(self.taken),
                change.row.eq(self.row),
                change.clear.eq(self.clear),
                self.changed.eq(change.changed),
            ]
        else:
            m.d.comb += self.changed.eq(1)
        return m
