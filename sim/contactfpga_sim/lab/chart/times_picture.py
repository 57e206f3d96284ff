"""The chart of one family: cost of mechanics and electronics by method."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator

from contactfpga import picture_style as style
from contactfpga_sim.apps.stats import Quantile
from contactfpga_sim.lab.chart.compute import FAMILY, Point, covered

PARTS = {
    "bits of the frame alone": style.GREEN,
    "from the first closed switch": style.ORANGE,
    "from the first touch of the foam": style.BLUE,
}


TITLE = "to the last byte of the first frame with a contact: median, and a line to the 95 % quantile"

NEVER_US = 500_000.0
"""Place of a touch that is never felt."""
TICKS_US = {
    20: "20 µs", 50: "50 µs", 200: "200 µs", 1000: "1 ms", 5000: "5 ms", 20_000: "20 ms", 100_000: "100 ms",
    NEVER_US: "never",
}  # fmt: skip


def save(points: Sequence[Point], path: Path) -> Path:
    """Draw the family that compares all methods, or the first one there is."""
    families = [point.task.family for point in points]
    family = FAMILY if FAMILY in families else families[0]
    with matplotlib.rc_context(style.SETTINGS):
        return style.save(picture([point for point in points if point.task.family == family]), path)


def picture(points: Sequence[Point]) -> Figure:
    figure = style.new(0.2 * len(points) + 1.3)
    panel = figure.subplots()
    bits, electric, touch = PARTS.values()
    for row, point in enumerate(points):
        times = point.times
        panel.plot(times.lower_bound_us, row, "|", color=bits, markersize=9, mew=2)
        _line(panel, row, times.electric_median_us, times.electric_q95_us, point.host_us, electric)
        if covered(point.task):
            _line(panel, row, times.touch_median_us, times.touch_q95_us, point.host_us, touch)
    panel.set_yticks(range(len(points)), [point.task.method for point in points])
    panel.set_ylim(len(points) - 0.4, -0.6)
    panel.set_xscale("log")
    panel.set_xticks(list(TICKS_US), TICKS_US.values())
    panel.xaxis.set_minor_locator(NullLocator())
    panel.set_xlim(9, 1.3 * NEVER_US)
    panel.grid(axis="x")
    lines = [Line2D([], [], color=color, marker="o", markersize=5) for color in PARTS.values()]
    figure.legend(
        lines,
        list(PARTS),
        loc="outside lower center",
        ncols=3,
        title=f"{points[0].task.family}, {TITLE}",
        title_fontsize=style.SMALL,
    )
    return figure


def _line(panel: Any, row: int, median: Quantile, high: Quantile, more_us: float, color: str) -> None:
    values = [NEVER_US if math.isinf(one.value) else one.value + more_us for one in (median, high)]
    panel.plot(values, [row, row], color=color, linewidth=1.6)
    panel.plot(values[0], row, "o", color=color, markersize=5)
