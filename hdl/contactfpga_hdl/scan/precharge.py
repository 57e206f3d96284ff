"""Precharge of columns to the released level."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga_hdl.scan.stuck import watched

LOOKS = 4
"""Separated samples of a window; a column is stuck only if it reads pressed in all of them."""
LEAST_BITS = 4
"""Log2 of the least clocks between two of these samples, so that a short disturbance spoils only one."""


class Precharge(wiring.Component):
    """Drives columns, except stuck ones and those masked in every row. A column is *stuck* if it reads pressed
    throughout a window of :data:`LOOKS` separated samples and all samples between. Two of the :data:`LOOKS` are ``2 **
    apart_bits`` clocks apart, longer than driving a column to its level, and than a projection. In the first window
    after ``retry`` toggles a stuck column is driven and judged again.

    drive (in): in the next clock the columns are driven.
    columns (in): columns that read pressed.
    looks (in): pulse with a sample in ``columns``; all columns that are not stuck were driven before.
    retry (in): bit ``RETRY_BIT`` of a clock in us.
    guard_pressed (in): of a scan that reads rows: pulse when the guard column is found stuck, until ``retry`` toggles;
        other scans treat it as any column.
    others (in): with a self-test, columns driven in the next clock whatever they read.
    held (out): stuck columns, from the clock after a window.
    pins (out): driven columns, from registers.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        derived = skin.derived
        charge = max(derived.precharge_clocks, derived.project_clocks if skin.reads_rows else 0)
        self.apart_bits = max(LEAST_BITS, charge.bit_length())
        self.alone = skin.guard and skin.reads_rows
        super().__init__(
            {
                "drive": In(1),
                "columns": In(skin.column_lines - self.alone),
                "looks": In(1),
                "retry": In(1),
                **({"guard_pressed": In(1)} if self.alone else {}),
                **({"others": In(skin.column_lines)} if skin.self_test else {}),
                "held": Out(skin.column_lines),
                "pins": Out(skin.column_lines),
            }
        )

    def elaborate(self, platform):
        m = Module()
        count = Signal(range(LOOKS << self.apart_bits))  # of the window
        low = Signal(len(self.columns), init=-1)  # columns that read pressed in all of its samples
        stuck = Signal(len(self.columns))
        ends = Signal()  # the window does, with this sample
        asked = Signal()  # in the next window columns that are stuck are driven
        tries = Signal()  # they are in this one
        before = Signal()
        toggles = Signal()
        free = Signal(self.skin.column_lines)
        lines = watched(self.skin)
        # Columns that may be driven, and the pins
        m.d.comb += [
            toggles.eq(self.retry ^ before),
            ends.eq(self.looks & count.all()),
            self.held[: len(stuck)].eq(stuck),
            free.eq(Cat(~stuck | tries.replicate(len(stuck)), ~self.held[len(stuck) :]) & lines),
        ]
        m.d.sync += [
            before.eq(self.retry),
            self.pins.eq(Mux(self.drive, free, 0) | (self.others if self.skin.self_test else 0)),
            asked.eq(toggles | asked & ~ends),
            count.eq(count + (self.looks | ~count[: self.apart_bits].all())),
        ]
        # Columns that read pressed throughout a window
        with m.If(ends):
            kept = stuck & ~tries.replicate(len(stuck))
            m.d.sync += [low.eq(-1), tries.eq(asked), stuck.eq((low & self.columns | kept) & lines)]
        with m.Elif(self.looks):
            m.d.sync += low.eq(low & self.columns)
        # Guard column
        if self.alone:
            guard_stuck = Signal()
            m.d.sync += guard_stuck.eq(~toggles & (guard_stuck | self.guard_pressed))
            m.d.comb += self.held[-1].eq(guard_stuck)
        return m
