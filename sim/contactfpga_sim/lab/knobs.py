"""Knobs: parameters, with results at their values."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping

import numpy as np

Place = tuple[float, float]
"""Column and row in cells."""


@dataclasses.dataclass(frozen=True, eq=False)
class Outcome:
    right: bool
    told: tuple[str, ...] = ()
    """Flags, counters and errors."""
    what: str = ""
    amount: float = 0.0
    """Number in the picture."""
    cells: np.ndarray | None = None
    """(rows, columns) bool, to draw."""
    zones: tuple[Place, ...] = ()
    rate: str = ""
    """Share of correct draws, if several."""

    @property
    def verdict(self) -> str:
        """``right``, ``told`` (wrong and reported) or ``silent`` (wrong and unreported)."""
        return "right" if self.right else "told" if self.told else "silent"


@dataclasses.dataclass(frozen=True)
class Knob:
    name: str
    title: str
    axis: str
    """The quantity with its unit."""
    amount: str
    """Meaning of :attr:`Outcome.amount`."""
    values: tuple[float, ...]
    runs: Mapping[str, Callable[[float], Outcome]]
    """Outcome at a value, by method or setting."""
    helps: str
    format: str = "{:,g}"
    unnoticed: str = ""
    """Why nothing reports a ``silent`` fault."""
    closed: Mapping[str, float] = dataclasses.field(default_factory=dict)
    """Break points by closed form, by method."""

    def sweep(
        self, step: Callable[[], None] = lambda: None, so_far: dict[str, Sweep] | None = None
    ) -> dict[str, Sweep]:
        """Outcomes of all values and methods. Each enters ``so_far``, then ``step()`` is called."""
        found = {} if so_far is None else so_far
        for name, run in self.runs.items():
            found[name] = Sweep(self.values, tuple(map(run, self.values)))
            step()
        return found


@dataclasses.dataclass(frozen=True)
class Sweep:
    values: tuple[float, ...]
    outcomes: tuple[Outcome, ...]

    @property
    def broken(self) -> int | None:
        """Index of the first wrong value, or None."""
        return next((index for index, outcome in enumerate(self.outcomes) if not outcome.right), None)

    @property
    def breaks_at(self) -> float | None:
        return None if self.broken is None else self.values[self.broken]

    @property
    def holds_until(self) -> float | None:
        """Last value up to which all are right, or None."""
        last = len(self.values) if self.broken is None else self.broken
        return self.values[last - 1] if last else None

    @property
    def warns_at(self) -> float | None:
        """First value with a warning, if still right."""
        first = next((index for index, outcome in enumerate(self.outcomes) if outcome.told), None)
        return self.values[first] if first is not None and self.outcomes[first].right else None

    @property
    def silent_at(self) -> float | None:
        """The first ``silent`` value."""
        return next((value for value, outcome in zip(self.values, self.outcomes) if outcome.verdict == "silent"), None)

    @property
    def verdicts(self) -> tuple[str, ...]:
        return tuple(outcome.verdict for outcome in self.outcomes)
