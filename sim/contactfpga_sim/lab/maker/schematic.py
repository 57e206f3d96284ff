"""Schematic for docs/maker.md: a corner of a sheet with guard lines."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from contactfpga import picture_style as style

SIZE = 4
STEP = 1.5
LEFT, TOP = 2.6, 2.1
WIRE = {"color": style.INK, "lw": 1.2, "solid_capstyle": "round"}


def draw(path: Path) -> Path:
    import matplotlib as mpl

    with mpl.rc_context(style.SETTINGS):
        figure = style.new(7.3)
        axes = figure.subplots()
        axes.set_aspect("equal")
        axes.axis("off")
        for index in range(SIZE + 1):
            _row(axes, index)
            _column(axes, index)
        for row in range(SIZE + 1):
            for column in range(SIZE + 1):
                if (row, column) != (SIZE, SIZE):
                    _cell(axes, row, column)
        _gaps(axes)
        _words(axes)
        axes.set_xlim(-1.2, _x(SIZE) + 1.6)
        axes.set_ylim(_y(SIZE) - 1.9, TOP + 2.0)
        return style.save(figure, path)


def _x(column: int) -> float:
    return LEFT + 0.9 + STEP * column


def _y(row: int) -> float:
    return 0.4 - STEP * row


def _name(kind: str, index: int) -> str:
    if index == SIZE:
        return f"guard\n{kind}"
    return f"{kind} {index}" if index < SIZE - 1 else f"last\n{kind}"


def _color(guard: bool) -> str:
    return style.VERMILLION if guard else style.INK


def _row(axes: Any, row: int) -> None:
    y, color = _y(row), _color(row == SIZE)
    axes.text(0, y, _name("row", row), ha="right", va="center", color=color)
    _line(axes, [(0.1, y), (0.5, y)], color)
    _resistor(axes, 0.5, y, upright=False)
    _line(axes, [(1.1, y), (_x(SIZE) + (-0.75 if row == SIZE else 0.75), y)], color)
    axes.plot(0.1, y, "s", color=color, ms=4)
    x = LEFT - 0.75
    _dot(axes, x, y)
    _resistor(axes, x, y - 0.65, upright=True, ls=style.DASHES[2])
    _line(axes, [(x, y), (x, y - 0.05)], style.SOFT)
    _ground(axes, x, y - 0.65)


def _column(axes: Any, column: int) -> None:
    x, color = _x(column), _color(column == SIZE)
    axes.text(x, TOP + 1.42, _name("column", column), ha="center", va="bottom", color=color)
    axes.plot(x, TOP + 1.3, "s", color=color, ms=4)
    _line(axes, [(x, TOP + 1.3), (x, TOP + 1.0)], color)
    _resistor(axes, x, TOP + 0.4, upright=True)
    _line(axes, [(x, TOP + 0.4), (x, _y(SIZE) + 0.75)], color)
    right = x + 0.55
    _dot(axes, x, TOP - 0.3)
    _line(axes, [(x, TOP - 0.3), (right, TOP - 0.3), (right, TOP - 0.2)], style.SOFT)
    _resistor(axes, right, TOP - 0.2, upright=True)
    _line(axes, [(right - 0.15, TOP + 0.5), (right + 0.15, TOP + 0.5)], style.SOFT)
    _line(axes, [(right, TOP + 0.4), (right, TOP + 0.5)], style.SOFT)
    axes.text(right + 0.05, TOP + 0.58, "3.3 V", ha="center", va="bottom", color=style.SOFT, fontsize=style.SMALL)


def _cell(axes: Any, row: int, column: int) -> None:
    x, y = _x(column), _y(row)
    guard = SIZE in (row, column)
    color, place = _color(guard), x + 0.5
    _dot(axes, x, y + 0.85, color)
    _line(axes, [(x, y + 0.85), (place, y + 0.85), (place, y + 0.8)], color)
    if guard:
        _line(axes, [(place, y + 0.8), (place, y + 0.42)], color)
    else:
        _line(axes, [(place, y + 0.8), (place + 0.2, y + 0.52)], color)
        _line(axes, [(place, y + 0.5), (place, y + 0.42)], color)
    axes.fill([place - 0.13, place + 0.13, place], [y + 0.42, y + 0.42, y + 0.2], fc=color, ec=color, lw=1)
    _line(axes, [(place - 0.13, y + 0.2), (place + 0.13, y + 0.2)], color)
    _line(axes, [(place, y + 0.2), (place, y)], color)
    _dot(axes, place, y, color)


def _gaps(axes: Any) -> None:
    for index in range(SIZE + 1):
        for x, y, turn in ((_x(SIZE - 1) - 0.4, _y(index), 0), (_x(index), _y(SIZE - 1) + 1.2, 90)):
            gap = {"boxstyle": "square,pad=0.05", "fc": style.CARD, "ec": "none"}
            axes.text(x, y, "···", ha="center", va="center", rotation=turn, fontweight="bold", bbox=gap, zorder=4)


def _words(axes: Any) -> None:
    axes.text(0.8, _y(0) + 0.2, "33 Ω", ha="center", va="bottom")
    axes.text(_x(0) - 0.15, TOP + 0.7, "33 Ω", ha="right", va="center")
    axes.text(LEFT - 0.95, _y(0) - 0.35, "5.6 kΩ", ha="right", va="center")
    axes.text(_x(0) + 0.72, TOP + 0.1, "22 kΩ", ha="left", va="center")
    x, y = _x(SIZE), _y(SIZE)
    axes.text(x + 0.12, y + 0.45, "stays open", ha="left", va="center", color=style.VERMILLION)
    said = (
        "Squares: pins of the FPGA board. Dashed: only where the scan reads rows (reversal).\n"
        "The guard lines are soldered at the far ends, through a diode each and without a switch,\n"
        "so that a signal has passed the whole line."
    )
    axes.text(-1.1, y - 1.15, said, ha="left", va="top", color=style.SOFT)


def _line(axes: Any, points: list[tuple[float, float]], color: str) -> None:
    axes.plot(*zip(*points, strict=True), **(WIRE | {"color": color}))


def _dot(axes: Any, x: float, y: float, color: str = style.INK) -> None:
    axes.plot(x, y, "o", color=color, ms=3)


def _resistor(axes: Any, x: float, y: float, upright: bool, ls: Any = "solid") -> None:
    from matplotlib.patches import Rectangle

    corner, size = ((x - 0.11, y), (0.22, 0.6)) if upright else ((x, y - 0.11), (0.6, 0.22))
    axes.add_patch(Rectangle(corner, *size, fc=style.CARD, ec=style.INK, lw=1.2, ls=ls, zorder=3))


def _ground(axes: Any, x: float, y: float) -> None:
    for step, width in ((0.0, 0.16), (0.07, 0.1), (0.14, 0.04)):
        _line(axes, [(x - width, y - 0.05 - step), (x + width, y - 0.05 - step)], style.SOFT)
    _line(axes, [(x, y), (x, y - 0.05)], style.SOFT)
