"""A knob, what comes out at each of its values, and where that stops being right."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping

import numpy as np

Place = tuple[float, float]
"""Column and row, in cells."""


@dataclasses.dataclass(frozen=True, eq=False)
class Outcome:
    """What came out at one value of the knob."""

    right: bool
    """It is what was there."""
    told: tuple[str, ...] = ()
    """Flags, counters and errors by which the system says that something is wrong."""
    what: str = ""
    """What came out, in a few words."""
    amount: float = 0.0
    """The number that the picture shows."""
    cells: np.ndarray | None = None
    """(rows, columns) bool to be drawn: what is pressed."""
    zones: tuple[Place, ...] = ()
    """Barycenters to be drawn: what was reported."""
    rate: str = ""
    """The share of draws that are right with its interval, where there was more than one."""

    @property
    def verdict(self) -> str:
        """``right``, ``told`` (wrong, and the system says so) or ``silent`` (wrong, and it does not)."""
        return "right" if self.right else "told" if self.told else "silent"


@dataclasses.dataclass(frozen=True)
class Knob:
    """One quantity that is moved until something breaks."""

    name: str
    """Of its picture's file."""
    title: str
    axis: str
    """What is moved, with its unit."""
    amount: str
    """What :attr:`Outcome.amount` is."""
    values: tuple[float, ...]
    """In the order in which the knob is moved."""
    runs: Mapping[str, Callable[[float], Outcome]]
    """What comes out at a value, for each method or setting that is compared."""
    helps: str
    """What to do about it."""
    format: str = "{:,g}"
    """How a value is written."""
    unnoticed: str = ""
    """Why nothing tells where :func:`Outcome.verdict` is ``silent``."""
    closed: Mapping[str, float] = dataclasses.field(default_factory=dict)
    """Where a closed form says that it breaks, for the methods that have one."""
    closed_form: str = ""
    """The closed form in words."""

    def sweep(
        self, step: Callable[[], None] = lambda: None, so_far: dict[str, Sweep] | None = None
    ) -> dict[str, Sweep]:
        """Every value, for every method; ``step()`` is called after each of these, and it is in ``so_far`` at once."""
        found = {} if so_far is None else so_far
        for name, run in self.runs.items():
            found[name] = Sweep(self.values, tuple(map(run, self.values)))
            step()
        return found


@dataclasses.dataclass(frozen=True)
class Sweep:
    """What came out at all values of a knob, for one method."""

    values: tuple[float, ...]
    outcomes: tuple[Outcome, ...]

    @property
    def broken(self) -> int | None:
        """Index of the first value at which it is not right; None if there is none."""
        return next((index for index, outcome in enumerate(self.outcomes) if not outcome.right), None)

    @property
    def breaks_at(self) -> float | None:
        """The first value at which it is not right."""
        return None if self.broken is None else self.values[self.broken]

    @property
    def holds_until(self) -> float | None:
        """The last value up to which all is right; None if the first one is not."""
        last = len(self.values) if self.broken is None else self.broken
        return self.values[last - 1] if last else None

    @property
    def warns_at(self) -> float | None:
        """The first value at which the system says that something is wrong, if all is still right there."""
        first = next((index for index, outcome in enumerate(self.outcomes) if outcome.told), None)
        return self.values[first] if first is not None and self.outcomes[first].right else None

    @property
    def silent_at(self) -> float | None:
        """The first value at which it is not right and nothing says so."""
        return next((value for value, outcome in zip(self.values, self.outcomes) if outcome.verdict == "silent"), None)

    @property
    def verdicts(self) -> tuple[str, ...]:
        """:attr:`Outcome.verdict` at each value."""
        return tuple(outcome.verdict for outcome in self.outcomes)
