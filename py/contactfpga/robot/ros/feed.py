"""From a board's data to messages: selection, timing and diagnostics, for a ROS 2 node and for Cyclone DDS."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from contactfpga.errors import ReadTimeout, ReplayEnded
from contactfpga.robot.ros import convert
from contactfpga.robot.ros.cdr import encode
from contactfpga.robot.ros.convert import Message, markers, outline
from contactfpga.robot.ros.settings import TOPICS, Settings
from contactfpga.skin import Skin
from contactfpga.tracking.tracker import Tracker
from contactfpga.tracking.tracks import Event, Tracks
from contactfpga.zones.zone import Zones

if TYPE_CHECKING:
    from contactfpga.driver.driver import Board
    from contactfpga.robot.haptics import Contacts
    from contactfpga.robot.haptics.live import FrameSource

KEPT_S = 1.0
"""Interval of measuring the difference of the clocks, which drift."""
_TRIES = 5


class Moments:
    """From the board's clock to that of the messages."""

    def __init__(self, now_ns: Callable[[], int], clock: Callable[[], float]):
        self._now_ns = now_ns
        self._clock = clock
        self._until = -1e300
        self._offset_ns = 0

    def now(self) -> int:
        return self._now_ns()

    def of(self, zones: Zones) -> int:
        """Sample time of a frame in ns; the current time for a recording without one."""
        return self._now_ns() if zones.host_time_s is None else self._shifted(zones.host_time_s)

    def _shifted(self, seconds: float) -> int:
        now = self._clock()
        if not self._until - KEPT_S <= now < self._until:
            self._offset_ns = offset_ns(self._now_ns, self._clock)
            self._until = now + KEPT_S
        return round(seconds * 1e9) + self._offset_ns


def offset_ns(now_ns: Callable[[], int], clock: Callable[[], float]) -> int:
    """The first clock's lead over the second in ns, by the least interrupted of several readings."""
    found = []
    for _ in range(_TRIES):
        before, moment_ns, after = clock(), now_ns(), clock()
        found.append((after - before, moment_ns - round((before + after) / 2 * 1e9)))
    return min(found)[1]


OK, WARN, ERROR = range(3)
WAITED_S = 0.25
"""Waiting time of frames from which diagnostics report it."""

_COUNTED = ("frames", "lost", "dropped", "overwritten", "resynchronized", "restarts", "skin_changes")
_TROUBLE = ("lost", "damaged", "dropped", "restarts")
"""Counters whose increase since the last message is a warning."""


class Diagnostics:
    """Counters between two messages."""

    def __init__(self, board: Board, name: str, silence_s: float):
        self._board = board
        self._name = name
        self._silence_s = silence_s + (Skin.limits("keep_alive_ms")[1] / 1000 if board.hello.send == "on_change" else 0)
        self._heard_s = self._since_s = board.clock()
        self._before: dict[str, int] = {}
        self._waited_s = 0.0
        self._flags: set[str] = set()
        self._faults: tuple[str, ...] = ()

    def frame(self, zones: Zones) -> None:
        self._heard_s = self._board.clock()
        if zones.arrived_s is not None:
            self._waited_s = max(self._waited_s, self._heard_s - zones.arrived_s)
        self._flags |= zones.flags
        self._faults = zones.faults

    @property
    def silent(self) -> bool:
        """Whether no frame came for too long."""
        return self._board.clock() - self._heard_s > self._silence_s

    def message(self, head: Message, left_out: int) -> Message:
        """A ``DiagnosticArray`` of the events since the previous message."""
        counts = self._counts() | {"not published": left_out}
        now, frames = self._board.clock(), counts["frames"] - self._before.get("frames", 0)
        rate = frames / (now - self._since_s) if now > self._since_s else 0.0
        level, text = self._said(counts, now)
        values: dict[str, object] = {
            "port": self._board.port,
            "frames per second": f"{rate:.0f}",
            "faults": ", ".join(self._faults),
        }
        found = _array(head, self._name, level, text, self._board.fingerprint.hex(), values | counts)
        self._before, self._since_s = counts, now
        self._waited_s = 0.0
        self._flags.clear()
        return found

    def _counts(self) -> dict[str, int]:
        stats = self._board.stats
        return {name: int(getattr(stats, name)) for name in _COUNTED} | {"damaged": stats.damaged.total()}

    def _said(self, counts: dict[str, int], now: float) -> tuple[int, str]:
        if self.silent:
            return ERROR, f"no frame for {now - self._heard_s:.1f} s; the sheet may be touched"
        said = [f"{counts[name] - self._before.get(name, 0)} {name}" for name in _TROUBLE if self._more(counts, name)]
        said += [f"flagged {flag}" for flag in ("mismatch", "overflow") if flag in self._flags]
        if self._waited_s > WAITED_S:
            said.append(f"frames waited for {self._waited_s:.1f} s: the computer is too busy")
        said += self._faults
        return (WARN, "; ".join(said)) if said else (OK, "frames come")

    def _more(self, counts: dict[str, int], name: str) -> bool:
        return counts[name] > self._before.get(name, 0)


def lost_board(name: str, why: str, head: Message) -> Message:
    """A ``DiagnosticArray`` without a connected board."""
    return _array(head, name, ERROR, why, "", {})


def _array(head: Message, name: str, level: int, text: str, hardware: str, values: Mapping[str, object]) -> Message:
    status = {
        "level": level,
        "name": f"contactfpga: {name}",
        "message": text,
        "hardware_id": hardware,
        "values": [{"key": key, "value": str(value)} for key, value in values.items()],
    }
    return {"header": head, "status": [status]}


QUEUE = 4096
"""Frames that may wait while others are published."""
BEHIND_S, BEHIND_HZ = 0.02, 10.0
"""Waiting time of a frame, and the largest rate above it."""
EARLY = 0.1
"""Allowed earliness in periods: boards' frame rates are not exact."""
POLL_S = 0.1
"""Wait for a frame before checking other work."""

Send = Callable[[str, bytes], None]
"""Publishes a CDR message by the name of its topic in :data:`TOPICS`."""
Felt = Callable[[Zones, Tracks], "Contacts | None"]
"""Forces at the zones of a frame, from pressure units; None without readings."""


class Feed:
    """Publishes a board's data. One thread calls its methods."""

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
        """Frames tracked but not published, as they were faster than ``zones_hz``."""
        self._board = board
        self._send = send
        self._felt = felt
        self._moments = Moments(now_ns, board.clock)
        self._tracker = Tracker()
        self._events: list[Event] = []
        self._restarted = False
        self._frame = self.settings.frame or board.name.lstrip("/") or "skin"  # tf2 refuses a slash before it
        self._rim = outline(board.sheet)
        self._last: tuple[Zones, Tracks] | None = None
        self._forces: Contacts | None = None
        self._published, self._published_s = -1, -1e300  # zones in the frame published last, and when that was
        self._due = dict.fromkeys(("zones", "markers", "diagnostics"), -1e300)
        self._diagnostics = Diagnostics(board, self._frame, self.settings.silence_s)

    def run(self, frames: FrameSource, stop: Callable[[], bool] = lambda: False) -> None:
        """Publish until ``stop`` returns true or a recording ends; errors as for :meth:`Board.next`."""
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
        """Publish the constants: the Skin, and the sheet's place."""
        self._put("skin", convert.skin(self._board.hello, self._head(self._frame)))
        if self.settings.parent:
            moved = self.settings.place_m, self.settings.turn_rad
            self._put("/tf_static", convert.transform(self._head(self.settings.parent), self._frame, *moved))

    def frame(self, zones: Zones) -> None:
        """Track a frame, and publish it if due or if the number of zones changed."""
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
            self._put("wrench", convert.wrench(total, head | {"frame_id": total.frame.lstrip("/") or self._frame}))
        self._events, self._restarted = [], False

    def _wanted(self, zones: Zones) -> bool:
        now = self._board.clock()
        if zones.arrived_s is not None and now - zones.arrived_s > BEHIND_S:
            return now - self._published_s >= 1 / BEHIND_HZ
        return self._is_due("zones", self.settings.zones_hz)

    def tick(self) -> None:
        """Publish what is due by time alone."""
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
        now, due, period_s = self._board.clock(), self._due[what], 1 / rate_hz
        if now < due - EARLY * period_s:
            return False
        self._due[what] = (due if due > now - period_s else now) + period_s
        return True
