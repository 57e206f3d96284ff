"""Whose turn it is to send a packet, where several sheets share a line."""

from amaranth.hdl import Cat, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out


class Turns(wiring.Component):
    """A turn goes round from sheet to sheet. Who has it may begin a packet, and keeps it to its end; who has nothing to
    send passes it on in the same clock. So a sheet waits for one packet of each other sheet at most.

    holds (in), by sheet: a packet begins in this clock, or does not end in it; only looked at in the sheet's turn.
    turn (out), by sheet: a packet may begin; high for one sheet in each clock, for the first one after power-up.
    """

    def __init__(self, sheets: int):
        self.sheets = sheets
        super().__init__({"holds": In(sheets), "turn": Out(sheets)})

    def elaborate(self, platform):
        m = Module()
        others = Signal(self.sheets - 1)  # by sheet after the first one; none: it is the first one's turn
        m.d.comb += self.turn.eq(Cat(~others.any(), others))
        with m.If(~(self.turn & self.holds).any()):
            m.d.sync += others.eq(self.turn)
        return m
