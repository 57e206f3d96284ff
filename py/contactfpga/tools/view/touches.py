"""What a recording holds, gathered for a plot of any length: a fixed number of steps in time, and the sheet's cells."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator

import numpy as np

from contactfpga.skin.sheet import Sheet
from contactfpga.tools.view.replayed import BoardRecording
from contactfpga.zones.batch import Batch
from contactfpga.zones.zone import Zones

STEPS = 600
CHUNK = 2000
"""Frames that are looked at together."""
LONGEST_S = 0.25
"""What a frame shows counts for no longer than this: a board with ``send = "on_change"`` speaks at least that often."""


class Touches:
    """Of one sheet, frame after frame."""

    def __init__(self, sheet: Sheet, duration_s: float, steps: int = STEPS):
        self.sheet, self.duration_s = sheet, max(duration_s, 1e-6)
        self.frames = 0
        self.zones = np.zeros(steps, int)
        """The most in each step."""
        self.area_mm2 = np.zeros(steps)
        """Likewise."""
        self.rows = np.zeros((sheet.rows, steps))
        """The largest area in mm2 by the row of its barycenter; with ``report = "cells"`` pressed cells of each row."""
        self.touched_s = np.zeros((sheet.rows, sheet.columns))
        """For how long a barycenter lay in each cell; with ``report = "cells"``, how long each cell was pressed."""
        self.lost = np.zeros(steps, int)
        """Frames that the board sent and that are not there."""
        self._before: Zones | None = None
        self._before_s = 0.0

    @classmethod
    def of(cls, recording: BoardRecording) -> Touches:
        """A whole recording."""
        found = cls(recording.sheet, recording.duration_s)
        same = ((seconds, zones) for seconds, zones in recording.frames() if zones.sheet == recording.sheet)
        for chunk in _chunks(same):
            found._take(chunk)
        return found

    @property
    def seconds(self) -> np.ndarray:
        """(steps + 1,) where each step begins, and where the last one ends."""
        return np.linspace(0, self.duration_s, len(self.zones) + 1)

    def _take(self, chunk: list[tuple[float, Zones]]) -> None:
        times_s = np.array([seconds for seconds, _ in chunk])
        batch = Batch.of([zones for _, zones in chunk])
        steps = np.minimum((times_s / self.duration_s * len(self.zones)).astype(int), len(self.zones) - 1)
        sequences = batch.frames["sequence"]
        if self._before is not None:
            self._hold(self._before, self._before_s, times_s[0])
            self.lost[steps[0]] += (int(sequences[0]) - self._before.sequence - 1) % 256
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
        """What the last frame of a chunk shows lasts until the next one's first."""
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
