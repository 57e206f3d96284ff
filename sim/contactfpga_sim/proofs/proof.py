"""A component with the solver's choices around it: what is free, what is assumed, what is claimed."""

from collections.abc import Iterator

from amaranth.hdl import Assert, Assume, Cat, ClockDomain, Const, Fragment, Module, Shape, Signal, Value
from amaranth.hdl._ast import SignalSet
from amaranth.hdl._mem import MemoryInstance
from amaranth.utils import ceil_log2


class Proof:
    """One component under proof, in one clock domain that starts from power-up and has no reset."""

    def __init__(self, claims_alone: bool = False) -> None:
        self.m = Module()
        self.m.domains.sync = sync = ClockDomain(reset_less=True)
        self.inputs: list[Signal] = [sync.clk]
        self._claims_alone = claims_alone
        self._memory = Module()  # apart, so that no m.If around ``before`` holds a value back
        self.m.submodules.memory = self._memory
        self._names = 0

    def put(self, component) -> "Inside":
        """Elaborate the component and make it the one under proof."""
        self.m.submodules.dut = fragment = Fragment.get(component, None)
        return Inside(fragment)

    def free(self, shape, name: str):
        """A value that the solver chooses in each clock."""
        signal = Signal(shape, name=name)
        self.inputs.append(Value.cast(signal))
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
        """Assume it: only runs in which it holds in each clock are looked at."""
        self.m.d.comb += Assume(condition)

    def claim(self, condition) -> None:
        """What is to be shown."""
        self.m.d.comb += Assert(condition)

    def lemma(self, condition) -> None:
        """What is proved beside the claims because their induction stands on it; no part of what is claimed."""
        if not self._claims_alone:
            self.m.d.comb += Assert(condition)


class Inside:
    """What is in an elaborated component: its parts, and the signals that are driven there."""

    def __init__(self, fragment: Fragment):
        self._fragment = fragment

    def __getitem__(self, path: str) -> Signal:
        """The signal that is driven under this name, such as ``level`` or ``join.stack.level``."""
        *names, last = path.split(".")
        fragment = self._part(names)
        for domain in fragment.statements:
            for signal in _driven(fragment, domain):
                if signal.name == last:
                    return signal
        raise KeyError(path)

    def part(self, path: str):
        """The component of that path, with the attributes that its ``elaborate`` has set."""
        return self._part(path.split(".")).origins[0]

    def word(self, path: str, address) -> Signal:
        """What the memory holds at an address in this clock: seen through a read port that is added for it."""
        (memory,) = (part for part in _fragments(self._part(path.split("."))) if isinstance(part, MemoryInstance))
        data = memory._data
        word = Signal(Shape.cast(data.shape).width, name=f"{path.replace('.', '_')}_word")
        address = Cat(Value.cast(address), Const(0, data.depth.bit_length()))[: ceil_log2(data.depth)]
        memory.read_port(domain="comb", addr=address, data=word, en=Const(1), transparent_for=())
        return word

    def registers(self) -> Iterator[Signal]:
        """All signals of the component and what is in it that change with the clock."""
        for fragment in _fragments(self._fragment):
            yield from _driven(fragment, "sync")

    def _part(self, names) -> Fragment:
        fragment = self._fragment
        for name in names:
            fragment = next(sub for sub, known, _ in fragment.subfragments if known == name)
        return fragment


def _fragments(fragment):
    yield fragment
    for sub, _, _ in fragment.subfragments:
        yield from _fragments(sub)


def _driven(fragment, domain):
    seen = SignalSet()
    for statement in fragment.statements.get(domain, ()):
        seen.update(statement._lhs_signals())
    return list(seen)
