"""The picture of a recording; needs matplotlib. The same recording gives the same file."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from contactfpga import picture_style as style
from contactfpga.tools.view.replayed import BoardRecording
from contactfpga.tools.view.touches import Touches

HEIGHT_IN = 9.2
COLORS = "cividis"


def draw(recording: BoardRecording, path: Path) -> Path:
    """Write PNG or SVG, by the path's ending."""
    touches = Touches.of(recording)
    with matplotlib.rc_context(style.SETTINGS):
        figure = style.new(HEIGHT_IN)
        # A name with dollar signs is no formula.
        figure.suptitle(title(recording, touches), x=0.02, ha="left", fontsize=style.LARGE, parse_math=False)
        grid = figure.add_gridspec(4, 1, height_ratios=[3.2, 1.2, 1.6, 1.0])
        _map(figure, figure.add_subplot(grid[0]), touches)
        over_time = figure.add_subplot(grid[1])
        _zones(over_time, touches)
        _rows(figure, figure.add_subplot(grid[2], sharex=over_time), touches)
        _losses(figure.add_subplot(grid[3], sharex=over_time), touches, recording)
        return style.save(figure, path)


def title(recording: BoardRecording, touches: Touches) -> str:
    """What it is of."""
    sheet = touches.sheet
    name = recording.title.rpartition("/")[2]
    return f"{name}: {sheet.rows}x{sheet.columns} cells, {touches.frames:,} frames in {touches.duration_s:.1f} s"


def _map(figure: Figure, axes: Axes, touches: Touches) -> None:
    sheet = touches.sheet
    x_mm, y_mm = sheet.pitch_x_mm, sheet.pitch_y_mm
    extent = (-x_mm / 2, (sheet.columns - 0.5) * x_mm, -y_mm / 2, (sheet.rows - 0.5) * y_mm)
    shown = np.ma.masked_equal(touches.touched_s, 0)
    axes.set_facecolor(style.SHEET)
    image = axes.imshow(shown, extent=extent, origin="lower", cmap=COLORS, vmin=0)
    cells = sheet.report == "cells"
    what = "each cell was pressed, s" if cells else "a barycenter lay in each cell, s"
    figure.colorbar(image, ax=axes, label=f"how long {what}", shrink=0.9)
    axes.set(xlabel="x, mm", ylabel="y, mm", title="Where it was touched")


def _zones(axes: Axes, touches: Touches) -> None:
    axes.stairs(touches.zones, touches.seconds, color=style.VERMILLION, label="zones, the most at a time")
    axes.set(ylabel="zones", ylim=(0, max(1, touches.zones.max()) * 1.15))
    axes.yaxis.set_major_locator(MaxNLocator(4, integer=True))
    other = axes.twinx()
    other.spines["right"].set_visible(True)
    other.stairs(touches.area_mm2 / 100, touches.seconds, color=style.BLUE, label="area, the largest")
    other.set(ylabel="area, cm²", ylim=(0, max(1.0, touches.area_mm2.max() / 100) * 1.15))
    for each, color in ((axes, style.VERMILLION), (other, style.BLUE)):
        each.yaxis.label.set_color(color)
    axes.set_title("How many zones, and their area together")


def _rows(figure: Figure, axes: Axes, touches: Touches) -> None:
    cells = touches.sheet.report == "cells"
    shown = np.ma.masked_equal(touches.rows / (1 if cells else 100), 0)
    extent = (0, touches.duration_s, -0.5, touches.sheet.rows - 0.5)
    axes.set_facecolor(style.SHEET)
    image = axes.imshow(
        shown, extent=extent, origin="lower", aspect="auto", cmap=COLORS, interpolation="nearest", vmin=0
    )
    figure.colorbar(image, ax=axes, label="pressed cells" if cells else "zone's area, cm²")
    axes.set(ylabel="row", title="Pressed cells of each row" if cells else "Rows in which barycenters lay")


def _losses(axes: Axes, touches: Touches, recording: BoardRecording) -> None:
    late = np.array(list(recording.lateness()))
    axes.stairs(np.cumsum(touches.lost), touches.seconds, color=style.VERMILLION)
    axes.set(xlabel="time, s", ylabel="frames lost", ylim=(0, max(1, touches.lost.sum()) * 1.15))
    axes.yaxis.set_major_locator(MaxNLocator(4, integer=True))
    axes.yaxis.label.set_color(style.VERMILLION)
    if not len(late):
        axes.set_title("Frames lost, in all. The file has no times of arrival, so latency is not known")
        return
    other = axes.twinx()
    other.spines["right"].set_visible(True)
    other.plot(late[:, 0], late[:, 1] * 1e3, ".", markersize=2, color=style.BLUE)
    other.set_ylabel("later, ms", color=style.BLUE)
    axes.set_title("Frames lost, in all; how much later than the earliest the others came")
