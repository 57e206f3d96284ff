"""The chart as small multiples: a row of panels for each family of scenes, a column for each error."""

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
from contactfpga.choices import labellers, scans
from contactfpga.skin import Skin
from contactfpga_sim.lab.chart.compute import Point, front
from contactfpga_sim.lab.chart.methods import METHODS

MARKERS = "so^Dvp"
"""By pitch, the finest first."""

LINEAR = 0.01
"""Shares below are drawn on a linear scale, so that 0 has its place; those above in powers of ten."""


class Metric(NamedTuple):
    """An error, and how its axis looks."""

    name: str
    label: str
    scale: dict[str, Any]
    ticks: tuple[float, ...]
    ends: tuple[float, float]
    """Of the axis, unless a point lies beyond."""
    show: Callable[[float], str]


LENGTHS_MM = (0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200)
TIMES_US = (20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000, 20_000, 50_000)
"""Ticks, as far as an axis reaches."""

ENDS_US = (85, 1200)
METRICS = (
    Metric("barycenter_mm", "barycenter error, mm", {"value": "log"}, LENGTHS_MM, (0.3, 40), "{:g}".format),
    Metric(
        "miscounted",
        "scenes miscounted",
        {"value": "symlog", "linthresh": LINEAR, "linscale": 0.5},
        (0, 0.01, 0.1, 1),
        (-0.002, 1.6),
        lambda share: f"{100 * share:g} %",
    ),
)


def save(points: Sequence[Point], folder: Path) -> None:
    """``chart.png`` and ``chart.svg`` in a folder; the same points give the same files."""
    with matplotlib.rc_context(style.SETTINGS):
        figure = picture(points)
        for suffix in ("png", "svg"):
            style.save(figure, folder / f"chart.{suffix}")


def picture(points: Sequence[Point]) -> Figure:
    """All points, with the fronts of each panel."""
    families = list(dict.fromkeys(point.task.family for point in points))
    figure = style.new(1.85 * len(families) + 1.2)
    panels = figure.subplots(len(families), len(METRICS), sharex=True, sharey="col", squeeze=False)
    for row, family in zip(panels, families, strict=True):
        some = [point for point in points if point.task.family == family]
        for panel, metric in zip(row, METRICS, strict=True):
            _axes(panel, points, metric)
            _panel(panel, some, metric)
            panel.set_ylabel(metric.label)
            panel.set_title(family, loc="left", fontweight="bold")
    for panel in panels[-1]:
        panel.set_xlabel("from touch to host, µs (median)")
    others = dict.fromkeys(filter(None, map(setting, points)))
    title = f"hollow: another setting ({', '.join(others)})" if others else None
    figure.legend(*_legend(points), loc="outside lower center", ncols=4, title=title, title_fontsize=style.SMALL)
    return figure


def reached_us(point: Point) -> float:
    """Median from the touch to the zones at the host, labelled there if need be."""
    return point.speed.median_us + point.host_us


def error(point: Point, name: str) -> float:
    """Mean of the method's zones against the contacts."""
    return point.errors["total"][name].mean


def ends(values: Iterable[float], usual: tuple[float, float]) -> tuple[float, float]:
    """An axis' usual ends, or such that all values lie between them."""
    finite = [value for value in values if math.isfinite(value)]
    least, most = min(finite, default=usual[0]), max(finite, default=usual[1])
    return min(usual[0], 0.8 * least) if least else usual[0], max(usual[1], 1.25 * most)


def kind(skin: Skin) -> str:
    """What a color stands for: the report that is no zone, else the scan that is no raster, else the labeller."""
    if skin.report != "moments":
        return skin.report
    chosen = labellers.find(skin.labeller) if skin.scan == "raster" else scans.find(skin.scan)
    return chosen.title


def setting(point: Point) -> str:
    """What sets a method apart from the one of the same kind and pitch, such as `24 MHz`."""
    return point.task.method.partition(" mm, ")[2]


def colors(points: Sequence[Point]) -> dict[str, str]:
    """By kind: those of the built-in methods in their order, then whatever else there is."""
    kinds = dict.fromkeys(map(kind, (*METHODS.values(), *(point.task.skin for point in points))))
    return {name: style.PALETTE[index % len(style.PALETTE)] for index, name in enumerate(kinds)}


def markers(points: Sequence[Point]) -> dict[float, str]:
    """By pitch in mm."""
    pitches = {skin.pitch_x_mm for skin in (*METHODS.values(), *(point.task.skin for point in points))}
    return {pitch: MARKERS[index % len(MARKERS)] for index, pitch in enumerate(sorted(pitches))}


def _axes(panel: Any, points: Sequence[Point], metric: Metric) -> None:
    """Alike for all families."""
    panel.set_xscale("log")
    panel.set_yscale(**metric.scale)
    panel.set_xticks(TIMES_US, map(str, TIMES_US))
    panel.set_yticks(metric.ticks)
    panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: metric.show(value)))
    panel.xaxis.set_minor_locator(NullLocator())
    panel.yaxis.set_minor_locator(NullLocator())
    panel.set_xlim(*ends(map(reached_us, points), ENDS_US))
    panel.set_ylim(*ends((error(point, metric.name) for point in points), metric.ends))
    panel.tick_params(labelbottom=True)
    panel.grid()
    if metric.ticks[0] == 0:
        panel.axhline(0, color=style.SOFT, linewidth=0.8)


def _panel(panel: Any, points: Sequence[Point], metric: Metric) -> None:
    places = [(reached_us(point), error(point, metric.name)) for point in points]
    best = front(places)
    panel.step(*np.array([places[index] for index in best]).reshape(-1, 2).T, where="post", color=style.INK, lw=0.8)
    _marks(panel, points, places)


def _marks(panel: Any, points: Sequence[Point], places: Sequence[tuple[float, float]]) -> None:
    """Methods that come out alike lie on one another: each kind is smaller than the one below it."""
    color, marker = colors(points), markers(points)
    sizes = {name: 8.5 - 5.0 * index / len(color) for index, name in enumerate(color)}
    for point, place in zip(points, places, strict=True):
        name = kind(point.task.skin)
        panel.plot(
            *place,
            marker[point.task.skin.pitch_x_mm],
            markersize=sizes[name],
            markerfacecolor=style.CARD if setting(point) else color[name],
            markeredgecolor=color[name] if setting(point) else style.CARD,
            markeredgewidth=1.4 if setting(point) else 0.5,
            zorder=3 + list(color).index(name) / len(color),
            clip_on=False,
        )


def _legend(points: Sequence[Point]) -> tuple[list[Line2D], list[str]]:
    used = {kind(point.task.skin) for point in points}
    pitches = {point.task.skin.pitch_x_mm for point in points}
    mark: dict[str, Any] = {"linestyle": "", "markersize": 7, "markeredgecolor": style.CARD}
    lines = {name: Line2D([], [], color=color, marker="o", **mark) for name, color in colors(points).items()}
    shapes = {pitch: Line2D([], [], color=style.GRAY, marker=shape, **mark) for pitch, shape in markers(points).items()}
    shown = {name: line for name, line in lines.items() if name in used}
    shown |= {f"pitch {pitch:g} mm": line for pitch, line in shapes.items() if pitch in pitches}
    shown["nothing is better in both"] = Line2D([], [], color=style.INK, linewidth=0.8)
    return list(shown.values()), list(shown)
