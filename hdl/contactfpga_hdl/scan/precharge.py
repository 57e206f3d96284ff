"""Drives the columns to the released level, but for those that something else holds."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga_hdl.scan.stuck import watched

RETRY_BIT = 16
"""Of the clock in us: a column that read stuck is driven again when this bit turns."""


class Precharge(wiring.Component):
    """Columns that are masked in every row are never driven; one that read stuck is not driven until it is retried.

    drive (in): in the next clock the columns are driven.
    columns (in): those that read pressed.
    stuck (in): high for a clock in which these are stuck.
    turn (in): bit ``RETRY_BIT`` of a clock in us.
    held (out): columns that are not driven as they read stuck, from the clock after ``stuck`` on.
    pins (out): columns that are driven, from registers.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        super().__init__(
            {
                "drive": In(1),
                "columns": In(skin.column_lines),
                "stuck": In(1),
                "turn": In(1),
                "held": Out(skin.column_lines),
                "pins": Out(skin.column_lines),
            }
        )

    def elaborate(self, platform):
        m = Module()
        lines = watched(self.skin)
        free = Signal(self.skin.column_lines, init=lines)
        before = Signal()
        m.d.comb += self.held.eq(~free & lines)
        m.d.sync += [before.eq(self.turn), self.pins.eq(Mux(self.drive, free, 0))]
        retried = Mux(self.turn ^ before, lines, free)
        m.d.sync += free.eq(retried & ~Mux(self.stuck, self.columns, 0))
        return m
