"""A frame's items for the packer, and a summary checked against its cells."""

import math

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga_hdl.payloads import (
    moments_layout,
    passed_layout,
    pressed_cells,
    record_layout,
    row_layout,
    row_number,
    summary_layout,
    zone_layout,
)
from contactfpga_hdl.util.bits import popcount

GROUPS = 4
"""The most groups of a row: a row's steps may each delay the counting, and the next row comes six clocks later."""


class Audit(wiring.Component):
    """Counts a frame before and after the labeller; passes as many zones as the frame can carry.

    taken, row (in): a row, in the clock in which the labeller takes it.
    free (out): that row can be counted.
    records (in): from the labeller.
    items (out): the records without delay, up to the frame's capacity.
    summary (out): valid until the next frame's; ``zones``, ``overflow`` and ``changed`` from one clock after the end
        mark, ``cells`` and ``mismatch`` from at most seven, before the packer can reach them.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = skin.derived
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
        # Zones up to the frame's capacity
        m.submodules.counts = counts = Counts(self.skin)
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
        # Summary
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


class Tally(wiring.Component):
    """Moments of each row, one group of columns per clock; an empty row has no group, others up to :data:`GROUPS`.

    taken (in): pulse as ``row`` (in) is taken; only empty rows may be taken while ``busy``.
    moments (out): a group's share in each clock without ``hold``, from two clocks after ``taken``; otherwise zero.
    hold (in): no group is counted.
    busy (out): falls after the last group.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = skin.derived
        self._columns = 4  # of a group; a power of two
        while skin.columns > GROUPS * self._columns:
            self._columns *= 2
        self._groups = math.ceil(skin.columns / self._columns)
        super().__init__(
            {
                "taken": In(1),
                "row": In(row_layout(self.derived)),
                "moments": Out(moments_layout(self.derived)),
                "hold": In(1),
                "busy": Out(1),
            }
        )

    def elaborate(self, platform):
        m = Module()
        cells = Signal(self._groups * self._columns)
        left = Signal(range(self._groups + 2))  # groups to come, and the one that is being added
        y = Signal(range(max(2, self.skin.rows)))
        first = Signal(range(max(2, self._groups * self._columns)))  # column of the group
        group = cells[: self._columns]
        area = Signal(range(self._columns + 1))
        offsets = Signal(range(math.comb(self._columns, 2) + 1))  # of the pressed columns from the first one, summed
        first_counted = Signal.like(first)
        # Groups of a row, one per clock
        number = row_number(m, self.derived, self.row, self.taken)
        with m.If(self.taken & self.row.cells.any()):
            m.d.sync += cells.eq(pressed_cells(self.derived, self.row.cells))
            m.d.sync += [first.eq(0), left.eq(self._groups + 1), y.eq(number)]
        with m.Elif(self.busy & ~self.hold):
            m.d.sync += [
                cells.eq(cells >> self._columns),
                first.eq(first + self._columns),
                left.eq(left - 1),
                area.eq(popcount(group)),
                offsets.eq(_count_offsets(group)),
                first_counted.eq(first),
            ]
        # Moments of the group before
        m.d.comb += [
            self.busy.eq(left != 0),
            self.moments.area.eq(area),
            self.moments.sum_x.eq(area * first_counted + offsets),
            self.moments.sum_y.eq(area * y),
        ]
        return m


def _count_offsets(bits: Value) -> Value:
    return sum(
        popcount(bit for offset, bit in enumerate(bits) if offset >> place & 1) << place
        for place in range((len(bits) - 1).bit_length())
    )


class Counts(wiring.Component):
    """Content of a frame's rows, and whether its zones explain all of its cells.

    Rows with a pressed cell come at least ``Derived.min_row_clocks`` apart, or when ``free``. ``ends`` is the clock of
    the end mark, which captures ``changed``; ``cells`` and ``mismatch`` follow when the last row is counted. All hold
    until the next frame's.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = skin.derived
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
        # Cells without a zone: counted ones are added; zones are subtracted a clock after they pass, which pauses that
        cells = Signal.like(self.cells)
        unexplained = Signal(moments_layout(self.derived))
        passed, zone = Signal(), Signal.like(self.zone)
        m.d.sync += [passed.eq(self.zone_valid), zone.eq(self.zone)]
        m.d.comb += tally.hold.eq(passed)
        with m.If(~passed):
            m.d.sync += cells.eq(cells + tally.moments.area)
        for name in ("area", "sum_x", "sum_y"):
            less = passed.replicate(len(zone[name]))
            share = Mux(passed, zone[name], tally.moments[name])
            # One adder does both: minus a number is plus its complement and one.
            m.d.sync += unexplained[name].eq((Cat(passed, unexplained[name]) + Cat(passed, share ^ less))[1:])
        ended = Signal()
        m.d.sync += ended.eq(self.ends | ended & tally.busy)
        with m.If(ended & ~tally.busy):
            m.d.sync += [
                self.cells.eq(cells),
                self.mismatch.eq(unexplained.as_value() != 0),
                cells.eq(0),
                unexplained.eq(0),
            ]
        # Change
        if self.skin.send == "on_change":
            self._watch_change(m)
        else:
            m.d.comb += self.changed.eq(1)
        return m

    def _watch_change(self, m: Module) -> None:
        from contactfpga_hdl.report.change import Change

        m.submodules.change = change = Change(self.skin)
        m.d.comb += [change.taken.eq(self.taken), change.row.eq(self.row), change.clear.eq(self.ends)]
        with m.If(self.ends):
            m.d.sync += self.changed.eq(change.changed)
