"""Drives the columns to the released level, but for those that something else holds."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga_hdl.scan.stuck import anywhere

RETRY_BITS = 16
"""A column that read stuck is driven again after 2^16 us."""


class Precharge(wiring.Component):
    """Columns that are masked in every row are never driven; one that read stuck is not driven until it is retried.

    drive (in): in the next clock the columns are driven.
    columns (in): those that read pressed.
    stuck (in): high for a clock in which these are stuck.
    time (in): bit ``RETRY_BITS`` of a clock in us; all columns are retried when it changes.
    pins (out): the columns that are driven, from registers.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        super().__init__(
            {
                "drive": In(1),
                "columns": In(skin.columns),
                "stuck": In(1),
                "time": In(1),
                "pins": Out(skin.columns),
            }
        )

    def elaborate(self, platform):
        m = Module()
        held = Signal(self.skin.columns)
        before = Signal()
        m.d.sync += [before.eq(self.time), self.pins.eq(Mux(self.drive, anywhere(self.skin) & ~held, 0))]
        with m.If(self.stuck):
            m.d.sync += held.eq(held | self.columns)
        with m.Elif(self.time != before):
            m.d.sync += held.eq(0)
        return m
