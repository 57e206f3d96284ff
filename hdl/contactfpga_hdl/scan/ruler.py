"""The ruler: the time in which columns fall through known resistors sets the instant of all samples."""

from amaranth.hdl import Module, Mux, Signal, Value

from contactfpga.skin.derived import LEVEL_STEP, MAX_RULER, Derived
from contactfpga_hdl.scan.stuck import anywhere

FRACTION_BITS = 4
"""Fraction bits of the multiple of the ruler's time."""


class Ruler:
    """Sample clock of a frame's rows, with the attributes of :class:`~contactfpga_hdl.scan.sample_at.SampleAt`: a
    multiple of the clocks in which the last column falls in the guard row's slot, where each crosses a known resistor.

    Columns that are reported open, or masked in every row, are not waited for. If the last one does not fall within the
    settle time, or none falls, the ruler is lost, and rows are sampled at the end of the settle time. The multiple is
    summed up clock by clock, so that nothing multiplies.
    """

    def __init__(self, m: Module, derived: Derived, moves: Value, value: Value, begins: Value, level: int = 0):
        """``moves``: pulse with a command's ``value``: sixteenths, and a ``level``, from 0, where there are several;
        ``begins``: row 0 does, in the next clock."""
        skin, self.settle = derived.skin, derived.settle_clocks
        self._number = str(level or "")
        self._begins, self._most, self._first = begins, self.settle << FRACTION_BITS, derived.first_sample_clocks
        self._ignored = ~anywhere(skin) & (1 << skin.columns) - 1
        self.clock = Signal(range(self.settle + 1), init=self.settle, name=f"sample_clock{self._number}")
        self.early = Signal()  # the guard column may not have fallen
        usual = derived.rulers[level]
        self._asked = asked = Signal(range(LEVEL_STEP), init=usual, name="ruler_asked")
        first = level * LEVEL_STEP
        fits = (value > first) & (value <= first + MAX_RULER)
        with m.If(moves if skin.levels == 1 else moves & (fits | (value == first))):
            m.d.sync += asked.eq(Mux(fits, value, usual))

    def measure(self, m: Module, starts: Value, of_guard: Value, read: Value, faulty: Value) -> None:
        """``starts``: first clock of the guard row's slot; ``of_guard``: ``read`` are columns that read pressed in it,
        two clocks after the pins; ``faulty``: columns reported open."""
        sum_ = Signal(range(self._most + MAX_RULER + 1), name=f"ruler_sum{self._number}")
        step = Signal.like(self._asked, name="ruler_step")
        fell, late = Signal(name="ruler_fell"), Signal(name=f"ruler_late{self._number}")
        ignored = faulty | self._ignored
        falls = (read | ignored).all() & (read & ~ignored).any()
        with m.If(starts):
            m.d.sync += [sum_.eq(self._asked), step.eq(self._asked), fell.eq(0), late.eq(self._asked >= self._most)]
        with m.Elif(of_guard):
            m.d.sync += fell.eq(fell | falls)
            with m.If(~fell & ~falls & ~late):
                m.d.sync += [sum_.eq(sum_ + step), late.eq(sum_ + step >= self._most)]
        clocks = sum_ >> FRACTION_BITS
        with m.If(self._begins):
            m.d.sync += [
                self.clock.eq(Mux(late | ~fell, self.settle, Mux(clocks < self._first, self._first, clocks))),
                self.early.eq(fell & (step < 3 << FRACTION_BITS - 1)),
            ]
