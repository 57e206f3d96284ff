"""The chart: a row of panels per family, a column per error."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullLocator

from contactfpga import picture_style as style
from contactfpga_sim.apps.covers import COVERS
from contactfpga_sim.lab.chart.compute import Point, covered, front, reached_us
from contactfpga_sim.lab.chart.methods import METHODS

MARKERS = "sv^oDp"

COLORS = {
    "tiles": style.BLUE,
    "caps": style.ORANGE,
    "paper": style.VERMILLION,
    "bare": style.GRAY,
    "other covers": style.PURPLE,
}

MISSED = 0.05
"""Share of missed contacts that makes a mark hollow: its barycenter error is of found ones."""

LINEAR = 0.01
"""End of the linear scale, which shows 0, before the logarithmic one."""

SMALL: dict[str, Any] = {"fontsize": style.SMALL}


class Metric(NamedTuple):
    name: str
    label: str
    scale: dict[str, Any]
    ticks: tuple[float, ...]
    ends: tuple[float, float]
    show: Callable[[float], str]


LENGTHS_MM = (0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200)
TIMES_US = {
    50: "50 µs",
    200: "200 µs",
    1000: "1 ms",
    5000: "5 ms",
    20_000: "20 ms",
    100_000: "100 ms",
}

NEVER_US = 500_000.0
"""Place of a median that is never felt."""

ENDS_US = (40.0, 800_000.0)
ALONG = "first touch of the foam to last byte, median"

METRICS = (
    Metric(
        "miscounted",
        "scenes miscounted",
        {"value": "symlog", "linthresh": LINEAR, "linscale": 0.5},
        (0, 0.01, 0.1, 1),
        (-0.002, 1.6),
        lambda share: f"{100 * share:g} %",
    ),
    Metric("barycenter_mm", "barycenter of found, mm", {"value": "log"}, LENGTHS_MM, (0.4, 40), "{:g}".format),
)


def save(points: Sequence[Point], folder: Path) -> None:
    """Write ``chart.png`` and ``chart.svg``; equal points give equal files."""
    with matplotlib.rc_context(style.SETTINGS):
        figure = picture(points)
        for suffix in ("png", "svg"):
            style.save(figure, folder / f"chart.{suffix}")


def picture(points: Sequence[Point]) -> Figure:
    families = list(dict.fromkeys(point.task.family for point in points))
    figure = style.new(2.2 * len(families) + 1.3)
    panels = figure.subplots(len(families), len(METRICS), sharex=True, sharey="col", squeeze=False)
    for row, family in zip(panels, families, strict=True):
        for panel, metric in zip(row, METRICS, strict=True):
            draw(panel, metric, family, points)
            panel.set_title(family, loc="left", fontweight="bold")
    figure.legend(*legend(points), loc="outside lower center", ncols=4)
    return figure


def draw(panel: Any, metric: Metric, family: str, points: Sequence[Point]) -> None:
    _axes(panel, points, metric)
    panel.set_xlabel(ALONG)
    some = [point for point in points if point.task.family == family]
    _wall(panel, some)
    places = [(_along(reached_us(point)), error(point, metric.name)) for point in some]
    real = [place for point, place in zip(some, places, strict=True) if covered(point.task)]
    best = front(real)
    panel.step(*np.array([real[index] for index in best]).reshape(-1, 2).T, where="post", color=style.INK, lw=0.8)
    for point, place in zip(some, places, strict=True):
        _mark(panel, point, place, markers(points), metric)


def error(point: Point, name: str) -> float:
    """Mean error of the method's zones against contacts."""
    return point.errors["total"][name].mean


def cover_of(method: str) -> str:
    return next((name for name in COVERS if name in method.split(", ")), "other covers")


def hollow(point: Point) -> bool:
    return error(point, "missed") > MISSED


def ends(values: Iterable[float], usual: tuple[float, float]) -> tuple[float, float]:
    finite = [value for value in values if math.isfinite(value)]
    least, most = min(finite, default=usual[0]), max(finite, default=usual[1])
    return min(usual[0], 0.8 * least) if least else usual[0], max(usual[1], 1.25 * most)


def markers(points: Sequence[Point]) -> dict[float, str]:
    pitches = {skin.pitch_x_mm for skin, _ in METHODS.values()} | {point.task.skin.pitch_x_mm for point in points}
    return {pitch: MARKERS[index % len(MARKERS)] for index, pitch in enumerate(sorted(pitches))}


def _along(us: float) -> float:
    return NEVER_US if math.isinf(us) else us


def _axes(panel: Any, points: Sequence[Point], metric: Metric) -> None:
    never = any(math.isinf(reached_us(point)) for point in points)
    ticks = TIMES_US | ({NEVER_US: "never"} if never else {})
    panel.set_xscale("log")
    panel.set_yscale(**metric.scale)
    panel.set_xticks(list(ticks), ticks.values())
    panel.set_yticks(metric.ticks)
    panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: metric.show(value)))
    panel.xaxis.set_minor_locator(NullLocator())
    panel.yaxis.set_minor_locator(NullLocator())
    panel.set_xlim(*ends(map(reached_us, points), (ENDS_US[0], ENDS_US[1] if never else NEVER_US / 2)))
    panel.set_ylim(*ends((error(point, metric.name) for point in points), metric.ends))
    panel.tick_params(labelbottom=True)
    panel.set_ylabel(metric.label)
    panel.grid()
    if metric.ticks[0] == 0:
        panel.axhline(0, color=style.SOFT, linewidth=0.8)


def bits_us(points: Sequence[Point]) -> float:
    """Microseconds of the shortest frame's bits, at the most common baud rate."""
    bauds = [point.task.skin.baud for point in points]
    usual = max(dict.fromkeys(bauds), key=bauds.count)
    return min(point.times.lower_bound_us for point in points if point.task.skin.baud == usual)


def _wall(panel: Any, some: Sequence[Point]) -> None:
    if math.isfinite(least := bits_us(some)):
        panel.axvline(least, color=style.GREEN, linewidth=1.4, linestyle=style.DASHES[1], zorder=2)


def _mark(panel: Any, point: Point, place: tuple[float, float], shapes: dict[float, str], metric: Metric) -> None:
    found = point.errors["total"][metric.name]
    color = COLORS[cover_of(point.task.method)]
    if math.isfinite(found.low) and math.isfinite(found.high):
        panel.plot([place[0]] * 2, [found.low, found.high], color=color, linewidth=0.8, alpha=0.5, zorder=2.5)
    panel.plot(
        *place,
        shapes[point.task.skin.pitch_x_mm],
        markersize=5.5,
        markerfacecolor=style.CARD if hollow(point) else color,
        markeredgecolor=color if hollow(point) else style.CARD,
        markeredgewidth=1.2 if hollow(point) else 0.5,
        zorder=4 if hollow(point) else 3,
        clip_on=False,
    )


def legend(points: Sequence[Point]) -> tuple[list[Line2D], list[str]]:
    mark: dict[str, Any] = {"linestyle": "", "markersize": 6}
    used = {cover_of(point.task.method) for point in points}
    pitches = {point.task.skin.pitch_x_mm for point in points}
    words = {"bare": "bare: touch at once"}
    lines = {
        words.get(name, name): Line2D([], [], color=color, marker="o", **mark)
        for name, color in COLORS.items()
        if name in used
    }
    for pitch, shape in markers(points).items():
        if pitch in pitches:
            lines[f"pitch {pitch:g} mm"] = Line2D([], [], color=style.SOFT, marker=shape, **mark)
    lines[f"over {100 * MISSED:g} % of contacts missed"] = Line2D(
        [], [], color=style.SOFT, marker="o", mfc=style.CARD, **mark
    )
    lines["under a cover, not beaten in both"] = Line2D([], [], color=style.INK, linewidth=0.8)
    lines["wall: bits of a frame"] = Line2D([], [], color=style.GREEN, linewidth=1.4, linestyle=style.DASHES[1])
    return list(lines.values()), list(lines)
