"""The README's picture: the method to build, and the other covers and pitches, for one family.

The family is `fingers`: two to five fingertips anywhere on 160 mm by 160 mm, where cover and pitch matter.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure

from contactfpga import picture_style as style
from contactfpga_sim.lab.chart import picture as chart
from contactfpga_sim.lab.chart.beside import RivalMethod
from contactfpga_sim.lab.chart.compute import Point, reached_us, to_build

FAMILY = "fingers"


def save(points: Sequence[Point], path: Path, rivals: Sequence[RivalMethod] = ()) -> Path:
    """Draw the points of :data:`FAMILY`; the recommendation is over all families. The same points give the same
    file."""
    with matplotlib.rc_context(style.SETTINGS):
        return style.save(picture(points, rivals), path)


def picture(points: Sequence[Point], rivals: Sequence[RivalMethod] = ()) -> Figure:
    """Miscounted scenes and barycenter error over the time from the first touch of the foam."""
    figure = style.new(4.3)
    method = to_build(points)
    (best,) = [point for point in points if (point.task.method, point.task.family) == (method, FAMILY)]
    for panel, metric in zip(figure.subplots(1, len(chart.METRICS)), chart.METRICS, strict=True):
        chart.draw(panel, metric, FAMILY, points, rivals)
        _ring(panel, best, chart.error(best, metric.name))
    figure.suptitle(title(best), x=0.02, ha="left", fontsize=style.LARGE)
    figure.legend(*chart.legend(points, rivals), loc="outside lower center", ncols=4)
    return figure


def title(best: Point) -> str:
    """The recommended method, and how well it counts."""
    found = best.errors["total"]["miscounted"]
    share = f"{100 * found.mean:.1f} % ({100 * found.low:.1f} to {100 * found.high:.1f})"
    return f"Two to five fingers. Ringed, what to build: {best.task.method}. Miscounted: {share}"


def _ring(panel: Any, best: Point, value: float) -> None:
    panel.plot(reached_us(best), value, "o", markersize=13, mfc="none", mec=style.INK, mew=1.2, zorder=6, clip_on=False)
