"""Channel routing: joins pins above a strip of the board with pins below it.

Each net has a level on the top side by the left-edge rule (Hashimoto and Stevens, 1971); a track on the back leads from
each pin to its level. Pins above are half a :class:`Grid` step aside, so no two of these tracks meet.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable

from contactfpga.design.sheet.drawing import CLEARANCE_MM, GND, POWER_MM, SUPPLY, TRACK_MM, VIA_MM, Drawing

GRID_MM = 1.27
LEVEL_MM = VIA_MM / 2 + CLEARANCE_MM + TRACK_MM / 2
"""Distance of levels: a via beside a track."""
APART_MM = VIA_MM + CLEARANCE_MM
"""Distance between the ends of two nets on one level."""
POWERED = (GND, SUPPLY)
"""Power nets, whose levels are wider and first."""


@dataclasses.dataclass(frozen=True)
class Pin:
    """A net's end at the channel; its track on the back starts at ``y``."""

    net: str
    x: float
    y: float


@dataclasses.dataclass(frozen=True)
class Grid:
    """Places along the channel, :data:`GRID_MM` apart; ``origin`` is a place for pins below."""

    origin: float

    def near(self, x: float, below: bool) -> float:
        """The place nearest to x for a pin below or above the channel."""
        shift = self.origin if below else self.origin + GRID_MM / 2
        return round((x - shift) / GRID_MM) * GRID_MM + shift


def levels(pins: Iterable[Pin]) -> dict[str, int]:
    """Level of each net with two or more pins, 0 at the bottom."""
    ends: dict[str, tuple[float, float, int]] = {}
    for pin in pins:
        low, high, count = ends.get(pin.net, (math.inf, -math.inf, 0))
        ends[pin.net] = min(low, pin.x), max(high, pin.x), count + 1
    routed = sorted((net for net in ends if ends[net][2] > 1), key=lambda net: (*ends[net], net))
    found: dict[str, int] = {}
    filled: list[float] = []
    for net in (net for net in routed if net in POWERED):
        found[net] = len(filled)
        filled += [math.inf, math.inf]  # wide tracks take two
    for net in (net for net in routed if net not in POWERED):
        low, high, _ = ends[net]
        level = next((k for k, end in enumerate(filled) if low - end >= APART_MM), len(filled))
        filled[level:] = [high, *filled[level + 1 :]]
        found[net] = level
    return found


def height(pins: Iterable[Pin]) -> float:
    found = levels(pins)
    return LEVEL_MM * (max((level + (net in POWERED) for net, level in found.items()), default=0) + 2)


def join(drawing: Drawing, pins: list[Pin], bottom: float) -> None:
    """Draw the tracks; the channel extends from ``bottom`` up by its :func:`height`."""
    for net, level in levels(pins).items():
        powered = net in POWERED
        y = bottom - LEVEL_MM * (level + 1 + powered / 2)
        own = sorted({(pin.x, pin.y) for pin in pins if pin.net == net})
        for x, start in own:
            drawing.run(net, "B", (x, start), (x, y))
            drawing.via(net, x, y)
        places = [(x, y) for x in sorted({x for x, _ in own})]
        drawing.run(net, "F", *places, width=POWER_MM if powered else TRACK_MM)
