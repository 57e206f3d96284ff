"""A component with the solver's free values, assumptions and claims."""

from amaranth.hdl import Assert, Assume, ClockDomain, Fragment, Module, Signal, Value

from contactfpga_sim.verify.proofs import induction
from contactfpga_sim.verify.proofs.inside import Inside


class Proof:
    """One component under proof, in one clock domain from power-up without reset."""

    def __init__(self, claims_alone: bool = False) -> None:
        self.m = Module()
        self.m.domains.sync = sync = ClockDomain(reset_less=True)
        self.ports: list[Signal] = [sync.clk]
        self._claims_alone = claims_alone
        self._memory = Module()  # apart, so that no m.If around ``before`` holds a value back
        self.m.submodules.memory = self._memory
        self._names = 0

    def put(self, component) -> Inside:
        """Elaborate the component and put it under proof."""
        self.m.submodules.dut = fragment = Fragment.get(component, None)
        return Inside(fragment)

    def free(self, shape, name: str):
        """A value that the solver chooses in each clock."""
        signal = Signal(shape, name=name)
        self.ports.append(Value.cast(signal))
        return signal

    def chosen(self, shape, name: str):
        """A value that the solver chooses once and for all clocks."""
        kept = Signal(shape, name=f"{name}_kept")
        started = Signal(name=f"{name}_started")
        value = Signal(shape, name=name)
        self.m.d.comb += value.eq(kept)
        with self.m.If(~started):
            self.m.d.comb += value.eq(self.free(shape, f"{name}_offered"))
        self.m.d.sync += [started.eq(1), kept.eq(value)]
        return value

    def before(self, value, init: int = 0) -> Signal:
        """The value one clock ago."""
        value = Value.cast(value)
        self._names += 1
        kept = Signal(value.shape(), name=f"before_{self._names}", init=init)
        self._memory.d.sync += kept.eq(value)
        return kept

    def given(self, condition) -> None:
        """Assume the condition in each clock."""
        self.m.d.comb += Assume(condition)

    def claim(self, condition) -> None:
        """Add a condition to be shown."""
        self.m.d.comb += Assert(condition)

    def rests(self, condition) -> None:
        """Name the clocks at rest, from which the induction starts: those in which lemmas pin down what matters."""
        self.ports.append(rest := Signal(name=induction.REST))
        self.m.d.comb += rest.eq(condition)

    def lemma(self, condition) -> None:
        """Add a condition that is proved to support the claims' induction."""
        if not self._claims_alone:
            self.m.d.comb += Assert(condition)
