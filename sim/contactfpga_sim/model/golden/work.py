"""What a labeller does with one frame, and the rule that says so."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np


@dataclasses.dataclass(frozen=True)
class Departure:
    """A zone that leaves: this many clocks after the one in which row ``row`` was handed over."""

    row: int
    clock: int
    area: int
    sum_x: int
    sum_y: int
    turned: int = 0
    """Where the sheet's ends meet: :func:`contactfpga_sim.model.golden.zones.turned`."""


@dataclasses.dataclass(frozen=True)
class Labelling:
    """A labeller's work on one frame."""

    busy: tuple[int, ...]
    """Clocks from each row to the next that can be handed over."""
    end: int
    """Clocks from the last row to the end mark."""
    departures: tuple[Departure, ...]
    """Zones in the order they leave."""


Strips = Callable[[np.ndarray, int], tuple[np.ndarray, np.ndarray, np.ndarray]]


@dataclasses.dataclass(frozen=True)
class LabellerRule:
    """The golden rule of a labeller."""

    frame: Callable[[np.ndarray, int], Labelling]
    """Its work on (R, C) bool cells with this connectivity."""
    strips: Strips | None = None
    """The clocks of every row of (N, R, C) bool frames at once, for volume tests: when a zone leaves whose last cluster
    is that of the cell, when the next row can come, and when an end mark leaves; (N, R, C), (N, R) and (N, R) int64.
    Only exact labellers have it."""
    closed: LabellerRule | None = None
    """The same of sheets whose ends meet; None: it takes none."""
