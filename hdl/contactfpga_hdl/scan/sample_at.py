"""The command "sample at": samples a row's columns before its settle time is over (docs/protocol.md)."""

from amaranth.hdl import Module, Mux, Signal, Value

from contactfpga.skin.derived import Derived


class SampleAt:
    """Sample clock of a row, from 1 to the settle time, constant within a frame."""

    def __init__(self, m: Module, derived: Derived, moves: Value, clocks: Value, begins: Value):
        """``begins``: a frame begins in the next clock."""
        self.settle = settle = derived.settle_clocks
        asked = Signal(range(settle + 1), init=settle, name="next_sample_clock")
        self.clock = Signal(range(settle + 1), init=settle, name="sample_clock")
        self.early = Signal()
        fits = (clocks >= derived.first_sample_clocks) & (clocks < settle)
        with m.If(moves):
            m.d.sync += asked.eq(Mux(fits, clocks, settle))
        with m.If(begins):
            m.d.sync += [self.clock.eq(asked), self.early.eq(asked != settle)]
