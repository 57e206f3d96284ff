"""A recording that plays: as fast as asked, from where one is led to."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator

from contactfpga.driver.stats import Stats
from contactfpga.haptics import LoadCells
from contactfpga.tracking.tracker import Tracker
from contactfpga.tracking.tracks import Tracks
from contactfpga.view.meter import Meter
from contactfpga.view.replayed import Recorded
from contactfpga.view.sources import TURN_S, Moment
from contactfpga.zones.batch import Batch
from contactfpga.zones.zone import Zones

SPEEDS = {"1/1000": 0.001, "1/100": 0.01, "1/10": 0.1, "1/4": 0.25, "1": 1.0, "4": 4.0, "16": 16.0}
"""By the names that the panel gives them, the seconds of the recording that pass in one."""

BEFORE_S = 0.25
"""So much before the place that one is led to is read as well: what was there then, a keep-alive later at most."""


class Player:
    """Plays a recording; :meth:`play`, :meth:`pause`, :meth:`seek` and :attr:`speed` are for any thread."""

    cells: LoadCells | None = None

    def __init__(self, recording: Recorded, clock: Callable[[], float] = time.monotonic):
        self.title, self.sheet, self.meter = recording.title, recording.sheet, Meter()
        self.duration_s = recording.duration_s
        self.position_s = 0.0
        """The moment that is shown."""
        self.playing = True
        self.speed = 1.0
        self._recording, self._clock = recording, clock
        self._lock = threading.Lock()
        self._frames: Iterator[tuple[float, Zones]] = iter(())
        self._next: tuple[float, Zones] | None = None
        self._led_to: float | None = 0.0
        self._turned_s = clock()
        self._tracker = Tracker()

    def play(self) -> None:
        """Go on; from the beginning where it has ended."""
        with self._lock:
            if self.position_s >= self.duration_s and self._led_to is None:
                self._led_to = 0.0
            self.playing = True

    def pause(self) -> None:
        """Stay at this moment."""
        self.playing = False

    def seek(self, seconds: float) -> None:
        """Show this moment, and go on from there if it plays."""
        with self._lock:
            self._led_to = min(max(0.0, seconds), self.duration_s)

    def turn(self) -> Moment | None:
        """The frame that is to be shown now, after those before it have been counted and followed."""
        left = TURN_S - (self._clock() - self._turned_s)
        if left > 0:
            time.sleep(left)
        now = self._clock()
        passed, self._turned_s = now - self._turned_s, now
        with self._lock:
            led_to, self._led_to = self._led_to, None
            if led_to is not None:
                self._begin(led_to)
            elif self.playing:
                self.position_s = min(self.duration_s, self.position_s + passed * self.speed)
            until_s = self.position_s
        taken, tracks = self._take(until_s, now + 5 * TURN_S)
        if self._next is None:
            self.playing = False
        elif self._next[0] <= until_s:  # slower than asked: it goes on from where it is
            self.position_s = self._next[0]
        if not taken or tracks is None:
            return None
        self.meter.take(Batch.of(taken), Stats(), 0)
        return Moment(taken[-1], tracks)

    def told(self) -> list[tuple[str, str]]:
        return [("moment", f"{self.position_s:.3f} of {self.duration_s:.3f} s")]

    def close(self) -> None:
        self._frames = iter(())

    def _begin(self, seconds: float) -> None:
        self.position_s = seconds
        self.meter, self._tracker = Meter(), Tracker()
        found = self._recording.frames(max(0.0, seconds - BEFORE_S))
        self._frames = ((when, zones) for when, zones in found if zones.sheet == self.sheet)
        self._next = next(self._frames, None)

    def _take(self, until_s: float, deadline: float) -> tuple[list[Zones], Tracks | None]:
        """Frames up to that moment, each of them followed, until the deadline at least one."""
        taken: list[Zones] = []
        tracks: Tracks | None = None
        while self._next is not None and self._next[0] <= until_s:
            taken.append(self._next[1])
            tracks = self._tracker.update(self._next[1])
            self._next = next(self._frames, None)
            if self._clock() > deadline:
                break
        return taken, tracks
