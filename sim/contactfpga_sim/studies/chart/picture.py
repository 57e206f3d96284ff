"""The chart as a picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from contactfpga_sim.studies.chart.study import Point, front

AXES = {
    "miscounted": "scenes miscounted, share",
    "missed": "contacts missed, share",
    "barycenter_mm": "barycenter error, mm",
    "area": "area error, share of the area",
}
FLOOR = {"miscounted": 3e-4, "missed": 3e-4, "barycenter_mm": 1e-2, "area": 1e-2}
"""Errors below are drawn here, as there is no 0 on an axis of powers of ten."""

COLOURS = {
    "adaptive": "#2e4057",
    "run": "#00798c",
    "serial": "#d1495b",
    "projection": "#edae49",
    "single": "#66a182",
    "cells": "#8d6a9f",
    "barycenter": "#5c4033",
}
MARKERS = {5.0: "s", 10.0: "o", 20.0: "^"}


def save(points: Sequence[Point], folder: Path) -> None:
    """``chart.png`` and ``chart.svg`` in a folder; the same points give the same files."""
    with matplotlib.rc_context({"svg.hashsalt": "contactfpga", "svg.fonttype": "none"}):
        figure = picture(points)
        figure.savefig(folder / "chart.png", dpi=130)
        figure.savefig(folder / "chart.svg", metadata={"Date": None})


def picture(points: Sequence[Point], metrics: Sequence[str] = ("miscounted", "barycenter_mm")) -> Figure:
    """A row of panels for each family of scenes, a column for each metric; both axes in powers of ten."""
    families = list(dict.fromkeys(point.task.family for point in points))
    figure = Figure(figsize=(6.5 * len(metrics), 4.2 * len(families) + 1), layout="constrained")
    panels = figure.subplots(len(families), len(metrics), squeeze=False)
    for row, family in zip(panels, families, strict=True):
        some = [point for point in points if point.task.family == family]
        for panel, metric in zip(row, metrics, strict=True):
            _panel(panel, some, metric)
            panel.set_title(f"{family}: {AXES[metric]}", fontsize=10)
    figure.legend(*_legend(points), loc="outside lower center", ncols=5, fontsize=8, frameon=False)
    return figure


def _panel(panel, points: Sequence[Point], metric: str) -> None:
    panel.set(xscale="log", yscale="log", xlabel="touch to the zones at the host, us (median; line to the worst)")
    panel.grid(alpha=0.2, which="both")
    places = [
        (point.speed.median_us + point.host_us, max(point.errors["total"][metric].mean, FLOOR[metric]))
        for point in points
    ]
    best = front(places)
    corners = np.array([places[index] for index in best]).reshape(-1, 2)
    panel.step(*corners.T, where="post", color="black", linewidth=0.7)
    panel.axhline(FLOOR[metric], color="grey", linewidth=0.5, linestyle=":")
    for index, (point, (x, y)) in enumerate(zip(points, places, strict=True)):
        found, colour = point.errors["total"][metric], _colour(point)
        low, high = (max(end, FLOOR[metric]) for end in (found.low, found.high))
        panel.plot([x, point.speed.worst_us + point.host_us], [y, y], color=colour, alpha=0.25, linewidth=1)
        panel.plot([x, x], [low, high], color=colour, alpha=0.35, linewidth=1)
        panel.plot(point.speed.bound_us, y, marker="|", color=colour, alpha=0.6)
        marker, edge = MARKERS[point.task.skin.pitch_x_mm], "black" if index in best else "white"
        panel.plot(x, y, marker, color=colour, markersize=8, markeredgecolor=edge, zorder=3 + (index in best))
    for index in best:
        x, y = places[index]
        alike = [point for point, place in zip(points, places, strict=True) if _alike(place, (x, y))]
        text = "\n".join(map(_label, alike))
        panel.annotate(text, (x, y), textcoords="offset points", xytext=(7, 4), fontsize=6)
    panel.margins(0.12, 0.2)


def _place(point: Point, metric: str) -> tuple[float, float]:
    return point.speed.median_us + point.host_us, max(point.errors["total"][metric].mean, FLOOR[metric])


def _alike(place: tuple[float, float], other: tuple[float, float]) -> bool:
    """Too close to be told apart in the picture."""
    return abs(math.log(place[0] / other[0])) < 0.02 and abs(math.log(place[1] / other[1])) < 0.05


def _label(point: Point) -> str:
    return point.task.method + (f" ({point.luts:,} LUT4)" if point.luts else "")


def _colour(point: Point) -> str:
    skin = point.task.skin
    if skin.report != "moments":
        return COLOURS[skin.report]
    kind = "adaptive" if skin.scan == "adaptive" else skin.labeller
    return COLOURS[kind]


def _legend(points: Sequence[Point]):
    from matplotlib.lines import Line2D

    used = list(dict.fromkeys(_colour(point) for point in points))
    names = {colour: name for name, colour in COLOURS.items()}
    lines = [Line2D([], [], color=colour, marker="o", linestyle="") for colour in used]
    labels = [names[colour] for colour in used]
    for pitch in sorted({point.task.skin.pitch_x_mm for point in points}):
        lines.append(Line2D([], [], color="grey", marker=MARKERS[pitch], linestyle=""))
        labels.append(f"{pitch:g} mm")
    lines += [Line2D([], [], color="grey", marker="o", linestyle="", markeredgecolor="black", markeredgewidth=1.5)]
    lines += [Line2D([], [], color="grey", marker="|", linestyle="")]
    return lines, [*labels, "Pareto front", "bound of the time"]
