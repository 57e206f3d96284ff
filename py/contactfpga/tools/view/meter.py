"""Counts over the last second, and the lines of the strip chart."""

from __future__ import annotations

import collections
import dataclasses

import numpy as np

from contactfpga.driver.stats import Stats
from contactfpga.zones.batch import Batch

CHART_S = 10.0
CHART_STEP_S = 0.05


@dataclasses.dataclass(frozen=True)
class Strip:
    """The last seconds, a value for each step; the most that was there within it, so that no short touch is missed."""

    seconds: np.ndarray
    """Of device time, the newest at 0."""
    zones: np.ndarray
    area_mm2: np.ndarray


class Meter:
    """What many frames say together. Times are the device's."""

    def __init__(self) -> None:
        self.stats = Stats()
        self.dropped = 0
        """Frames that came faster than they could be shown."""
        self._times_us: collections.deque[tuple[int, int]] = collections.deque()
        self._late_s: collections.deque[float] = collections.deque(maxlen=50)
        self._steps: collections.deque[tuple[int, int, float]] = collections.deque(maxlen=int(CHART_S / CHART_STEP_S))

    def take(self, batch: Batch, stats: Stats, dropped: int) -> None:
        """Frames that came, and the port's counters after them."""
        self.stats, self.dropped = stats, dropped
        times_us = batch.frames["time_us"]
        if self._times_us and times_us[0] < self._times_us[-1][0]:  # it started again
            self._times_us.clear()
            self._steps.clear()
        self._times_us.append((int(times_us[-1]), len(times_us)))
        while self._times_us[-1][0] - self._times_us[0][0] > 1_000_000:
            self._times_us.popleft()
        self._chart(batch)

    def _chart(self, batch: Batch) -> None:
        starts = batch.starts
        areas = np.concatenate([[0.0], np.cumsum(batch.zones["area_mm2"])])
        areas = areas[starts[1:]] - areas[starts[:-1]]
        counts = batch.frames["total_zones"]
        steps = batch.frames["time_us"] // int(CHART_STEP_S * 1e6)
        begins = np.flatnonzero(np.diff(steps, prepend=steps[0] - 1))
        most = zip(steps[begins], np.maximum.reduceat(counts, begins), np.maximum.reduceat(areas, begins))
        for step, count, area in most:
            if self._steps and self._steps[-1][0] == step:
                _, before_count, before_area = self._steps.pop()
                count, area = max(count, before_count), max(area, before_area)
            self._steps.append((int(step), int(count), float(area)))

    def take_latency(self, batch: Batch, virtual: bool) -> None:
        """The same frames; ``virtual``: the board's clock is that of its arrivals, and need not be estimated."""
        frames = batch.frames
        sampled_s = frames["time_us"] / 1e6 if virtual else frames["host_time_s"]
        late_s = frames["arrived_s"] - sampled_s
        if np.isfinite(late_s).any():
            self._late_s.append(float(np.nanmedian(late_s)))

    @property
    def late_s(self) -> float | None:
        """Median time in s from a frame's first sample to its arrival; None: it is not known."""
        return float(np.median(self._late_s)) if self._late_s else None

    @property
    def frames_per_s(self) -> float:
        """Over the last second."""
        if len(self._times_us) < 2:
            return 0.0
        passed_us = self._times_us[-1][0] - self._times_us[0][0]
        return sum(count for _, count in list(self._times_us)[1:]) / max(passed_us, 1) * 1e6

    @property
    def strip(self) -> Strip:
        """What the chart shows."""
        steps = np.array([step for step, _, _ in self._steps], float)
        seconds = (steps - steps[-1]) * CHART_STEP_S if len(steps) else steps
        kept = seconds > -CHART_S
        counts, areas = (np.array([step[index] for step in self._steps], float) for index in (1, 2))
        return Strip(seconds[kept], counts[kept], areas[kept])
