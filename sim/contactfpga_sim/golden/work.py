"""What a labeller does with one frame."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class Departure:
    """A zone that leaves: so many clocks behind the one in which row ``row`` was handed over."""

    row: int
    clock: int
    area: int
    sum_x: int
    sum_y: int


@dataclasses.dataclass(frozen=True)
class Labelling:
    """A labeller's work on one frame."""

    busy: tuple[int, ...]
    """Clocks from each row to the next that can be handed over."""
    end: int
    """Clocks from the last row to the end mark."""
    departures: tuple[Departure, ...]
    """Zones in the order they leave."""
