"""The picture of a recording, by matplotlib. The same recording gives the same file."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from contactfpga import picture_style as style
from contactfpga.skin.sheet import Sheet
from contactfpga.tools.view.board_recording import BoardRecording
from contactfpga.zones.batch import Batch
from contactfpga.zones.zone import Zones

HEIGHT_IN = 6.8
COLORS = "cividis"


def draw(recording: BoardRecording, path: Path) -> Path:
    """Write PNG or SVG, by the path's ending."""
    touches = Touches.of(recording)
    with matplotlib.rc_context(style.SETTINGS):
        figure = style.new(HEIGHT_IN)
        # A name with dollar signs is no formula.
        figure.suptitle(title(recording, touches), x=0.02, ha="left", fontsize=style.LARGE, parse_math=False)
        grid = figure.add_gridspec(3, 2, height_ratios=[1, 1, 1.1])
        _map(figure, figure.add_subplot(grid[:2, 0]), touches)
        over_time = figure.add_subplot(grid[2, :])
        _rows(figure, over_time, touches)
        _zones(figure.add_subplot(grid[0, 1], sharex=over_time), touches)
        _losses(figure.add_subplot(grid[1, 1], sharex=over_time), touches, recording.timed)
        return style.save(figure, path)


def title(recording: BoardRecording, touches: Touches) -> str:
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
    what = "each cell was pressed, s" if cells else "a barycenter was in each cell, s"
    figure.colorbar(image, ax=axes, label=f"how long {what}", location="bottom", shrink=0.9)
    axes.set(xlabel="x, mm", ylabel="y, mm")
    axes.set_title("Where it was touched", loc="left")


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
    axes.set(xlabel="time, s")
    axes.set_title("How many zones, and their area together", loc="left")


def _rows(figure: Figure, axes: Axes, touches: Touches) -> None:
    cells = touches.sheet.report == "cells"
    shown = np.ma.masked_equal(touches.rows / (1 if cells else 100), 0)
    extent = (0, touches.duration_s, -0.5, touches.sheet.rows - 0.5)
    axes.set_facecolor(style.SHEET)
    image = axes.imshow(
        shown, extent=extent, origin="lower", aspect="auto", cmap=COLORS, interpolation="nearest", vmin=0
    )
    figure.colorbar(image, ax=axes, label="pressed cells" if cells else "zone's area, cm²")
    axes.set(xlabel="time, s", ylabel="row")
    axes.set_title("Pressed cells of each row" if cells else "Rows in which barycenters were", loc="left")


def _losses(axes: Axes, touches: Touches, timed: bool) -> None:
    axes.stairs(np.cumsum(touches.lost), touches.seconds, color=style.VERMILLION)
    axes.set(xlabel="time, s", ylabel="frames lost", ylim=(0, max(1, touches.lost.sum()) * 1.15))
    axes.yaxis.set_major_locator(MaxNLocator(4, integer=True))
    axes.yaxis.label.set_color(style.VERMILLION)
    if not timed or not touches.late:
        axes.set_title("Frames lost, in all; the file has no delays", loc="left")
        return
    other = axes.twinx()
    other.spines["right"].set_visible(True)
    seconds, late_s = np.array(touches.late).T
    other.plot(seconds, (late_s - late_s.min()) * 1e3, ".", markersize=2, color=style.BLUE)
    other.set(ylim=(0, None))
    other.set_ylabel("delay over the least, ms", color=style.BLUE)
    axes.set_title("Frames lost, in all; delay of each frame", loc="left")


STEPS = 600
CHUNK = 2000
LONGEST_S = 0.25
"""Longest validity of a frame: a board with ``send = "on_change"`` sends at least that often."""


class Touches:
    """A recording of one sheet in a fixed number of time steps."""

    def __init__(self, sheet: Sheet, duration_s: float, steps: int = STEPS):
        self.sheet, self.duration_s = sheet, max(duration_s, 1e-6)
        self.frames = 0
        self.zones = np.zeros(steps, int)
        """Most zones in each step."""
        self.area_mm2 = np.zeros(steps)
        """Largest total area in each step."""
        self.rows = np.zeros((sheet.rows, steps))
        """Largest area in mm2 by the row of its barycenter; with ``report = "cells"`` pressed cells of each row."""
        self.touched_s = np.zeros((sheet.rows, sheet.columns))
        """Time of a barycenter in each cell; with ``report = "cells"``, time for which each cell was pressed."""
        self.lost = np.zeros(steps, int)
        self.late: list[tuple[float, float]] = []
        """Time of a frame of each piece of bytes, and by how much the host's clock is then ahead of the board's."""
        self._before: Zones | None = None
        self._before_s = 0.0

    @classmethod
    def of(cls, recording: BoardRecording) -> Touches:
        found = cls(recording.sheet, recording.duration_s)
        same = ((seconds, zones) for seconds, zones in recording.frames() if zones.sheet == recording.sheet)
        for chunk in _chunks(same):
            found._take(chunk)
        return found

    @property
    def seconds(self) -> np.ndarray:
        """(steps + 1,) beginnings of the steps, and the last end."""
        return np.linspace(0, self.duration_s, len(self.zones) + 1)

    def _take(self, chunk: list[tuple[float, Zones]]) -> None:
        times_s = np.array([seconds for seconds, _ in chunk])
        batch = Batch.of([zones for _, zones in chunk])
        steps = np.minimum((times_s / self.duration_s * len(self.zones)).astype(int), len(self.zones) - 1)
        sequences = batch.frames["sequence"]
        if self._before is not None:
            self._hold(self._before, self._before_s, times_s[0])
            self.lost[steps[0]] += (int(sequences[0]) - self._before.sequence - 1) % 256
        # Only the last of several frames with one time has it exactly, as times are never below 0 and never fall.
        known = np.flatnonzero(np.diff(times_s) > 0)
        late_s = times_s[known] - batch.frames["time_us"][known] / 1e6
        changed = np.abs(np.diff(late_s, prepend=self.late[-1][1] if self.late else np.inf)) > 1e-9
        self.late += zip(times_s[known][changed], late_s[changed], strict=True)
        np.add.at(self.lost, steps[1:], (np.diff(sequences) - 1) % 256)
        self.frames += len(chunk)
        np.maximum.at(self.zones, steps, batch.frames["total_zones"])
        starts = batch.starts
        areas = np.concatenate([[0.0], np.cumsum(batch.zones["area_mm2"])])
        np.maximum.at(self.area_mm2, steps, areas[starts[1:]] - areas[starts[:-1]])
        ends_s = np.append(times_s[1:], times_s[-1])
        if self.sheet.report == "cells":
            self._take_cells(chunk, steps)
        else:
            zones = batch.zones[~np.isnan(batch.zones["x_mm"])]
            row, column = self._cells_of(zones)
            np.maximum.at(self.rows, (row, steps[zones["frame"]]), zones["area_mm2"])
            held_s = np.minimum(ends_s - times_s, LONGEST_S)
            np.add.at(self.touched_s, (row, column), held_s[zones["frame"]])
        self._before_s, self._before = chunk[-1]

    def _take_cells(self, chunk: list[tuple[float, Zones]], steps: np.ndarray) -> None:
        for (seconds, zones), (after_s, _), step in zip(chunk, chunk[1:] + chunk[-1:], steps):
            cells = zones.cells
            if cells is not None:
                self.touched_s += cells * min(after_s - seconds, LONGEST_S)
                self.rows[:, step] = np.maximum(self.rows[:, step], cells.sum(1))

    def _hold(self, zones: Zones, since_s: float, until_s: float) -> None:
        held_s = min(until_s - since_s, LONGEST_S)
        if zones.cells is not None:
            self.touched_s += zones.cells * held_s
            return
        placed = zones.array[~np.isnan(zones.array["x_mm"])]
        np.add.at(self.touched_s, self._cells_of(placed), held_s)

    def _cells_of(self, zones: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        sheet = self.sheet
        row = np.clip(np.round(zones["y_mm"] / sheet.pitch_y_mm).astype(int), 0, sheet.rows - 1)
        column = np.round(zones["x_mm"] / sheet.pitch_x_mm).astype(int)
        return row, column % sheet.columns if sheet.closed else np.clip(column, 0, sheet.columns - 1)


def _chunks(frames: Iterable[tuple[float, Zones]]) -> Iterator[list[tuple[float, Zones]]]:
    each = iter(frames)
    while chunk := list(itertools.islice(each, CHUNK)):
        yield chunk
