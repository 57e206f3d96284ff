"""The items of a board, for any file format: parts, tracks, vias, holes, print.

Lengths are in mm seen from the top side, y down; cell (row 0, column 0) is at (0, 0).
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from typing import Literal

from contactfpga.design.sheet.parts import Pad, Part

Layer = Literal["F", "B"]

TRACK_MM = 0.2
POWER_MM = 0.5
CLEARANCE_MM = 0.2
VIA_MM = 0.6
VIA_DRILL_MM = 0.3
EDGE_MM = 0.3
"""Clearance between copper and the board's edge."""
PRINT_MM = 0.12
MASK_MM = 0.05
"""Growth of a solder mask opening over its pad on each side."""

BOARDS = {"plane": (1.6, 1.53, 4.4), "cylinder": (0.2, 0.1, 3.4)}
"""Board thickness and distance of copper layers in mm, and permittivity: of FR-4, or of a polyimide flex."""

GND = "GND"
SUPPLY = "3V3"


def rounded(value: float) -> float:
    """The value rounded to a nanometer, the unit of board files; never -0."""
    return round(value, 6) + 0.0


@dataclasses.dataclass(frozen=True)
class PlacedPart:
    reference: str
    part: Part
    value: str
    x: float
    y: float
    turn: int
    """Rotation in degrees counterclockwise after mirroring for the back, in quarters."""
    back: bool
    nets: dict[str, str]
    """Net of each connected pad, by number."""

    def spot(self, x: float, y: float) -> tuple[float, float]:
        """Board position of a point of the part's drawing."""
        if self.back:
            y = -y
        c, s = round(math.cos(math.radians(self.turn))), round(math.sin(math.radians(self.turn)))
        return rounded(self.x + x * c + y * s), rounded(self.y - x * s + y * c)

    def size(self, pad: Pad) -> tuple[float, float]:
        return (pad.height, pad.width) if self.turn % 180 else (pad.width, pad.height)


@dataclasses.dataclass(frozen=True)
class CopperTrack:
    """A straight piece of copper with round ends."""

    x1: float
    y1: float
    x2: float
    y2: float
    layer: Layer
    net: str
    width: float = TRACK_MM

    @property
    def length(self) -> float:
        return math.hypot(self.x2 - self.x1, self.y2 - self.y1)


@dataclasses.dataclass(frozen=True)
class Via:
    """A plated hole that joins both sides, covered by the solder mask."""

    x: float
    y: float
    net: str


@dataclasses.dataclass(frozen=True)
class Stroke:
    x1: float
    y1: float
    x2: float
    y2: float
    layer: Layer


@dataclasses.dataclass(frozen=True)
class Hole:
    x: float
    y: float
    drill: float


class Drawing:
    """A board under construction; the same calls give the same files."""

    def __init__(self) -> None:
        self.placed: list[PlacedPart] = []
        self.tracks: list[CopperTrack] = []
        self.vias: list[Via] = []
        self.strokes: list[Stroke] = []
        self.holes: list[Hole] = []
        self.outline: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
        """Left, top, right and bottom edges."""
        self._counts: dict[str, int] = {}

    def place(
        self,
        letter: str,
        part: Part,
        value: str,
        place: tuple[float, float],
        nets: dict[str, str],
        turn: int = 0,
        back: bool = True,
    ) -> PlacedPart:
        """Add a part; its reference is the letter with the next number."""
        self._counts[letter] = number = self._counts.get(letter, 0) + 1
        one = PlacedPart(f"{letter}{number}", part, value, rounded(place[0]), rounded(place[1]), turn, back, nets)
        self.placed.append(one)
        for x1, y1, x2, y2 in part.marks:
            self.stroke(*one.spot(x1, y1), *one.spot(x2, y2), "B" if back else "F")
        return one

    def run(self, net: str, layer: Layer, *points: tuple[float, float], width: float = TRACK_MM) -> None:
        """Add tracks between successive points; repeated points add none."""
        spots = [(rounded(x), rounded(y)) for x, y in points]
        for a, b in itertools.pairwise(spots):
            if a != b:
                self.tracks.append(CopperTrack(*a, *b, layer, net, width))

    def via(self, net: str, x: float, y: float) -> None:
        self.vias.append(Via(rounded(x), rounded(y), net))

    def stroke(self, x1: float, y1: float, x2: float, y2: float, layer: Layer = "F") -> None:
        self.strokes.append(Stroke(rounded(x1), rounded(y1), rounded(x2), rounded(y2), layer))

    def number(self, value: int, x: float, y: float, upright: bool = True, height: float = 0.8) -> None:
        """Print a number on the top side, centered at (x, y); without ``upright`` it reads upward."""
        digits = str(value)
        step, tall = 0.8 * height, height / 2
        corners = {0: (0, -1), 1: (1, -1), 2: (0, 0), 3: (1, 0), 4: (0, 1), 5: (1, 1)}
        for place, digit in enumerate(digits):
            left = (place - len(digits) / 2) * step + 0.15 * step
            for a, b in _SEGMENTS[digit]:
                ends = [(left + corners[k][0] * 0.6 * step, corners[k][1] * tall) for k in (a, b)]
                if not upright:
                    ends = [(v, -u) for u, v in ends]
                (u1, v1), (u2, v2) = ends
                self.stroke(x + u1, y + v1, x + u2, y + v2)

    def nets(self) -> list[str]:
        found = {net for one in self.placed for net in one.nets.values()}
        return sorted(found | {track.net for track in self.tracks} | {via.net for via in self.vias})


_SEGMENTS = {
    digit: [((0, 1), (1, 3), (3, 5), (4, 5), (2, 4), (0, 2), (2, 3))["abcdefg".index(letter)] for letter in letters]
    for digit, letters in zip(
        "0123456789",
        ["abcdef", "bc", "abdeg", "abcdg", "bcfg", "acdfg", "acdefg", "abc", "abcdefg", "abcdfg"],
        strict=True,
    )
}
