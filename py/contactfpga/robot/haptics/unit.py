"""One pressure unit: where it stands, and what its readings mean."""

from __future__ import annotations

import dataclasses

from contactfpga.robot.haptics.answer import Vector


@dataclasses.dataclass(frozen=True)
class Unit:
    """One unit. It pushes the bumper along its axis, and reads how hard."""

    point_m: Vector
    axis: Vector
    """Unit vector."""
    gain_n: float = 1.0
    """Newtons per step of its reading."""
    zero: float = 0.0
    """Its reading while nothing touches."""
    sigma_n: float = 0.05
    """Standard deviation of its noise."""
    range: tuple[float, float] | None = None
    """Readings at its ends: a unit that reads one of them is saturated. None: it has none."""
    preload_n: float | None = None
    """What a spring presses it with while nothing touches. None: not known, and whether it lifts is not told."""
