"""One link's board: opened, read, and opened again when it was lost."""

from __future__ import annotations

import contextlib
import dataclasses
import math
import threading
from collections.abc import Callable
from typing import Protocol

from contactfpga.driver.stats import Stats, total
from contactfpga.errors import (
    BoardClosed,
    BoardSilent,
    OnlyNoise,
    ReadTimeout,
    SkinMismatch,
    VersionMismatch,
)
from contactfpga.inputs.values import shown
from contactfpga.robot.body.known import Known, Seen
from contactfpga.robot.body.plan import Plan
from contactfpga.robot.body.state import LinkState
from contactfpga.robot.body.together import Together
from contactfpga.tracking.tracker import Tracker
from contactfpga.zones.zone import Zones

RETRY_S = 0.5
"""From a failure to open a board to the next try."""
WAIT_S = 0.1
"""How long a board is waited for at a time."""


class OpenBoard(Protocol):
    """What a link needs of :class:`contactfpga.Board`."""

    def latest(self, timeout: float = 1.0) -> Zones:
        """The newest frame."""

    def read(self, timeout: float = 1.0) -> Zones:
        """The first frame scanned after this call."""

    def clock(self) -> float:
        """Seconds on the clock of ``Zones.host_time_s``."""

    @property
    def name(self) -> str:
        """What it was named by the Skin that it was built from; "" where it was not."""

    @property
    def stats(self) -> Stats:
        """Counters since it was opened."""

    def close(self) -> None:
        """Give the port back."""


class LinkReader:
    """What is known of one link. One thread calls :meth:`step`, any thread :meth:`state`."""

    def __init__(
        self,
        plan: Plan,
        opened: Callable[[Plan], OpenBoard],
        clock: Callable[[], float],
        together: Together | None = None,
    ):
        """``together``: has virtual boards run on one clock."""
        self.plan = plan
        self._together = together if plan.virtual else None
        self.tried = False
        """It was tried to open the board, with or without success."""
        self.answered = 0
        """The last call of :meth:`ask` since which a frame was scanned."""
        self._opened, self._clock = opened, clock
        self._lock = threading.Lock()
        self._asked = 0
        self._board: OpenBoard | None = None
        self._retry_at = -math.inf
        self._known = Known()
        self._tracker = Tracker()
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
        due_s = WAIT_S if self._together is None else self._together.due_s(self.plan.name, self._board.clock())
        asked = self._asked
        if asked == self.answered and due_s <= 0:
            return 0.0
        try:
            if asked > self.answered:
                self._take(self._board.read(WAIT_S))
            elif self._together is None:
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
        """Simulated time, and take every frame of it."""
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
        self._known = Known(True, self._known.open_s, zones, tracks, frame_s, sampled_s)

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
            if self._together is not None:
                known = dataclasses.replace(known, came_s=board.clock())
                self._together.join(self.plan.name, known.came_s)
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
        """Counters of its boards, of those before as well."""
        with self._lock:
            return self._total()

    def _total(self) -> Stats:
        return total([self._before] if self._board is None else [self._before, self._board.stats])

    def _fail(self, status: str, error: Exception) -> None:
        if self._together is not None:
            self._together.leave(self.plan.name)
        with self._lock:
            self._before = self._total()
            self._board = None
            reason = str(error) or type(error).__name__
            self._known = dataclasses.replace(self._known, opened=False, zones=None, down=status, reason=reason)
            self._retry_at = self._clock() + RETRY_S

    def close(self) -> None:
        """Give the port back; the thread that calls :meth:`step` has ended."""
        self._drop("lost", BoardClosed("the body was closed"))

    def seen(self) -> Seen:
        """What is known now, from which :class:`States` are made."""
        if self._together is None:
            return self._known, None
        with self._lock:  # a board that is open stays so meanwhile
            return self._known, None if self._board is None else self._board.clock()

    def state(self) -> LinkState:
        """The state now."""
        known, board_s = self.seen()
        return known.state(self.plan, self._clock(), board_s)
