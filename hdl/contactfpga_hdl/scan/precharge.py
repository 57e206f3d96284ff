"""Drives the columns to the released level, but for those that something else holds."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga_hdl.scan.stuck import anywhere

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
                "columns": In(skin.columns),
                "stuck": In(1),
                "turn": In(1),
                "held": Out(skin.columns),
                "pins": Out(skin.columns),
            }
        )

    def elaborate(self, platform):
        m = Module()
        free = Signal(self.skin.columns, init=anywhere(self.skin))
        before = Signal()
        m.d.comb += self.held.eq(~free & anywhere(self.skin))
        m.d.sync += [before.eq(self.turn), self.pins.eq(Mux(self.drive, free, 0))]
        retried = Mux(self.turn ^ before, anywhere(self.skin), free)
        m.d.sync += free.eq(retried & ~Mux(self.stuck, self.columns, 0))
        return m
