"""Rows, columns, origin and scale beside a sheet."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from contactfpga.tools.view import picture
from contactfpga.tools.view.tiles import MM, Tiles

if TYPE_CHECKING:
    import viser

BEYOND = 1.1
MARKS = 4
AXIS = 2.5


@dataclasses.dataclass(frozen=True)
class Mark:
    text: str
    point: np.ndarray
    """(3,) in m, in the sheet's frame."""


@dataclasses.dataclass(frozen=True)
class Ruler:
    """Lines and texts, in m, in the sheet's frame."""

    axes: np.ndarray
    """(n, 2, 3): from the origin along x and along y."""
    marks: tuple[Mark, ...]


def ruler(tiles: Tiles, lift_mm: float = 0.5) -> Ruler:
    """Ruler of a sheet. For a closed sheet, row numbers are along the seam and opposite."""
    sheet = tiles.sheet
    pitch_x, pitch_y = sheet.pitch_x_mm, sheet.pitch_y_mm

    def at(x_mm: float, y_mm: float) -> np.ndarray:
        point, normal = tiles.surface.place(x_mm, y_mm)
        return (np.array(point) + lift_mm * np.array(normal)) * MM

    left, below = (-0.5 if sheet.closed else -BEYOND) * pitch_x, -BEYOND * pitch_y
    marks = [Mark(named("column", n, pitch_x), at(n * pitch_x, below)) for n in numbers(sheet.columns)]
    for x_mm in (left, left + sheet.columns / 2 * pitch_x) if sheet.closed else (left,):
        marks += [Mark(named("row", n, pitch_y), at(x_mm, n * pitch_y)) for n in numbers(sheet.rows)]
    steps = np.linspace(0, AXIS, 9)
    along_x, along_y = ([at(x * step, y * step) for step in steps] for x, y in ((pitch_x, 0), (0, pitch_y)))
    marks += [Mark("x", along_x[-1]), Mark("y", along_y[-1])]
    return Ruler(np.concatenate([_segments(each) for each in (along_x, along_y)]), tuple(marks))


def add(server: viser.ViserServer, node: str, tiles: Tiles, lift_mm: float) -> None:
    drawn, scene = ruler(tiles, lift_mm), server.scene
    scene.add_line_segments(f"{node}/axes", drawn.axes, picture.AXIS, thickness=2.5, thickness_units="screen")
    for number, mark in enumerate(drawn.marks):
        where = {"position": mark.point, "anchor": "center-center", "depth_test": tiles.sheet.closed}
        scene.add_label(f"{node}/mark{number}", mark.text, font_screen_scale=0.7, **where)


def numbers(count: int) -> range:
    """About MARKS of ``count`` line numbers, evenly spaced from the first."""
    return range(0, count, max(1, round(count / MARKS)))


def named(kind: str, number: int, pitch_mm: float) -> str:
    return f"{kind} 0" if number == 0 else f"{number}: {number * pitch_mm:.0f} mm"


def _segments(points: list[np.ndarray]) -> np.ndarray:
    return np.stack([np.array(points[:-1]), np.array(points[1:])], axis=1)
