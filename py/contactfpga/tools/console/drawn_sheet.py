"""A sheet drawn with characters, row 0 on top, from one frame.

A board that sends zones tells sizes and barycenters, but no shapes. So a thin circle shows the size of a zone.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable

import numpy as np

from contactfpga.zones.zone import Zones

Mask = Iterable[tuple[int, int]]

SCALES = (4, 2, 1)
"""Dots per cell, the largest drawing first. A braille character has 2 x 4 dots."""

ACROSS, DOWN = 2, 4

FREE, CELL, CIRCLE, CENTER, MASKED, SEEN, FLUTTERS, STUCK = range(8)

STYLES = {
    FREE: "dim",
    CELL: "",
    CIRCLE: "cyan",
    CENTER: "bold",
    MASKED: "",
    SEEN: "green",
    FLUTTERS: "bold yellow",
    STUCK: "bold red",
}

_BRAILLE = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
_HALVES = np.array([["·", "▄"], ["▀", "█"]])
_SIGNS = {
    True: {FREE: "·", CELL: "█", CIRCLE: "⠒", CENTER: "◎", MASKED: " ", SEEN: "○", FLUTTERS: "~", STUCK: "!"},
    False: {FREE: ".", CELL: "#", CIRCLE: "o", CENTER: "X", MASKED: " ", SEEN: "o", FLUTTERS: "~", STUCK: "!"},
}


@dataclasses.dataclass(frozen=True)
class Marks:
    """Knowledge of cells from earlier frames, (rows, columns) bool each."""

    seen: np.ndarray
    flutters: np.ndarray
    stuck: np.ndarray


@dataclasses.dataclass(frozen=True)
class SheetDrawing:
    """Characters, their meanings, and a line of explanation."""

    characters: np.ndarray
    """(lines, columns) of one character each."""
    kinds: np.ndarray
    legend: str

    @property
    def text(self) -> str:
        """The lines without trailing spaces."""
        return "\n".join("".join(line).rstrip() for line in self.characters)


def scales(zones: Zones, width: int, height: int | None) -> list[int]:
    """The :data:`SCALES` at which the sheet fits; the smallest if none does."""
    sizes = ((scale, *size(zones, scale)) for scale in SCALES)
    fit = [scale for scale, wide, high in sizes if wide <= width and (height is None or high <= height)]
    return fit or [SCALES[-1]]


def size(zones: Zones, scale: int) -> tuple[int, int]:
    """Columns and lines of text."""
    return -(-zones.sheet.columns * scale // ACROSS), -(-zones.sheet.rows * scale // DOWN)


def draw(
    zones: Zones, scale: int = SCALES[0], unicode: bool = True, mask: Mask = (), marks: Marks | None = None
) -> SheetDrawing:
    """The sheet of one frame. ``mask``: (row, column) of absent switches; ``marks``: of a board that sends cells."""
    wide, high = size(zones, scale)
    signs = _SIGNS[unicode]
    characters = np.full((high, wide), signs[FREE])
    kinds = np.full((high, wide), FREE)
    if scale == SCALES[0]:
        characters[:, 1::2] = " "  # one dot per cell
    masked = _masked(zones, mask)
    if marks is not None:
        seen = _blocks(_spread(marks.seen | masked, scale), filled=True).all(axis=(2, 3)) & (characters != " ")
        characters[seen], kinds[seen] = signs[SEEN], SEEN
    if zones.cells is not None:
        dots = _spread(zones.cells, scale)
        shown, kind = _cells(dots, scale, signs[CELL], unicode), CELL
    else:
        dots = _circles(zones, scale)
        shown, kind = _braille(dots) if unicode else np.full((high, wide), signs[CIRCLE]), CIRCLE
    some = _blocks(dots).any(axis=(2, 3))
    characters[some], kinds[some] = shown[some], kind
    if masked.any():
        nothing = _blocks(_spread(masked, scale), filled=True).all(axis=(2, 3))
        characters[nothing], kinds[nothing] = signs[MASKED], MASKED
    for kind, cells in () if marks is None else ((FLUTTERS, marks.flutters), (STUCK, marks.stuck)):
        some = _blocks(_spread(cells, scale)).any(axis=(2, 3))
        characters[some], kinds[some] = signs[kind], kind
    if zones.cells is None:
        for x, y in _centers(zones, scale):
            characters[y, x], kinds[y, x] = signs[CENTER], CENTER
    return SheetDrawing(characters, kinds, _legend(zones.cells is None, bool(masked.any()), scale, unicode, marks))


def _masked(zones: Zones, mask: Mask) -> np.ndarray:
    masked = np.zeros((zones.sheet.rows, zones.sheet.columns), bool)
    for row, column in mask:
        masked[row, column] = True
    return masked


def _legend(circles: bool, masked: bool, scale: int, unicode: bool, marks: Marks | None) -> str:
    signs = _SIGNS[unicode]
    rows, columns = DOWN // scale, ACROSS // scale
    if circles:
        parts = [f"{signs[CENTER]} barycenter", f"{signs[CIRCLE]} circle of the zone's area, not its cells"]
    elif scale == SCALES[-1] and unicode:
        parts = ["a dot is a pressed cell", f"{signs[FREE]} none pressed"]
    else:
        some = "" if unicode or scale == SCALES[0] else ", one of them at least"
        parts = [f"{signs[CELL]} pressed{some}", f"{signs[FREE]} not pressed"]
    if marks is not None:
        all_of = "" if scale == SCALES[0] else ", all of them"
        parts[-1:] = [f"{signs[SEEN]} pressed before{all_of}", f"{signs[FREE]} never pressed"]
        parts += [f"{signs[STUCK]} stuck"] * bool(marks.stuck.any())
        parts += [f"{signs[FLUTTERS]} flutters"] * bool(marks.flutters.any())
    if masked:
        parts.append("blank: no switch")
    if scale < SCALES[0]:
        parts.append(f"a character is {rows} rows x {columns} column{'s' if columns > 1 else ''}")
    return "; ".join(parts)


def _cells(dots: np.ndarray, scale: int, full: str, unicode: bool) -> np.ndarray:
    if scale == 1 and unicode:
        return _braille(dots)
    if scale == 2 and unicode:
        upper, lower = (_blocks(dots)[:, :, half, 0].astype(int) for half in (0, 2))
        halves: np.ndarray = _HALVES[upper, lower]
        return halves
    blocks = _blocks(dots)
    return np.full(blocks.shape[:2], full)


def _spread(cells: np.ndarray, scale: int) -> np.ndarray:
    spread: np.ndarray = cells.repeat(scale, axis=0).repeat(scale, axis=1)
    return spread


def _blocks(dots: np.ndarray, filled: bool = False) -> np.ndarray:
    """(lines, columns, 4, 2): the dots of each character, ``filled`` beyond the sheet or not."""
    high, wide = dots.shape
    padded = np.pad(dots, ((0, -high % DOWN), (0, -wide % ACROSS)), constant_values=filled)
    blocks: np.ndarray = padded.reshape(-(-high // DOWN), DOWN, -(-wide // ACROSS), ACROSS).swapaxes(1, 2)
    return blocks


def _braille(dots: np.ndarray) -> np.ndarray:
    codes = 0x2800 + (_blocks(dots) * _BRAILLE).sum(axis=(2, 3))
    return np.array([[chr(code) for code in line] for line in codes])


def _circles(zones: Zones, scale: int) -> np.ndarray:
    """(dots down, dots across) bool: a circle of each zone's area about its barycenter."""
    sheet = zones.sheet
    dots = np.zeros((sheet.rows * scale, sheet.columns * scale), bool)
    high, wide = dots.shape
    for (_, _, area_mm2), (x, y) in zip(_placed(zones), _places(zones, scale)):
        radius_mm = math.sqrt(area_mm2 / math.pi)
        across, down = scale * radius_mm / sheet.pitch_x_mm, scale * radius_mm / sheet.pitch_y_mm
        angles = np.linspace(0, 2 * math.pi, 8 * math.ceil(max(across, down)) + 8)
        columns = np.floor(x + across * np.cos(angles)).astype(int)
        columns = columns % wide if sheet.closed else columns
        rows = np.floor(y + down * np.sin(angles)).astype(int)
        inside = (columns >= 0) & (columns < wide) & (rows >= 0) & (rows < high)
        dots[rows[inside], columns[inside]] = True
    return dots


def _centers(zones: Zones, scale: int) -> Iterable[tuple[int, int]]:
    wide, high = size(zones, scale)
    for x, y in _places(zones, scale):
        column, line = math.floor(x / ACROSS), math.floor(y / DOWN)
        if 0 <= column < wide and 0 <= line < high:
            yield column, line


def _places(zones: Zones, scale: int) -> list[tuple[float, float]]:
    sheet = zones.sheet
    middle = (0.5 if scale < SCALES[0] else 0.25) * scale
    found = [
        (scale * x_mm / sheet.pitch_x_mm + middle, scale * y_mm / sheet.pitch_y_mm + scale / 2)
        for x_mm, y_mm, _ in _placed(zones)
    ]
    return [(x % (sheet.columns * scale), y) for x, y in found] if sheet.closed else found


def _placed(zones: Zones) -> list[tuple[float, float, float]]:
    return [(zone.x_mm, zone.y_mm, zone.area_mm2) for zone in zones if zone.x_mm is not None and zone.y_mm is not None]
