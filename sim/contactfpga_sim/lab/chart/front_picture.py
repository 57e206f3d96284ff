"""The README's picture: covers, pitches and closing forces.

Labellers, reports and rates that change little are only in the table.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator

from contactfpga import picture_style as style
from contactfpga_sim.lab.chart import picture as chart
from contactfpga_sim.lab.chart.compute import Point, reached_us, to_build

FAMILY = "fingers"


Spot = tuple[float, float]
"""Offset of words from their mark, in points."""


class Row(NamedTuple):
    """Methods that differ in one setting."""

    color: str
    mark: str
    methods: dict[str, str]
    """Methods by the words at their marks."""
    spot: Spot = (8, 0)
    others: dict[tuple[str, str], Spot | None] = {}  # noqa: RUF012 - it is not changed
    """Offsets by words and error in place of ``spot``; None: no words."""


ROWS = {
    "foam cut into tiles, domes of 0.4 N, 12 MHz and 3 Mbaud": Row(
        style.BLUE,
        "o",
        {f"{pitch} mm": f"run, {pitch} mm, tiles" for pitch in ("20", "10", "8", "6.4", "5")},
        (-7, 0),
        {("6.4 mm", "barycenter_mm"): (-6, 10)},
    ),
    "the same by line reversal, 24 MHz and 12 Mbaud": Row(
        style.GREEN,
        "x",
        {f"x{pitch}": f"reversal, {pitch} mm, tiles" for pitch in ("10", "6.4", "5")},
        others={
            (f"x{pitch}", error): None for pitch in ("10", "6.4", "5") for error in ("miscounted", "barycenter_mm")
        },
    ),
    "tiles 6.4 mm apart, domes of another force": Row(
        style.PURPLE,
        "s",
        {f"{force} N": f"run, 6.4 mm, tiles, {force} N" for force in ("0.2", "0.6", "1")},
        others={
            ("0.2 N", "miscounted"): (-10, 0),
            ("0.6 N", "miscounted"): (7, -4),
            ("0.2 N", "barycenter_mm"): (-10, -4),
            ("0.6 N", "barycenter_mm"): (3, -10),
        },
    ),
    "one whole foam": Row(
        style.ORANGE,
        "^",
        {f"{pitch} mm": f"run, {pitch} mm, caps" for pitch in ("10", "6.4")},
        others={("6.4 mm", "barycenter_mm"): None},
    ),
    "switch and foam of the paper": Row(
        style.VERMILLION,
        "D",
        {f"{pitch} mm": f"run, {pitch} mm, paper" for pitch in ("10", "6.4")},
        (-8, 0),
        {("10 mm", "miscounted"): (-8, -13), ("10 mm", "barycenter_mm"): (6, 11)},
    ),
    "no cover: a limit that nobody can build": Row(
        style.GRAY, "v", {f"{pitch} mm": f"run, {pitch} mm, bare" for pitch in ("10", "6.4")}
    ),
}

TICKS_US = {100: "0.1", 1000: "1", 10_000: "10", 100_000: "100"}
ENDS_US = (80.0, 300_000.0)


class Panel(NamedTuple):
    name: str
    label: str
    factor: float
    ticks: tuple[float, ...]
    ends: tuple[float, float]


PANELS = (
    Panel("miscounted", "scenes with a wrong count, %", 100.0, (0.1, 1, 10, 100), (0.03, 150)),
    Panel("barycenter_mm", "mean error of the barycenters found, mm", 1.0, (0.5, 1, 2, 5), (0.5, 7)),
)


def save(points: Sequence[Point], path: Path) -> Path:
    """Draw the points of :data:`FAMILY`; equal points give equal files."""
    with matplotlib.rc_context(style.SETTINGS):
        return style.save(picture(points), path)


def picture(points: Sequence[Point]) -> Figure:
    figure = style.new(5.2)
    method = to_build(points)
    some = {point.task.method: point for point in points if point.task.family == FAMILY}
    for axes, panel in zip(figure.subplots(1, len(PANELS)), PANELS, strict=True):
        _axes(axes, panel)
        for row in ROWS.values():
            _row(axes, panel, row, some)
        _ring(axes, panel, some[method])
    figure.suptitle(f"Two to five fingers: {title(some[method])}", x=0.02, ha="left", fontsize=style.LARGE)
    marks = [Line2D([], [], color=row.color, marker=row.mark, lw=1, ms=6) for row in ROWS.values()]
    figure.legend(marks, list(ROWS), loc="outside lower left", ncols=2)
    return figure


def title(best: Point) -> str:
    found = best.errors["total"]["miscounted"]
    share = f"{100 * found.mean:.1f} % ({100 * found.low:.1f} to {100 * found.high:.1f})"
    return f"the ringed method, {best.task.method}, miscounts {share}"


def _axes(axes: Any, panel: Panel) -> None:
    axes.set(xscale="log", yscale="log", xlim=ENDS_US, ylim=panel.ends, ylabel=panel.label)
    axes.set_xlabel("first touch of the cover to the last byte\non the wire (without USB), median, ms")
    axes.set_xticks(list(TICKS_US), TICKS_US.values())
    axes.set_yticks(panel.ticks, map("{:g}".format, panel.ticks))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_minor_locator(NullLocator())
    axes.grid()


def _row(axes: Any, panel: Panel, row: Row, some: dict[str, Point]) -> None:
    drawn = {words: some[method] for words, method in row.methods.items() if method in some}
    places = [_place(panel, point) for point in drawn.values()]
    for (x, y), (words, point) in zip(places, drawn.items(), strict=True):
        found = point.errors["total"][panel.name]
        axes.plot([x, x], [panel.factor * found.low, panel.factor * found.high], color=row.color, lw=0.8, alpha=0.5)
        axes.plot(x, y, row.mark, color=row.color, ms=6, mew=1.4 if row.mark == "x" else 0, zorder=3)
        if spot := row.others.get((words, panel.name), row.spot):
            side = "left" if spot[0] > 0 else "right"
            axes.annotate(words, (x, y), spot, textcoords="offset points", ha=side, va="center", fontsize=style.SMALL)
    axes.plot(*zip(*places, strict=True), color=row.color, lw=1)


def _place(panel: Panel, point: Point) -> tuple[float, float]:
    return reached_us(point), panel.factor * chart.error(point, panel.name)


def _ring(axes: Any, panel: Panel, best: Point) -> None:
    axes.plot(*_place(panel, best), "o", ms=13, mfc="none", mec=style.INK, mew=1.2, zorder=6, clip_on=False)
