"""The port ``zenoh://KEY``: a remote board."""

from __future__ import annotations

import collections
import contextlib
import threading
import time
from typing import TYPE_CHECKING

from contactfpga.driver.address import Net
from contactfpga.driver.stats import NetCounters, refused
from contactfpga.errors import ContactFPGAError, MissingExtra, PortLost, PortNotFound, VersionMismatch
from contactfpga.robot.net import session
from contactfpga.robot.net.message import QUIET_S, VERSION, Stream, token

if TYPE_CHECKING:
    import zenoh

MOST_WAITING = 1 << 24
"""Most unread bytes, beyond which the oldest are dropped."""
FOUND_S = 3.0
"""Timeout for the first message of a publisher."""
GONE_S = 1.0
"""Silence after which a publisher is gone, whatever its token, which anyone can declare."""
LATE_S = 0.2
"""Excess of a wait over its timeout from which this process, not the publisher, stood still."""


class ZenohPort:
    """Bytes from a publisher, in order, and requests to it; a transport of the driver."""

    live = threaded = True

    def __init__(self, name: str):
        self.name = name
        self.counters = NetCounters()
        self._address = address = Net.parse(name)
        self._changed = threading.Condition()
        self._pieces: collections.deque[tuple[bytes, bool]] = collections.deque()
        self._waiting = 0
        self._stream = Stream(self.counters)
        self._asks: zenoh.Publisher | None = None
        self._still_s = 0.0  # for which this process stood still since the last message
        self._still_after_s: float | None = None  # when that message came
        try:
            self._session = session.connected(address.connect, address.config)
        except MissingExtra:
            raise
        except ContactFPGAError as error:
            raise PortNotFound(f"{name}: {error}") from None
        try:
            self._asks = self._session.declare_publisher(f"{address.key}/ask", express=True)
            self._bytes = self._session.declare_subscriber(f"{address.key}/bytes", self._take)
            self._life = self._session.liveliness().declare_subscriber(f"{address.key}/alive/*", self._note)
            self._find()
        except BaseException:
            self.close()
            raise

    def _find(self) -> None:
        with self._changed:
            if self._changed.wait_for(lambda: self._stream.heard_s is not None, FOUND_S):
                return
            if self._stream.other_version:
                raise VersionMismatch(
                    f"{self.name}: its publisher sends messages of another version than {VERSION.decode()}, which this "
                    "host reads; install a contactfpga of the same release on both computers"
                )
            step = "is `contactfpga publish` running with this key"
            if self._address.config is not None:
                step += ", and do its access rules let this user read KEY/bytes"
            raise PortNotFound(f"{self.name}: nobody publishes it{refused(self.counters)}; {step}?")

    def read(self, timeout_s: float) -> bytes:
        """Available bytes, after waiting at most ``timeout_s`` for the first."""
        with self._changed:
            if not self._pieces:
                self._wait(timeout_s)
            data = b""
            while self._pieces and not (data and self._pieces[0][1]):
                piece, after_break = self._pieces.popleft()
                self.counters.passed_breaks += after_break
                self._waiting -= len(piece)
                data += piece
            if not data and self._gone():
                raise PortLost(
                    f"{self.name} is gone: its publisher ended, or the network is broken{refused(self.counters)}; "
                    "open it again when it is back"
                )
            return data

    def _wait(self, timeout_s: float) -> None:
        begun_s, heard_s = time.monotonic(), self._stream.heard_s
        self._changed.wait(timeout_s)
        late_s = time.monotonic() - begun_s - timeout_s
        if late_s > LATE_S and self._stream.heard_s == heard_s:
            self._still_s = late_s + (self._still_s if self._still_after_s == heard_s else 0.0)
            self._still_after_s = heard_s

    def _gone(self) -> bool:
        heard_s, wait_s = self._stream.heard_s, self._address.wait_s
        assert heard_s is not None
        silent_s = time.monotonic() - heard_s - (self._still_s if self._still_after_s == heard_s else 0.0)
        return silent_s > (max(wait_s, QUIET_S) if self._stream.ended else wait_s + GONE_S)

    def write(self, data: bytes) -> None:
        assert self._asks is not None
        self._asks.put(data)

    def clock(self) -> float:
        return time.monotonic()

    def close(self) -> None:
        """Leave the network; may be called twice."""
        import zenoh

        if self._asks is not None:
            with contextlib.suppress(zenoh.ZError):  # gone already, which is what closing wants
                self._asks.undeclare()  # else Zenoh would keep the session in memory
        self._session.close()

    def _take(self, sample: zenoh.Sample) -> None:
        with self._changed:
            for piece, after_break in self._stream.take(sample.payload.to_bytes(), time.monotonic()):
                if piece:
                    self._pieces.append((piece, after_break))
                    self._waiting += len(piece)
            while self._waiting > MOST_WAITING:
                self._leave_out()
            if self._pieces or self._stream.publisher is None:  # else only a beat came
                self._changed.notify_all()

    def _leave_out(self) -> None:
        oldest, oldest_broken = self._pieces.popleft()
        self._waiting -= len(oldest)
        self.counters.left_out += len(oldest) - oldest.startswith(b"\0")
        following, broken = self._pieces[0]
        self.counters.breaks += not (oldest_broken or broken)
        self.counters.passed_breaks += oldest_broken and broken
        self._pieces[0] = (following if following.startswith(b"\0") else b"\0" + following), True
        self._waiting += len(self._pieces[0][0]) - len(following)

    def _note(self, sample: zenoh.Sample) -> None:
        import zenoh

        name = str(sample.key_expr).rpartition("/")[2]
        with self._changed:
            number = self._stream.publisher
            if sample.kind == zenoh.SampleKind.DELETE and number is not None and name == token(number):
                self._stream.ended = True
                self._changed.notify_all()
