"""Playback at a chosen speed from a chosen position."""

from __future__ import annotations

import abc
import threading
import time
from collections.abc import Callable, Iterator
from typing import Generic, TypeVar

from contactfpga.driver.pace import Pace
from contactfpga.driver.stats import Stats
from contactfpga.robot.haptics import LoadCells
from contactfpga.tools.view.board_recording import BoardRecording
from contactfpga.tools.view.sources import STEP_S, Meter, Moment
from contactfpga.tracking.tracker import Tracker
from contactfpga.tracking.tracks import Tracks
from contactfpga.zones.batch import Batch
from contactfpga.zones.zone import Zones

Item = TypeVar("Item")

SPEEDS = {"1/1000": 0.001, "1/100": 0.01, "1/10": 0.1, "1/4": 0.25, "1": 1.0, "4": 4.0, "16": 16.0}

BEFORE_S = 0.25
"""Time before the chosen position that is read as well, with at least a keep-alive."""


class Playback(abc.ABC, Generic[Item]):
    """Plays a recording; :meth:`play`, :meth:`pause`, :meth:`seek` and :attr:`speed` are thread-safe."""

    def __init__(self, duration_s: float, clock: Callable[[], float] = time.monotonic):
        self.duration_s = duration_s
        self.position_s = 0.0
        self.playing = True
        self.speed = 1.0
        self._clock, self._pace = clock, Pace(clock=clock)
        self._lock = threading.Lock()
        self._items: Iterator[tuple[float, Item]] = iter(())
        self._next: tuple[float, Item] | None = None
        self._led_to: float | None = 0.0
        self._stepped_s = clock()

    @abc.abstractmethod
    def begin(self, start_s: float) -> Iterator[tuple[float, Item]]:
        """Timed items from this moment on; earlier ones are forgotten."""

    @abc.abstractmethod
    def follow(self, seconds: float, item: Item) -> None:
        """Add the next item."""

    def play(self) -> None:
        """Continue; from the beginning if ended."""
        with self._lock:
            if self.position_s >= self.duration_s and self._led_to is None:
                self._led_to = 0.0
            self.playing = True

    def pause(self) -> None:
        self.playing = False

    def seek(self, seconds: float) -> None:
        """Show this moment, and continue from it if playing."""
        with self._lock:
            self._led_to = min(max(0.0, seconds), self.duration_s)

    def step(self) -> None:
        """Wait for the next step, and add the items up to its moment."""
        left = STEP_S - (self._clock() - self._stepped_s)
        if left > 0:
            time.sleep(left)
        self._stepped_s = self._clock()
        with self._lock:
            self._pace.factor = self.speed if self.playing else 0.0
            due_s = self._pace.due(self.position_s)
            led_to, self._led_to = self._led_to, None
            if led_to is not None:
                self._go_to(led_to)
                self._items = self.begin(max(0.0, led_to - BEFORE_S))
                self._next = next(self._items, None)
            else:
                self.position_s = min(self.duration_s, self.position_s + due_s)
            until_s = self.position_s
        self._take(until_s, self._stepped_s + 5 * STEP_S)
        if self._next is None:
            self.playing = False
        elif self._next[0] <= until_s:  # slower than asked: it goes on from where it is
            self._go_to(self._next[0])

    def _go_to(self, seconds: float) -> None:
        self.position_s = seconds
        self._pace.restart(seconds)

    def _take(self, until_s: float, deadline: float) -> None:
        while self._next is not None and self._next[0] <= until_s:
            self.follow(*self._next)
            self._next = next(self._items, None)
            if self._clock() > deadline:
                break

    def close(self) -> None:
        self._items = iter(())


class Player(Playback[Zones]):
    cells: LoadCells | None = None

    def __init__(self, recording: BoardRecording, clock: Callable[[], float] = time.monotonic):
        super().__init__(recording.duration_s, clock)
        self.title, self.sheet, self.meter = recording.title, recording.sheet, Meter()
        self._recording = recording
        self._tracker = Tracker()
        self._taken: list[Zones] = []
        self._tracks: Tracks | None = None

    def poll(self) -> Moment | None:
        """The current frame, after counting and tracking those before it."""
        self._taken = []
        self.step()
        if not self._taken or self._tracks is None:
            return None
        self.meter.take(Batch.of(self._taken), Stats(), 0)
        return Moment(self._taken[-1], self._tracks)

    def facts(self) -> list[tuple[str, str]]:
        return [("moment", f"{self.position_s:.3f} of {self.duration_s:.3f} s")]

    def begin(self, start_s: float) -> Iterator[tuple[float, Zones]]:
        self.meter, self._tracker = Meter(), Tracker()
        return ((when, zones) for when, zones in self._recording.frames(start_s) if zones.sheet == self.sheet)

    def follow(self, seconds: float, item: Zones) -> None:
        self._taken.append(item)
        self._tracks = self._tracker.update(item)
