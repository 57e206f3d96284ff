"""The README's picture: what time buys, for one family of scenes, and what else there is.

The family is `fingers`: two to five fingertips anywhere on 160 mm by 160 mm, where pitch, scan, labeller and report all
make a difference. Every method of the chart is drawn, as measured: 12 MHz and 3 Mbaud where its name says nothing else,
and 24 MHz and 12 Mbaud for `reversal`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator

from contactfpga import picture_style as style
from contactfpga_sim.lab.chart.compute import Point, front
from contactfpga_sim.lab.chart.picture import LENGTHS_MM, ends, error, markers, reached_us

FAMILY = "fingers"
ENDS_US, ENDS_MM = (8.0, 10_000.0), (0.3, 40.0)
TICKS_US = {
    10: "10 µs",
    20: "20 µs",
    50: "50 µs",
    100: "100 µs",
    200: "200 µs",
    500: "500 µs",
    1000: "1 ms",
    2000: "2 ms",
    5000: "5 ms",
    10_000: "10 ms",
    20_000: "20 ms",
}
LINE = 10**0.13
"""By this much a line of words is below the one above, on the axis of errors."""

SMALL: dict[str, Any] = {"fontsize": style.SMALL}

MISCOUNTED = 0.5
"""From this share of scenes on, a mark is hollow: its barycenters are those of too few zones."""


class Other(NamedTuple):
    """A time to compare with, of which no accuracy is known."""

    us: float
    label: str


OTHERS = (
    Other(1000.0, "array read at 1 kHz:\none period"),
    Other(6000.0, "Battaglia et al.:\nsensing and\ncontrol, 6 ms"),
)
"""What an array's sampling alone takes at worst before anything is sent; and the latencies of scanning and of computing
the control that the paper adds up in its Section IV."""


def save(points: Sequence[Point], path: Path) -> Path:
    """Draw the points of :data:`FAMILY`; the same ones give the same file."""
    with matplotlib.rc_context(style.SETTINGS):
        return style.save(picture([point for point in points if point.task.family == FAMILY]), path)


def picture(points: Sequence[Point]) -> Figure:
    """Error over time, the front by name."""
    figure = style.new(4.4)
    panel = figure.subplots()
    _axes(panel, points)
    places = [(reached_us(point), error(point, "barycenter_mm")) for point in points]
    best = front(places)
    for other in OTHERS:
        panel.axvline(other.us, color=style.ORANGE, linewidth=1.6, linestyle=style.DASHES[1])
        panel.text(other.us * 1.05, panel.get_ylim()[1] * 0.9, other.label, va="top", **SMALL)
    cells = [index for index, point in enumerate(points) if point.task.skin.report == "cells"]
    host = [index for index in cells if index not in best]
    for index, (point, place) in enumerate(zip(points, places, strict=True)):
        color = style.BLUE if index in best else style.VERMILLION if index in host else style.GRAY
        _mark(panel, point, place, color, markers(points))
    _name_front(panel, [(points[index].task.method, *places[index]) for index in best])
    for index in host:
        x, y = places[index]
        behind = {"facecolor": style.CARD, "edgecolor": "none", "pad": 1}
        panel.text(x, y * LINE**0.6, points[index].task.method, ha="center", bbox=behind, zorder=2.5, **SMALL)
    panel.step(*np.array([places[index] for index in best]).T, where="post", color=style.BLUE, linewidth=1.2)
    figure.legend(*_legend(points), loc="outside lower center", ncols=4)
    return figure


def _axes(panel: Any, points: Sequence[Point]) -> None:
    panel.set(xscale="log", yscale="log")
    panel.set_xticks(list(TICKS_US), TICKS_US.values())
    panel.set_yticks(LENGTHS_MM, map("{:g}".format, LENGTHS_MM))
    panel.set_xlim(*ends((point.speed.worst_us + point.host_us for point in points), ENDS_US))
    panel.set_ylim(*ends((error(point, "barycenter_mm") for point in points), ENDS_MM))
    panel.xaxis.set_minor_locator(NullLocator())
    panel.yaxis.set_minor_locator(NullLocator())
    panel.set_xlabel("from touch to host: median, and a line to the slowest touch")
    panel.set_ylabel("mean error of the barycenter, mm")
    panel.set_title("Two to five fingers on 160 mm by 160 mm: what time buys", loc="left")
    panel.grid()


def _mark(panel: Any, point: Point, place: tuple[float, float], color: str, shapes: dict[float, str]) -> None:
    x, y = place
    hollow = error(point, "miscounted") >= MISCOUNTED
    front_or_host = color != style.GRAY
    if front_or_host:
        panel.plot([x, point.speed.worst_us + point.host_us], [y, y], color=color, linewidth=1, alpha=0.6)
    panel.plot(
        x,
        y,
        shapes[point.task.skin.pitch_x_mm],
        markersize=7 if front_or_host else 5,
        markerfacecolor=style.CARD if hollow else color,
        markeredgecolor=color,
        zorder=4 if front_or_host else 3,
    )


def _name_front(panel: Any, named: Sequence[tuple[str, float, float]]) -> None:
    """To the left of each point and below it, where nothing else can lie as it would be better in both."""
    above = math.inf
    for name, x, y in named:
        above = min(y / LINE**0.3, above / LINE)
        panel.text(x * 0.95, above, name, ha="right", va="top", **SMALL)


def _legend(points: Sequence[Point]) -> tuple[list[Line2D], list[str]]:
    mark: dict[str, Any] = {"linestyle": "", "marker": "o", "markersize": 7}
    lines = {
        "front: not beaten in both": Line2D([], [], color=style.BLUE, marker="o", markersize=7),
        "labelled on the host": Line2D([], [], color=style.VERMILLION, **mark),
        "other methods": Line2D([], [], color=style.GRAY, **mark | {"markersize": 5}),
        "most scenes miscounted": Line2D([], [], color=style.BLUE, mfc=style.CARD, **mark),
    }
    for pitch, shape in markers(points).items():
        lines[f"pitch {pitch:g} mm"] = Line2D([], [], color=style.GRAY, **mark | {"marker": shape})
    return list(lines.values()), list(lines)
