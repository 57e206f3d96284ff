"""A pin that toggles while whole, fault-free frames come."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

TICK_US = 1000


class Alive(wiring.Component):
    """Toggles every :data:`TICK_US` if the sheet was well since the last chance, for a watchdog or a safety relay.

    well (in): pulse when a whole frame is packed, or an untouched sheet was checked.
    fault (in): high while a fault is reported, which cancels an earlier ``well``.
    pin (out): from a register.
    """

    def __init__(self, clocks_per_us: int):
        self.tick_clocks = TICK_US * clocks_per_us
        super().__init__({"well": In(1), "fault": In(1), "pin": Out(1)})

    def elaborate(self, platform):
        m = Module()
        clock, ticks, seen = Signal(range(self.tick_clocks)), Signal(), Signal()
        m.d.comb += ticks.eq(clock == self.tick_clocks - 1)
        m.d.sync += [
            clock.eq(Mux(ticks, 0, clock + 1)),
            seen.eq((seen & ~ticks | self.well) & ~self.fault),
            self.pin.eq(self.pin ^ (ticks & seen)),
        ]
        return m
