"""Parts and driven signals of an elaborated component."""

from collections.abc import Iterator, Sequence
from typing import TypeVar

from amaranth.hdl import Cat, Const, Format, Fragment, Shape, Signal, Value
from amaranth.hdl._ast import SignalSet
from amaranth.hdl._mem import MemoryInstance
from amaranth.utils import ceil_log2

_Found = TypeVar("_Found")


class Inside:
    """Signals and parts of an elaborated component by name. Unknown and ambiguous names raise LookupError."""

    def __init__(self, fragment: Fragment):
        self._fragment = fragment

    def __getitem__(self, path: str) -> Value:
        """The signal driven under this name, such as ``level``, ``join.stack.level`` or a field of one; else a read
        one, which keeps its initial value."""
        names = path.split(".")
        fragment = self._fragment
        while len(names) > 1 and (sub := _sub(fragment, names[0])) is not None:
            fragment, names = sub, names[1:]
        signal = Inside(fragment)._signal(names[0])
        if len(names) == 1:
            return signal
        start, stop = fields_of(signal, names[1:])
        return signal[start:stop]

    @property
    def component(self):
        """The component, for its ports."""
        return self._fragment.origins[0]

    def driven(self, name: str) -> tuple[str, Signal]:
        """The signal of that name driven in the component itself, and its domain."""
        return self._only(self._all_driven(name), "drives", name)

    def part(self, path: str):
        return self._part(path).origins[0]

    def word(self, path: str, address) -> Signal:
        """The memory's word at an address, through an added read port."""
        (memory,) = (part for part in fragments(self._part(path)) if isinstance(part, MemoryInstance))
        data = memory._data
        word = Signal(Shape.cast(data.shape).width, name=f"{path.replace('.', '_')}_word")
        address = Cat(Value.cast(address), Const(0, data.depth.bit_length()))[: ceil_log2(data.depth)]
        memory.read_port(domain="comb", addr=address, data=word, en=Const(1), transparent_for=())
        return word

    def registers_here(self) -> list[Signal]:
        """Registers of the component without its parts'."""
        return _driven(self._fragment, "sync")

    def registers(self) -> Iterator[Signal]:
        """Registers of the component and its parts."""
        for fragment in fragments(self._fragment):
            yield from _driven(fragment, "sync")

    def _signal(self, name: str) -> Signal:
        driven = self._all_driven(name)
        if driven:
            return self._only(driven, "drives", name)[1]
        read = SignalSet()
        for domain in self._fragment.statements:
            for statement in self._fragment.statements[domain]:
                read.update(signal for signal in statement._rhs_signals() if signal.name == name)
        return self._only(list(read), "drives or reads", name)

    def _all_driven(self, name: str) -> list[tuple[str, Signal]]:
        domains = self._fragment.statements
        return [(domain, one) for domain in domains for one in _driven(self._fragment, domain) if one.name == name]

    def _only(self, found: list[_Found], does: str, name: str) -> _Found:
        if len(found) != 1:
            owner = type(self.component).__name__
            raise LookupError(f"{owner} {does} {len(found) or 'no'} signals that are called {name!r}, not one")
        return found[0]

    def _part(self, path: str) -> Fragment:
        fragment = self._fragment
        for name in path.split("."):
            sub = _sub(fragment, name)
            if sub is None:
                raise LookupError(f"{type(fragment.origins[0]).__name__} has no part that is called {name!r}")
            fragment = sub
        return fragment


def fragments(fragment: Fragment) -> Iterator[Fragment]:
    """A fragment and all its descendants."""
    yield fragment
    for sub, _, _ in fragment.subfragments:
        yield from fragments(sub)


def fields_of(signal: Signal, names: Sequence[str]) -> tuple[int, int]:
    """First bit of a bundle's field and the one after its last; without names those of the whole signal."""
    start, stop, described = 0, len(signal), signal._format
    for name in names:
        fields = described._fields if isinstance(described, Format.Struct) else {}
        if name not in fields:
            raise LookupError(f"{signal.name} has no field that is called {name!r}")
        described = fields[name]
        part = described._value if isinstance(described, Format.Struct) else described._chunks[0][0]
        start, stop = start + part.start, start + part.stop
    return start, stop


def _sub(fragment: Fragment, name: str) -> Fragment | None:
    return next((sub for sub, known, _ in fragment.subfragments if known == name), None)


def _driven(fragment: Fragment, domain: str) -> list[Signal]:
    seen = SignalSet()
    for statement in fragment.statements.get(domain, ()):
        seen.update(statement._lhs_signals())
    return list(seen)
