"""Sources of the view: a board, a virtual one, or a recording, moment by moment."""

from __future__ import annotations

import collections
import contextlib
import dataclasses
import time
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from contactfpga.driver.board import Board
from contactfpga.driver.pace import Pace
from contactfpga.driver.stats import Stats
from contactfpga.errors import ReadTimeout
from contactfpga.robot.haptics import Contacts, LoadCells, felt
from contactfpga.skin.sheet import Sheet
from contactfpga.tools.view.fingers import Touchable
from contactfpga.tracking.tracker import Tracker
from contactfpga.tracking.tracks import Tracks
from contactfpga.zones.batch import Batch
from contactfpga.zones.zone import Zone, Zones

MAX_LAG_S = 0.1
"""Largest lag of a board that is caught up; beyond it, time slips."""

STEP_S = 0.02

SILENT_S = 0.5
"""Silence that is reported; a working board sends a frame at least every 0.1 s."""

KEEPS_UP = 0.97

WAITING = 65_536


@dataclasses.dataclass(frozen=True)
class Moment:
    zones: Zones
    tracks: Tracks
    truth: np.ndarray | None = None
    """(rows, columns) bool: closed switches of a virtual board."""
    felt: tuple[Contacts, Zones] | None = None
    """The newest known forces with their frame, some milliseconds older than :attr:`zones`, as later readings must
    arrive first.
    """
    pushes: Sequence[tuple[Zone, float | None]] = ()
    """Zones of the measured frame with a place, each with the push in N if known."""
    arrows: np.ndarray | None = None
    """(n, 2, 3) in m, in the sheet's frame: pushes on a robot's link."""


class Source(Protocol):
    title: str
    sheet: Sheet
    meter: Meter

    def poll(self) -> Moment | None:
        """Wait briefly for a new moment; None: nothing new. Raises the board's errors."""

    def facts(self) -> list[tuple[str, str]]:
        """Further facts, as name and value."""

    @property
    def cells(self) -> LoadCells | None:
        """Places of the pressure units; None: none, or unknown."""

    def close(self) -> None:
        """Release the port."""


class BoardSource:
    """A board, or a virtual one whose simulated time passes like real time: ``virtual`` can be touched and knows its
    closed switches, ``simulated`` cannot.
    """

    def __init__(
        self,
        board: Board,
        title: str,
        virtual: Touchable | None = None,
        cells: LoadCells | None = None,
        simulated: bool = False,
    ):
        self.title, self.sheet = title, board.sheet
        self.cells = cells
        self._felt_in: Zones | None = None
        self.meter = Meter()
        self._board, self._virtual = board, virtual
        self._frames = board.subscribe(WAITING)
        self._pace = Pace(board.clock(), most_lag_s=MAX_LAG_S) if simulated or virtual is not None else None
        # One frame in many is followed, so a contact may be gone from view for longer than from the board's.
        self._tracker = Tracker(gate_mm=40.0, hold_ms=60.0)

    def poll(self) -> Moment | None:
        if not self._wait():
            return None
        zones = self._board.latest()
        truth = None if self._virtual is None else self._virtual.pressed
        felt = self._felt(zones)
        return Moment(zones, self._tracker.update(zones), truth, felt, () if felt is None else pushes(*felt))

    def _felt(self, newest: Zones) -> tuple[Contacts, Zones] | None:
        before, self._felt_in = self._felt_in, newest
        if self.cells is None or before is None or before.units is None:
            return None
        found = felt(self.cells, before)
        return None if found is None else (found, before)

    def _wait(self) -> bool:
        seconds = STEP_S
        if self._pace is not None:
            due = self._pace.due(self._board.clock())
            if due < STEP_S:
                time.sleep(STEP_S - due)
            seconds = min(max(due, STEP_S), self._pace.most_s)
        came = False
        began_s, began = self._board.clock(), time.monotonic()
        with contextlib.suppress(ReadTimeout):
            batch = self.frames(seconds)
            self.meter.take(batch, self._board.stats, self._frames.dropped)
            self.meter.take_latency(batch, self._pace is not None)
            came = True
        if self._pace is not None:
            self._pace.ran(self._board.clock() - began_s, time.monotonic() - began)
        return came

    def frames(self, seconds: float) -> Batch:
        return self._frames.batch(seconds, seconds)

    def facts(self) -> list[tuple[str, str]]:
        stats = self.meter.stats
        silent_s = self._board.silence.seconds
        rows = [("no data", f"for {silent_s:.1f} s; what is drawn is older")] if silent_s > SILENT_S else []
        damaged = sum(stats.damaged.values())
        rows += [("lost", f"{stats.lost} frames, {damaged} packets damaged" if stats.lost or damaged else "nothing")]
        if self.meter.dropped:
            rows.append(("not shown", f"{self.meter.dropped} frames, which came faster than they were read"))
        late = self.meter.late_s
        if late is not None:
            rows.append(("latency", f"{late * 1e6:,.0f} us from the sample of the first row to the last byte"))
        if self._pace is not None and self._pace.share <= KEEPS_UP:
            rows.append(("simulated", f"at {self._pace.share:.0%} of real time; all times here are the board's own"))
        return rows

    def close(self) -> None:
        self._board.close()


def pushes(contacts: Contacts, zones: Zones) -> list[tuple[Zone, float | None]]:
    placed = [zone for zone in zones if zone.x_mm is not None]
    return [(zone, contact.normal_n) for zone, contact in zip(placed, contacts)]


AT_REST = 15.0
"""Frame rate of an untouched board with ``send = "on_change"``."""


def paced(frames_per_s: float) -> str:
    if not frames_per_s:
        return "nothing yet"
    if frames_per_s > AT_REST:
        return f"{frames_per_s:,.0f} frames per second"
    return f"at rest, a keep-alive every {1 / frames_per_s:.1f} s"


CHART_S = 10.0
CHART_STEP_S = 0.05


@dataclasses.dataclass(frozen=True)
class Strip:
    """The last seconds, the maximum of each step, so that no short touch is missed."""

    seconds: np.ndarray
    """Device time, the newest at 0."""
    zones: np.ndarray
    area_mm2: np.ndarray


class Meter:
    """Frame counters over the last second, and the data of the strip chart, in device time."""

    def __init__(self) -> None:
        self.stats = Stats()
        self.dropped = 0
        self._times_us: collections.deque[tuple[int, int]] = collections.deque()
        self._late_s: collections.deque[float] = collections.deque(maxlen=50)
        self._steps: collections.deque[tuple[int, int, float]] = collections.deque(maxlen=int(CHART_S / CHART_STEP_S))

    def take(self, batch: Batch, stats: Stats, dropped: int) -> None:
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
        """Add their latencies; ``virtual``: device times and arrivals share one clock."""
        frames = batch.frames
        sampled_s = frames["time_us"] / 1e6 if virtual else frames["host_time_s"]
        late_s = frames["arrived_s"] - sampled_s
        if np.isfinite(late_s).any():
            self._late_s.append(float(np.nanmedian(late_s)))

    @property
    def late_s(self) -> float | None:
        """Median time in s from a frame's first sample to its arrival; None: unknown."""
        return float(np.median(self._late_s)) if self._late_s else None

    @property
    def frames_per_s(self) -> float:
        if len(self._times_us) < 2:
            return 0.0
        passed_us = self._times_us[-1][0] - self._times_us[0][0]
        return sum(count for _, count in list(self._times_us)[1:]) / max(passed_us, 1) * 1e6

    @property
    def strip(self) -> Strip:
        steps = np.array([step for step, _, _ in self._steps], float)
        seconds = (steps - steps[-1]) * CHART_STEP_S if len(steps) else steps
        kept = seconds > -CHART_S
        counts, areas = (np.array([step[index] for step in self._steps], float) for index in (1, 2))
        return Strip(seconds[kept], counts[kept], areas[kept])
