"""How far two contacts may squeeze the link between them: the exact range that friction's cones allow."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

from contactfpga.robot.haptics.answer import Vector
from contactfpga.robot.haptics.contact import Interval
from contactfpga.robot.haptics.vectors import dot

ROUNDING = 1e-9
"""Share of a force that is rounding."""

Range = tuple[float, float]
"""Of the squeeze in N; its ends may be infinite."""


@dataclasses.dataclass(slots=True)
class Line:
    """The forces at one of two contacts: ``start`` plus any squeeze times ``along``."""

    start: Vector
    along: Vector
    normal: Vector
    push: float = 0.0
    """At no squeeze."""
    more: float = 0.0
    """Push per newton of squeeze."""

    def __post_init__(self) -> None:
        self.push, self.more = -dot(self.normal, self.start), -dot(self.normal, self.along)

    def force(self, squeeze: float) -> Vector:
        """At this squeeze."""
        (x, y, z), (ax, ay, az) = self.start, self.along
        return x + squeeze * ax, y + squeeze * ay, z + squeeze * az

    def pushes(self, allowed: Range) -> Interval:
        """Least and largest push."""
        push, more = self.push, self.more
        if abs(more) <= ROUNDING:
            push = max(0.0, push)
            return push, push
        first, second = push + more * allowed[0], push + more * allowed[1]
        least, largest = (first, second) if first < second else (second, first)
        return max(0.0, least), None if largest == math.inf else max(0.0, largest)

    def pushing(self) -> Range | None:
        """Squeezes at which the contact does not pull."""
        if abs(self.more) <= ROUNDING:
            return (-math.inf, math.inf) if self.push >= 0 else None
        turn = -self.push / self.more
        return (turn, math.inf) if self.more > 0 else (-math.inf, turn)

    def within(self, friction: float) -> Range | None:
        """Squeezes at which the force lies in friction's cone: |f|^2 <= (1 + mu^2) push^2, a quadratic."""
        wide = 1 + friction * friction
        square = 1 - wide * self.more * self.more
        slope = dot(self.start, self.along) - wide * self.push * self.more
        level = dot(self.start, self.start) - wide * self.push * self.push
        if abs(square) <= ROUNDING:  # the line runs along the cone
            return both(self.pushing(), _below(2 * slope, level))
        under = slope * slope - square * level
        if under < 0:
            if under < -ROUNDING * (slope * slope + abs(square * level)):
                return None
            under = 0.0
        root = math.sqrt(under)
        low, high = sorted(((-slope - root) / square, (-slope + root) / square))
        if square < 0:
            return (high, math.inf) if self.more > 0 else (-math.inf, low)
        middle = self.push - self.more * slope / square
        return (low, high) if middle >= -ROUNDING * abs(self.push) else None


def _below(slope: float, level: float) -> Range | None:
    """Where slope t + level <= 0."""
    if abs(slope) <= ROUNDING:
        return (-math.inf, math.inf) if level <= ROUNDING else None
    end = -level / slope
    return (-math.inf, end) if slope > 0 else (end, math.inf)


def both(first: Range | None, second: Range | None) -> Range | None:
    """What lies in both ranges; a gap of rounding between them counts as a common point."""
    if first is None or second is None:
        return None
    low, high = max(first[0], second[0]), min(first[1], second[1])
    if low <= high:
        return low, high
    if low - high <= ROUNDING * (abs(low) + abs(high)):
        return (low + high) / 2, (low + high) / 2
    return None


def least_sideways(lines: Sequence[Line], allowed: Range) -> float:
    """The squeeze with the smallest squares of the parts along the surface; where it changes none, the smallest."""
    curve = slope = 0.0
    for line in lines:
        curve += 1 - line.more * line.more
        slope += dot(line.start, line.along) - line.push * line.more
    if curve > ROUNDING:
        return min(max(-slope / curve, allowed[0]), allowed[1])
    low, high = allowed
    return low if lines[0].more + lines[1].more > 0 else high
