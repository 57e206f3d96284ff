"""Bugs planted in the gateware to see that a proof finds them; the gateware knows nothing of them.

A bug names a class and a signal that is driven in it, and says what this gets instead of the right value. It is planted
in the elaborated design, so the source can be written in any way that drives a signal of that name.
"""

import dataclasses
from collections.abc import Callable

from amaranth.hdl import Fragment, Signal, Value
from amaranth.hdl._ast import Part
from amaranth.hdl._xfrm import StatementTransformer, ValueTransformer

from contactfpga_sim.verify.proofs.inside import Inside, fields_of, fragments


@dataclasses.dataclass(frozen=True)
class Bug:
    """A signal that gets a wrong value, in every component of a class."""

    name: str
    owner: type
    signal: str
    """Its name in the component that drives it; of a bundle with the field: ``join.place``."""
    wrong: Callable[[Value, Inside], object]
    """What it gets, from the right value and what else is in the component; of a register, in the next clock."""


def plant(bug: Bug, design: Fragment) -> None:
    """Change the elaborated design so that it has the bug.

    Raises LookupError when the design has no component of the class, or the class drives no signal of that name.
    """
    owners = [part for part in fragments(design) if isinstance((part.origins or (None,))[0], bug.owner)]
    if not owners:
        raise LookupError(f"{bug.name}: there is no {bug.owner.__name__} in the design")
    for part in owners:
        _change(bug, part)


def _change(bug: Bug, part: Fragment) -> None:
    """A new signal takes over the statements that drive the old one, which gets the wrong value."""
    inside = Inside(part)
    name, *fields = bug.signal.split(".")
    domain, signal = inside.driven(name)
    right = Signal(signal.shape(), name=f"{name}_right", init=signal.init)
    statements = part.statements[domain]
    if domain == "comb":
        part.statements[domain] = _Redirected({id(signal): right}).on_statements(statements)
    else:
        nobody = Signal.like(signal, name=f"{name}_unused")
        everything_else = {id(other): Signal.like(other, name="unused") for other in inside.registers_here()}
        following = _Redirected({**everything_else, id(signal): right}).on_statements(statements)
        part.add_statements("comb", right.eq(signal), *following)
        part.statements[domain] = _Redirected({id(signal): nobody}).on_statements(statements)
    part.add_statements(domain, signal.eq(right))
    start, stop = fields_of(signal, fields)
    part.add_statements(domain, signal[start:stop].eq(bug.wrong(right[start:stop], inside)))


class _Redirected(StatementTransformer):
    """Statements that assign to other signals under the same conditions; what they read stays."""

    def __init__(self, targets: dict[int, Signal]):
        self._target = _Target(targets)

    def on_value(self, value):
        return value

    def on_Assign(self, stmt):  # noqa: N802
        return type(stmt)(self._target(stmt.lhs), stmt.rhs)


class _Target(ValueTransformer):
    def __init__(self, targets: dict[int, Signal]):
        self._targets = targets

    def on_Signal(self, value):  # noqa: N802
        return self._targets.get(id(value), value)

    def on_Part(self, value):  # noqa: N802
        return Part(self(value.value), value.offset, value.width, value.stride)
