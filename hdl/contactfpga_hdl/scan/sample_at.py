"""The command "sample at": a row's columns are sampled before its settle time is over (docs/protocol.md)."""

from amaranth.hdl import Module, Mux, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from contactfpga.skin.derived import SAMPLE_AT, Derived
from contactfpga.wire.command import VALUE_DIGITS
from contactfpga.wire.framing import DIGIT_BITS


def moves_sample(derived: Derived) -> bool:
    return SAMPLE_AT in derived.commands


def sample_at_ports(derived: Derived) -> dict[str, wiring.Member]:
    """Of a scan that obeys it.

    moves (in): high for a clock when the command comes, with the request.
    clocks (in): its value, in that clock.
    """
    return {"moves": In(1), "clocks": In(DIGIT_BITS * VALUE_DIGITS)} if moves_sample(derived) else {}


class SampleAt:
    """The clock of a row in which its columns are sampled, from 1 to the settle time; a frame keeps the one that it
    begins with."""

    def __init__(self, m: Module, derived: Derived, moves: Value, clocks: Value, begins: Value):
        """``begins``: a frame does in the next clock."""
        self.settle = settle = derived.settle_clocks
        asked = Signal(range(settle + 1), init=settle, name="next_sample_clock")
        self.clock = Signal(range(settle + 1), init=settle, name="sample_clock")
        self.early = Signal()
        fits = (clocks >= derived.first_sample_clocks) & (clocks < settle)
        with m.If(moves):
            m.d.sync += asked.eq(Mux(fits, clocks, settle))
        with m.If(begins):
            m.d.sync += [self.clock.eq(asked), self.early.eq(asked != settle)]
