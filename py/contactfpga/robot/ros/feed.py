"""From what a board sends to messages: which, and when. The same for a ROS 2 node and for Cyclone DDS."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from contactfpga.errors import ReadTimeout, ReplayEnded
from contactfpga.robot.ros import convert
from contactfpga.robot.ros.cdr import encode
from contactfpga.robot.ros.diagnostics import Diagnostics
from contactfpga.robot.ros.markers import markers, outline
from contactfpga.robot.ros.moments import Moments
from contactfpga.robot.ros.settings import TOPICS, Settings
from contactfpga.tracking.tracker import Tracker
from contactfpga.tracking.tracks import Event, Tracks
from contactfpga.zones.zone import Zones

if TYPE_CHECKING:
    from contactfpga.driver.driver import Board
    from contactfpga.robot.haptics import Contacts

QUEUE = 4096
"""Frames that wait while others are published."""
BEHIND_S, BEHIND_HZ = 0.02, 10.0
"""A frame that waited for longer is published this often at most, so that those after it wait less."""
EARLY = 0.1
"""Periods by which a frame may come too early: boards whose frames come at the rate asked for are not exact."""
POLL_S = 0.1
"""How long to wait for a frame before looking at what else is due."""

Send = Callable[[str, bytes], None]
"""Publishes a message, written as CDR, by the name of its topic in :data:`TOPICS`."""
Felt = Callable[[Zones, Tracks], "Contacts | None"]
"""The forces at the zones of a frame, from pressure units; None: no readings belong to it."""


class Frames(Protocol):
    """A subscription, or what else gives frames in order."""

    def next(self, timeout: float = 1.0) -> Zones: ...


class Feed:
    """Publishes what a board says. Its methods are called by one thread."""

    def __init__(
        self,
        board: Board,
        send: Send,
        settings: Settings | None = None,
        felt: Felt | None = None,
        now_ns: Callable[[], int] = time.time_ns,
    ):
        """``now_ns`` is the clock of the messages, in ns."""
        self.settings = settings or Settings()
        self.left_out = 0
        """Frames that were followed, but not published, because they came faster than ``zones_hz``."""
        self._board = board
        self._send = send
        self._felt = felt
        self._moments = Moments(now_ns, board.clock)
        self._tracker = Tracker()
        self._events: list[Event] = []
        self._restarted = False
        self._frame = self.settings.frame or board.name or "skin"
        self._rim = outline(board.sheet)
        self._last: tuple[Zones, Tracks] | None = None
        self._forces: Contacts | None = None
        self._published, self._published_s = -1, -1e300  # zones in the frame published last, and when that was
        self._due = dict.fromkeys(("zones", "markers", "diagnostics"), -1e300)
        self._diagnostics = Diagnostics(board, self._frame, self.settings.silence_s)

    def run(self, frames: Frames, stop: Callable[[], bool] = lambda: False) -> None:
        """Publish until ``stop`` says so, or a recording ends; errors as for :meth:`Board.next`."""
        self.begin()
        while not stop():
            try:
                self.frame(frames.next(POLL_S))
            except ReadTimeout:
                pass  # diagnostics say so when it lasts
            except ReplayEnded:
                return
            self.tick()

    def begin(self) -> None:
        """Say what does not change: the Skin, and where the sheet is."""
        self._put("skin", convert.skin(self._board.hello, self._head(self._frame)))
        if self.settings.parent:
            moved = self.settings.place_m, self.settings.turn_rad
            self._put("/tf_static", convert.transform(self._head(self.settings.parent), self._frame, *moved))

    def frame(self, zones: Zones) -> None:
        """Follow a frame, and publish it if that is due or the number of zones changed."""
        tracks = self._tracker.update(zones)
        self._last = zones, tracks
        self._events += tracks.events
        self._restarted |= tracks.restarted
        self._diagnostics.frame(zones)
        if not self._wanted(zones) and len(zones) == self._published:
            self.left_out += 1
            return
        self._published, self._published_s = len(zones), self._board.clock()
        self._forces = None if self._felt is None else self._felt(zones, tracks)
        head = convert.header(self._moments.of(zones), self._frame)
        self._put("zones", convert.zones(zones, head, zones.host_sigma_s))
        self._put("tracks", convert.tracks(tracks, self._events, self._restarted, head))
        self._put("contacts", convert.contacts(tracks.active, head, self._forces))
        if self._forces is not None:
            total = self._forces.wrench
            self._put("wrench", convert.wrench(total, head | {"frame_id": total.frame or self._frame}))
        self._events, self._restarted = [], False

    def _wanted(self, zones: Zones) -> bool:
        """Whether to publish a frame. Frames wait where the computer is busy, or was while the board was opened."""
        now = self._board.clock()
        if zones.arrived_s is not None and now - zones.arrived_s > BEHIND_S:
            return now - self._published_s >= 1 / BEHIND_HZ
        return self._is_due("zones", self.settings.zones_hz)

    def tick(self) -> None:
        """Publish what is due by the clock alone."""
        if self._is_due("diagnostics", self.settings.diagnostics_hz):
            self._put("/diagnostics", self._diagnostics.message(self._head(""), self.left_out))
        if self._last is None or self._diagnostics.silent or not self._is_due("markers", self.settings.markers_hz):
            return
        zones, tracks = self._last
        head = convert.header(self._moments.of(zones), self._frame)
        self._put("markers", markers(self._rim, tracks.active, head, self._forces))

    def _head(self, frame: str) -> convert.Message:
        return convert.header(self._moments.now(), frame)

    def _put(self, topic: str, message: convert.Message) -> None:
        self._send(topic, encode(TOPICS[topic].type, message))

    def _is_due(self, what: str, rate_hz: float) -> bool:
        """Whether it is time to do it, at this rate on average. What was missed is not made up for."""
        now, due, period_s = self._board.clock(), self._due[what], 1 / rate_hz
        if now < due - EARLY * period_s:
            return False
        self._due[what] = (due if due > now - period_s else now) + period_s
        return True
