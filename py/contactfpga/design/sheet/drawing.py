"""The items of a board, for any file format: parts, tracks, vias, holes, print.

Lengths are in mm seen from the top side, y down; cell (row 0, column 0) is at (0, 0).
"""

from __future__ import annotations

import dataclasses
import itertools
import math
import re
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
PRINT_MM = 0.15
TEXT_MM = 1.0
"""Height of printed text. With :data:`PRINT_MM` it is the least that :mod:`contactfpga.design.sheet.houses` print."""
LETTER_MM = 0.8
"""Width of a letter and the space after it, in heights."""

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
        """Left, top, right and bottom edges without tabs."""
        self.tab_mm = 0.0
        """Length and width of the tabs at the right ends of the upper and lower margin; 0 for none."""
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
        label: tuple[float, float, bool] | None = None,
    ) -> PlacedPart:
        """Add a part; its reference is the letter with the next number, printed at ``label``: the offset in x and y,
        and whether it reads upward (:meth:`text`)."""
        self._counts[letter] = number = self._counts.get(letter, 0) + 1
        one = PlacedPart(f"{letter}{number}", part, value, rounded(place[0]), rounded(place[1]), turn, back, nets)
        self.placed.append(one)
        for x1, y1, x2, y2 in part.marks:
            self.stroke(*one.spot(x1, y1), *one.spot(x2, y2), "B" if back else "F")
        if label:
            self.text(one.reference, one.x + label[0], one.y + label[1], "B" if back else "F", label[2])
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

    def text(
        self, words: str, x: float, y: float, layer: Layer = "F", upward: bool = False, height: float = TEXT_MM
    ) -> None:
        """Print words centered at (x, y), as read from their side; with ``upward`` they begin at (x, y) and read
        upward. Characters without a glyph are blank."""
        unit, mirror = height / 4, -1 if layer == "B" else 1
        start = 0.0 if upward else -width_mm(words, height) / 2
        for place, letter in enumerate(words.upper()):
            for line in _GLYPHS.get(letter, "").split("/"):
                spots = [(int(u), int(v) - 2) for u, v in zip(line[::2], line[1::2], strict=True)]
                along = [(start + place * LETTER_MM * height + u * unit, v * unit) for u, v in spots]
                ends = [(mirror * v, -u) if upward else (mirror * u, v) for u, v in along]
                for (u1, v1), (u2, v2) in itertools.pairwise(ends):
                    self.stroke(x + u1, y + v1, x + u2, y + v2, layer)

    def corner(self, x: float, y: float) -> tuple[float, float]:
        """A place from the lower left corner of the board, y up, as files for a board house have it."""
        return rounded(x - self.outline[0]), rounded(self.outline[3] - y)

    def bounds(self) -> tuple[float, float, float, float]:
        """Left, top, right and bottom ends with tabs."""
        left, top, right, bottom = self.outline
        return left, top, right + self.tab_mm, bottom

    def edge(self) -> list[tuple[float, float]]:
        """Corners of the board, the first one again as the last."""
        (left, top, right, bottom), tab = self.outline, self.tab_mm
        notch = [(right + tab, top + tab), (right, top + tab), (right, bottom - tab), (right + tab, bottom - tab)]
        ends = (right + tab, top), (right + tab, bottom)
        return [(left, top), ends[0], *(notch if tab else ()), ends[1], (left, bottom), (left, top)]

    def nets(self) -> list[str]:
        found = {net for one in self.placed for net in one.nets.values()}
        return sorted(found | {track.net for track in self.tracks} | {via.net for via in self.vias})


def width_mm(words: str, height: float = TEXT_MM) -> float:
    """Width of printed words without the space after the last letter."""
    return height * (LETTER_MM * len(words) - LETTER_MM + 0.5)


_GLYPHS = {
    glyph[0]: glyph[2:]
    for glyph in re.findall(
        r"\S+",
        "A:0401102124/0222 B:0400102112/0212231404 C:211001031423 D:00041423211000 E:20000424/0212 F:200004/0212 "
        "G:2110010314232212 H:0004/2024/0222 I:0020/1014/0424 J:20231403 K:0004/200224 L:000424 M:0400122024 "
        "N:04002420 O:10010314232110 P:040010211202 Q:10010314232110/1324 R:040010211202/1224 S:21100112231403 "
        "T:0020/1014 U:0003142320 V:001420 W:0004122420 X:0024/2004 Y:001220/1214 Z:00200424 0:10010314232110/0321 "
        "1:011014/0424 2:0110210424 3:002012231403 4:14100323 5:20000212231403 6:2110010314231202 7:002014 "
        "8:100112231403122110 9:0314232110011222 -:0222 +:0222/1113 _:0424 .:1314 /:0420",
    )
}
"""Strokes of each printed character, joined by "/": points of a grid 2 wide and 4 high, x and y of each in a digit."""
