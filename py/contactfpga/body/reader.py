"""One link's board: opened, read, and opened again when it was lost."""

from __future__ import annotations

import contextlib
import math
import threading
from collections.abc import Callable
from typing import Protocol

from contactfpga.body.plan import Plan
from contactfpga.body.snapshot import LinkState
from contactfpga.driver.stats import Stats, total
from contactfpga.errors import (
    BoardClosed,
    BoardSilent,
    OnlyNoise,
    ReadTimeout,
    SkinMismatch,
    VersionMismatch,
)
from contactfpga.tracking.tracker import Tracker
from contactfpga.tracking.tracks import Tracks
from contactfpga.zones.zone import Zones

RETRY_S = 0.5
"""From a failure to open a board to the next try."""
WAIT_S = 0.1
"""How long a board is waited for at a time."""
NO_TRACKS = Tracks(0, (), ())


class OpenBoard(Protocol):
    """What a link needs of :class:`contactfpga.Board`."""

    def latest(self, timeout: float = 1.0) -> Zones:
        """The newest frame."""

    def read(self, timeout: float = 1.0) -> Zones:
        """The first frame scanned after this call."""

    def clock(self) -> float:
        """Seconds on the clock of ``Zones.host_time_s``."""

    @property
    def stats(self) -> Stats:
        """Counters since it was opened."""

    def close(self) -> None:
        """Give the port back."""


class LinkReader:
    """What is known of one link. One thread calls :meth:`step`, any thread :meth:`state`."""

    def __init__(self, plan: Plan, opened: Callable[[Plan], OpenBoard], clock: Callable[[], float]):
        self.plan = plan
        self.tried = False
        """It was tried to open the board, with or without success."""
        self.answered = 0
        """The last call of :meth:`ask` since which a frame was scanned."""
        self._opened, self._clock = opened, clock
        self._lock = threading.Lock()
        self._asked = 0
        self._board: OpenBoard | None = None
        self._retry_at = -math.inf
        self._down, self._reason = "lost", "it was not tried yet"  # said where no board is open
        self._zones: Zones | None = None
        self._tracker, self._tracks = Tracker(), NO_TRACKS
        self._frame_s = self._open_s = -math.inf
        self._ever = False
        self._before = Stats()  # of all boards that were closed

    def ask(self) -> int:
        """Have the next frame be one that is scanned after this call; its number."""
        with self._lock:
            self._asked += 1
            return self._asked

    def step(self) -> float:
        """Do what is due, for little more than :data:`WAIT_S`; how many seconds nothing is due then."""
        if self._board is None:
            wait_s = self._retry_at - self._clock()
            if wait_s > 0:
                return wait_s
            self._open()
            return 0.0
        asked = self._asked
        try:
            zones = self._board.read(WAIT_S) if asked > self.answered else self._board.latest(WAIT_S)
            tracks = self._tracker.update(zones)
            age_s = 0.0 if zones.host_time_s is None else max(0.0, self._board.clock() - zones.host_time_s)
        except (SkinMismatch, VersionMismatch) as error:
            self._drop("mismatch", error)
        except ReadTimeout:
            pass  # its age says so
        except Exception as error:  # of whatever kind: the other links go on, and this one says why it does not
            self._drop("lost", error)
        else:
            with self._lock:
                self._zones, self._tracks = zones, tracks
                self._frame_s, self._ever = self._clock() - age_s, True
            self.answered = max(self.answered, asked)
        return 0.0

    def _open(self) -> None:
        try:
            board = self._opened(self.plan)
        except (SkinMismatch, VersionMismatch) as error:
            self._fail("mismatch", error)
        except (BoardSilent, OnlyNoise, ReadTimeout) as error:
            self._fail("silent", error)
        except Exception as error:
            self._fail("lost", error)
        else:
            with self._lock:
                self._board, self._zones, self._open_s = board, None, self._clock()
        self.tried = True

    def _drop(self, status: str, error: Exception) -> None:
        with contextlib.suppress(Exception):
            if self._board is not None:
                self._board.close()
        self._fail(status, error)

    @property
    def stats(self) -> Stats:
        """Counters of its boards, of those before as well."""
        with self._lock:
            return self._total()

    def _total(self) -> Stats:
        return total([self._before] if self._board is None else [self._before, self._board.stats])

    def _fail(self, status: str, error: Exception) -> None:
        with self._lock:
            self._before = self._total()
            self._board = self._zones = None
            self._down, self._reason = status, str(error) or type(error).__name__
            self._retry_at = self._clock() + RETRY_S

    def close(self) -> None:
        """Give the port back; the thread that calls :meth:`step` has ended."""
        self._drop("lost", BoardClosed("the body was closed"))

    def state(self) -> LinkState:
        """What is known now."""
        with self._lock:
            now = self._clock()
            age_s = now - self._frame_s if self._ever else None
            if self._board is None:
                return LinkState(None, age_s, self._down, self._reason)
            waited_s = now - max(self._frame_s, self._open_s)
            if waited_s > self.plan.silent_s:
                return LinkState(None, age_s, "silent", f"no frame for {waited_s:.3f} s")
            if self._zones is None or age_s is None:
                return LinkState(None, age_s, "late", "no frame since the port was opened")
            status = "ok" if age_s <= self.plan.late_s else "late"
            return LinkState(self._zones, age_s, status, "", self._frame_s, self._tracks)
