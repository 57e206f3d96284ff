"""One link's board: opened, read, and reopened after a loss."""

from __future__ import annotations

import contextlib
import dataclasses
import math
import threading
from collections.abc import Callable, Iterator, Mapping
from typing import Protocol

from contactfpga.driver import driver
from contactfpga.driver.address import searched
from contactfpga.driver.board import Board
from contactfpga.driver.pace import Pace
from contactfpga.driver.stats import Stats, total
from contactfpga.errors import BoardClosed, BoardSilent, OnlyNoise, ReadTimeout, SkinMismatch, VersionMismatch
from contactfpga.inputs.values import shown
from contactfpga.robot.body.plan import Plan
from contactfpga.robot.body.state import LinkState
from contactfpga.tracking.tracker import Tracker
from contactfpga.tracking.tracks import Tracks
from contactfpga.zones.zone import Zones


def open_board(plan: Plan, timeout: float = 1.0) -> Board:
    """The board of a link; ``timeout``: seconds for its hello. Raises the errors of :func:`contactfpga.open`."""
    with _lock(plan.port):
        return driver.open(plan.port, plan.skin, timeout=timeout, trust=plan.trust)


def _lock(port: str | None) -> contextlib.AbstractContextManager[None]:
    if searched(port):
        return _PORTS.exclusive()
    elsewhere = port is not None and "://" in port  # virtual, or on the network: no search opens it
    return contextlib.nullcontext() if elsewhere else _PORTS.shared()


class _PortLock:
    """A lock for searches, which open every free port: meanwhile no other link opens its own."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._shared = self._waiting = 0
        self._alone = False

    @contextlib.contextmanager
    def shared(self) -> Iterator[None]:
        """Hold the lock for a link with a port; a waiting search goes first."""
        with self._changed:
            self._changed.wait_for(lambda: not self._alone and not self._waiting)
            self._shared += 1
        try:
            yield
        finally:
            with self._changed:
                self._shared -= 1
                self._changed.notify_all()

    @contextlib.contextmanager
    def exclusive(self) -> Iterator[None]:
        with self._changed:
            self._waiting += 1
            self._changed.wait_for(lambda: not self._alone and not self._shared)
            self._waiting -= 1
            self._alone = True
        try:
            yield
        finally:
            with self._changed:
                self._alone = False
                self._changed.notify_all()


_PORTS = _PortLock()


STEP_S = 0.005
"""Largest lead of simulated time between boards."""
LAG_S = 0.02
"""Largest lag that a slow computer makes up for."""


class SharedClock:
    """Gives boards simulated time at the rate of real time, and in step. Thread-safe."""

    def __init__(self, clock: Callable[[], float]):
        self._lock = threading.Lock()
        self._pace = Pace(0.0, most_lag_s=LAG_S, clock=clock)
        self._joined_s: dict[str, float] = {}  # by link, what to add to a board's clock for the common one
        self._now_s: dict[str, float] = {}  # on the common clock, of each board

    def join(self, link: str, board_s: float) -> None:
        """Add a board whose own clock reads ``board_s``; it starts at the others' time."""
        with self._lock:
            now_s = min(self._now_s.values(), default=self._pace.due(0.0))
            self._joined_s[link], self._now_s[link] = now_s - board_s, now_s

    def leave(self, link: str) -> None:
        with self._lock:
            self._joined_s.pop(link, None)
            self._now_s.pop(link, None)

    def due_s(self, link: str, board_s: float) -> float:
        """Seconds that may pass now for this board, whose clock reads ``board_s``; at most 0: none."""
        with self._lock:
            mine_s = self._now_s[link] = self._joined_s[link] + board_s
            last_s = min(self._now_s.values())
            return last_s + min(self._pace.due(last_s), STEP_S) - mine_s


NO_TRACKS = Tracks(0, (), ())


@dataclasses.dataclass(frozen=True, slots=True)
class LinkMemory:
    """State of a link between events."""

    opened: bool = False
    open_s: float = -math.inf
    zones: Zones | None = None
    tracks: Tracks = NO_TRACKS
    frame_s: float = -math.inf
    """Scan time of the newest frame ever on the body's clock."""
    came_s: float = -math.inf
    """Scan time of the newest frame ever on its board's clock."""
    down: str = "lost"
    reason: str = "it was not tried yet"

    def state(self, plan: Plan, now: float, board_s: float | None) -> LinkState:
        """State at a moment; ``board_s`` is the moment on a virtual board's clock, None for others."""
        age_s = None if self.frame_s == -math.inf else now - self.frame_s
        if not self.opened:
            return LinkState(None, age_s, self.down, self.reason)
        waited_s = now - max(self.frame_s, self.open_s)
        if board_s is not None:  # nothing happens on the sheet while its time does not pass
            waited_s = board_s - self.came_s
            age_s = None if self.zones is None else waited_s
        if waited_s > plan.silent_s:
            return LinkState(None, age_s, "silent", f"no frame for {waited_s:.3f} s")
        if self.zones is None or age_s is None:
            return LinkState(None, age_s, "late", "no frame since the port was opened")
        status = "ok" if age_s <= plan.late_s else "late"
        return LinkState(self.zones, age_s, status, "", self.frame_s, self.tracks)


Observation = tuple[LinkMemory, float | None]


class States(Mapping[str, LinkState]):
    """The states of all links at a moment."""

    def __init__(self, plans: Mapping[str, Plan], observed: Mapping[str, Observation], now: float):
        self._plans, self._observed, self._now = plans, observed, now

    def __getitem__(self, name: str) -> LinkState:
        known, board_s = self._observed[name]
        return known.state(self._plans[name], self._now, board_s)

    def __iter__(self) -> Iterator[str]:
        return iter(self._observed)

    def __len__(self) -> int:
        return len(self._observed)


RETRY_S = 0.5
WAIT_S = 0.1
"""Longest wait for a board at a time."""


class OpenBoard(Protocol):
    def latest(self, timeout: float = 1.0) -> Zones:
        """The newest frame."""

    def read(self, timeout: float = 1.0) -> Zones:
        """The first frame scanned after this call."""

    def clock(self) -> float:
        """Seconds on the clock of ``Zones.host_time_s``."""

    @property
    def name(self) -> str:
        """Name in its Skin; "" if unnamed."""

    @property
    def stats(self) -> Stats:
        """Counters since it was opened."""

    def close(self) -> None:
        """Release the port."""


class LinkReader:
    """Reads one link. One thread calls :meth:`step`, any thread :meth:`state`."""

    def __init__(
        self,
        plan: Plan,
        opened: Callable[[Plan], OpenBoard],
        clock: Callable[[], float],
        shared_clock: SharedClock | None = None,
    ):
        """``shared_clock``: keeps virtual boards on one clock."""
        self.plan = plan
        self._shared_clock = shared_clock if plan.virtual else None
        self.tried = False
        """Whether opening was attempted."""
        self.answered = 0
        """The last :meth:`ask` since which a frame was scanned."""
        self._opened, self._clock = opened, clock
        self._lock = threading.Lock()
        self._asked = 0
        self._board: OpenBoard | None = None
        self._retry_at = -math.inf
        self._known = LinkMemory()
        self._tracker = Tracker()
        self._before = Stats()  # of all boards that were closed

    def ask(self) -> int:
        """Request a frame scanned after this call; returns the request's number."""
        with self._lock:
            self._asked += 1
            return self._asked

    def step(self) -> float:
        """Do what is due, for little more than :data:`WAIT_S`; returns the seconds until the next call."""
        if self._board is None:
            wait_s = self._retry_at - self._clock()
            if wait_s > 0:
                return wait_s
            self._open()
            return 0.0
        due_s = WAIT_S if self._shared_clock is None else self._shared_clock.due_s(self.plan.name, self._board.clock())
        asked = self._asked
        if asked == self.answered and due_s <= 0:
            return 0.0
        try:
            if asked > self.answered:
                self._take(self._board.read(WAIT_S))
            elif self._shared_clock is None:
                self._take(self._board.latest(due_s))
            else:
                self._let_pass(due_s)
        except (SkinMismatch, VersionMismatch) as error:
            self._drop("mismatch", error)
        except ReadTimeout:
            pass  # its age says so
        except Exception as error:  # of whatever kind: the other links go on, and this one says why it does not
            self._drop("lost", error)
        else:
            self.answered = max(self.answered, asked)
        return 0.0

    def _let_pass(self, seconds: float) -> None:
        assert self._board is not None
        until_s = self._board.clock() + seconds
        while (left_s := until_s - self._board.clock()) > 0 and self._asked == self.answered:
            self._take(self._board.latest(left_s))

    def _take(self, zones: Zones) -> None:
        assert self._board is not None
        own, theirs = self.plan.skin.name, self._board.name
        if own and theirs and own != theirs:
            raise SkinMismatch(f"the board is named {shown(theirs)}; this link's Skin is named {shown(own)}")
        tracks = self._tracker.update(zones)
        now_s = self._board.clock()
        sampled_s = now_s if zones.host_time_s is None else min(zones.host_time_s, now_s)
        frame_s = self._clock() - (now_s - sampled_s)
        self._known = LinkMemory(True, self._known.open_s, zones, tracks, frame_s, sampled_s)

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
            known = dataclasses.replace(self._known, opened=True, open_s=self._clock())
            if self._shared_clock is not None:
                known = dataclasses.replace(known, came_s=board.clock())
                self._shared_clock.join(self.plan.name, known.came_s)
            with self._lock:
                self._board, self._known = board, known
        self.tried = True

    def _drop(self, status: str, error: Exception) -> None:
        board = self._board
        self._fail(status, error)
        with contextlib.suppress(Exception):
            if board is not None:
                board.close()

    @property
    def stats(self) -> Stats:
        with self._lock:
            return self._total()

    def _total(self) -> Stats:
        return total([self._before] if self._board is None else [self._before, self._board.stats])

    def _fail(self, status: str, error: Exception) -> None:
        if self._shared_clock is not None:
            self._shared_clock.leave(self.plan.name)
        with self._lock:
            self._before = self._total()
            self._board = None
            reason = str(error) or type(error).__name__
            self._known = dataclasses.replace(self._known, opened=False, zones=None, down=status, reason=reason)
            self._retry_at = self._clock() + RETRY_S

    def close(self) -> None:
        """Release the port, after the thread that calls :meth:`step` has ended."""
        self._drop("lost", BoardClosed("the body was closed"))

    def observe(self) -> Observation:
        if self._shared_clock is None:
            return self._known, None
        with self._lock:  # a board that is open stays so meanwhile
            return self._known, None if self._board is None else self._board.clock()

    def state(self) -> LinkState:
        known, board_s = self.observe()
        return known.state(self.plan, self._clock(), board_s)
