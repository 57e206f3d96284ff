"""The driver: `read_zones` for one frame now, `open` for every frame."""

from __future__ import annotations

import atexit
import collections
import contextlib
import math
import threading
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType

from contactfpga import ports
from contactfpga.errors import (
    BoardSilent,
    ContactFPGAError,
    OnlyNoise,
    PortLost,
    PortNotFound,
    ReadTimeout,
    ReplayEnded,
    SkinMismatch,
)
from contactfpga.protocol import Hello
from contactfpga.receiver import Item, Receiver, Stats
from contactfpga.skin import Skin
from contactfpga.transport import Recorder, Transport, connect
from contactfpga.zone import Zones

ASK = b"?"
"""Any byte asks the board for a hello and the next frame."""

DEFAULT_BAUD = Skin().baud

BACKLOG_BYTES = 4000
"""A system's receive buffer may be full, and what it holds old, from here on."""

STALE_S = 4.0
"""Bytes that waited this long are not worth reading; a quarter of the time in which the device time wraps."""

PROBE_S = 0.3
"""How long a port may take to say hello while the board is searched."""


class Board:
    """An open port with a board behind it: a context manager that iterates every frame.

    Made by :func:`open`. Not for several threads at once.
    """

    def __init__(self, transport: Transport, skin: Skin | None = None):
        self._transport = transport
        self._receiver = Receiver(transport.name, skin, transport.live)
        self._queue: collections.deque[Zones | ContactFPGAError] = collections.deque()
        self._last_read = transport.clock()
        self._asked = False  # an answer may still come that nobody waits for

    @property
    def port(self) -> str:
        """Name of the port."""
        return self._transport.name

    @property
    def skin(self) -> Skin:
        """The board's Skin: the one given to :func:`open`, or what its hello tells (clock and scan times unknown)."""
        if self._receiver.skin is None:
            raise ContactFPGAError(f"{self.port}: no hello has come yet that fits the Skin")
        return self._receiver.skin

    @property
    def fingerprint(self) -> bytes:
        """Fingerprint of the Skin the board was built from."""
        if self._receiver.hello is None:
            raise ContactFPGAError(f"{self.port}: no hello has come yet")
        return self._receiver.hello.fingerprint

    @property
    def stats(self) -> Stats:
        """Counters since the port was opened."""
        return self._receiver.stats

    def clock(self) -> float:
        """Seconds on the clock that timeouts run on: this computer's; of ``sim://`` the simulated one."""
        return self._transport.clock()

    def read(self, timeout: float = 1.0) -> Zones:
        """Ask the board and return the first complete frame scanned after this call; older ones are discarded.

        ``timeout`` in seconds. Of a recording, the next frame. Raises :class:`ReadTimeout`, :class:`PortLost`,
        :class:`SkinMismatch`, :class:`VersionMismatch`.
        """
        timeout = _checked(timeout)
        if not self._transport.live:
            return self.next(timeout)
        deadline = self._transport.clock() + timeout
        if self._asked:  # the answer to a question that timed out must not be taken for the next one's
            self._request(deadline, timeout)
        return self._request(deadline, timeout)

    def next(self, timeout: float = 1.0) -> Zones:
        """The next frame, in order. Raises as :meth:`read` does, and :class:`ReplayEnded`."""
        deadline = self._transport.clock() + _checked(timeout)
        start = self.stats.bytes
        while not self._queue:
            self._pump(deadline)
            if not self._queue and self._transport.clock() >= deadline:
                raise self._timed_out(timeout, start)
        return _zones(self._queue.popleft())

    def latest(self, timeout: float = 1.0) -> Zones:
        """The newest frame: the last of all that wait, or the next one when none does. Older ones are dropped.

        Of a recording, the next frame. ``timeout`` and errors as for :meth:`next`.
        """
        if not self._transport.live:
            return self.next(timeout)
        deadline = self._transport.clock() + _checked(timeout)
        waited = 0
        while (now := self._transport.clock()) < deadline and (count := self._pump(now)):
            waited += count
        stale = waited >= BACKLOG_BYTES
        for item in list(self._queue)[:-1]:
            self._queue.popleft()
            _zones(item)  # raises what a hello gave cause for
        if stale:
            self._queue.clear()
        return self.next(timeout)

    def __iter__(self) -> Iterator[Zones]:
        """Every frame, for ever; a recording ends."""
        while True:
            try:
                yield self.next()
            except ReplayEnded:
                return

    def __enter__(self) -> Board:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Give the port back; may be called twice."""
        self._transport.close()

    def greet(self, timeout: float) -> None:
        """Wait for the hello without which no frame can be read; keep the frame that answers for :meth:`next`."""
        if self._transport.live:
            self._queue.appendleft(self.read(timeout))
            return
        while self._receiver.hello is None:
            try:
                self._pump(0.0)
            except ReplayEnded:
                raise ContactFPGAError(f"{self.port} holds no hello; its frames cannot be read") from None
        if self._queue and isinstance(self._queue[0], Exception):
            raise self._queue[0]

    def _pump(self, deadline: float) -> int:
        """Read once, until the deadline at most, into the queue; returns the number of bytes."""
        before = self.stats.bytes
        self._queue += (item for item in self._receive(deadline) if not isinstance(item, Hello))
        return self.stats.bytes - before

    def _receive(self, deadline: float) -> list[Item]:
        now = self._transport.clock()
        if now - self._last_read > STALE_S:
            self._drop_waiting()
        data = self._transport.read(max(0.0, deadline - now))
        self._last_read = self._transport.clock()
        return self._receiver.feed(data, self._last_read)

    def _drop_waiting(self) -> None:
        deadline = self._transport.clock() + 1.0  # a wire is always slower than this loop; a pty need not be
        while (data := self._transport.read(0.0)) and self._transport.clock() < deadline:
            self._receiver.discard(data)
        self._last_read = self._transport.clock()

    def _request(self, deadline: float, timeout: float) -> Zones:
        self._queue.clear()
        self._drop_waiting()
        start = self.stats.bytes
        self._transport.write(ASK)
        self._asked = True
        greeted = False
        while True:
            items = self._receive(deadline)
            for index, item in enumerate(items):
                changed = isinstance(item, SkinMismatch) and self._receiver.skin is not None
                if isinstance(item, Hello) or changed:  # another Skin since the last call is no trouble for this one
                    greeted = True
                elif "requested" in _zones(item).flags and greeted:
                    self._asked = False
                    self._queue += (later for later in items[index + 1 :] if not isinstance(later, Hello))
                    return _zones(item)
            if self._transport.clock() >= deadline:
                raise self._timed_out(timeout, start)

    def _timed_out(self, timeout: float, start: int) -> ReadTimeout:
        head = f"{self.port}: no frame within {timeout:g} s"
        if self.stats.bytes == start:
            return BoardSilent(
                f"{head}, not one byte came; is the board powered and its bitstream loaded, is this its port? "
                f"`contactfpga doctor {self.port}` checks"
            )
        seen = f"{self.stats.bytes - start} bytes came"
        if not self.stats.frames and not self.stats.hellos:
            damaged = ", ".join(f"{count} {reason}" for reason, count in self.stats.damaged.items()) or "none whole"
            return OnlyNoise(
                f"{head}; {seen}, but no valid packet ({damaged}); is the baud rate the Skin's, "
                "and is this a contactfpga board?"
            )
        return ReadTimeout(
            f"{head}; {seen}, {self.stats.hellos} hellos and {self.stats.frames} frames since the port was opened; "
            "give it a longer timeout, or send less to the board"
        )


def open(
    port: str | None = None,
    skin: Skin | str | Path | None = None,
    *,
    baud: int | None = None,
    record: str | Path | None = None,
    timeout: float = 1.0,
) -> Board:
    """Open a board and wait for its hello.

    ``port``: a device path, ``sim://`` (``?scene=NAME&skin=FILE``), ``replay://FILE``, or None for the one supported
    board that is plugged in. ``skin``: the Skin (or its file) the board must be built from; None takes what the board
    says. ``baud``: bits a second; that of ``skin``, else 3,000,000. ``record``: a file that gets every byte received;
    ``replay://`` reads it. ``timeout`` in seconds, for the hello.

    Raises :class:`PortNotFound`, :class:`PortLost`, :class:`BoardSilent`, :class:`OnlyNoise`, :class:`ReadTimeout`,
    :class:`SkinMismatch`, :class:`VersionMismatch`.
    """
    timeout = _checked(timeout)
    if skin is not None and not isinstance(skin, Skin):
        skin = Skin.load(skin)
    if baud is None:
        baud = skin.baud if skin is not None else DEFAULT_BAUD
    if port is None:
        port = _find(baud)
    transport = connect(port, baud)
    try:
        if record is not None:
            transport = Recorder(transport, record)
        board = Board(transport, skin)
        board.greet(timeout)
    except BaseException:
        transport.close()
        raise
    return board


_boards: dict[str | None, Board] = {}
_lock = threading.Lock()


def read_zones(port: str | None = None, timeout: float = 1.0) -> Zones:
    """Ask a board for its contact zones: the first complete frame scanned after this call.

    ``port`` as for :func:`open`; it stays open in this process. ``timeout`` in seconds. Past it raises
    :class:`ReadTimeout`, which is a :class:`TimeoutError`; see :func:`open` for the others.
    """
    with _lock:
        if (board := _boards.get(port)) is not None:
            try:
                return board.read(timeout)
            except PortLost:
                _forget(port)  # perhaps it was plugged in again since the last call: try once more below
        board = _boards[port] = open(port, timeout=timeout)
        try:
            return board.next(timeout)  # the answer to the hello was scanned after this call as well
        except PortLost:
            _forget(port)
            raise


def _forget(port: str | None) -> None:
    if (board := _boards.pop(port, None)) is not None:
        board.close()


@atexit.register
def _close_all() -> None:
    for port in list(_boards):
        with contextlib.suppress(Exception):
            _forget(port)


def _find(baud: int) -> str:
    """The one port that a board answers on."""
    found = ports.candidates()
    if not found:
        known = ", ".join(f"{usb.vid:04x}:{usb.pid:04x} ({usb.boards})" for usb in ports.SUPPORTED)
        raise PortNotFound(
            f"no supported board is plugged in (USB ids {known}); name its port, or 'sim://' for the simulated board"
        )
    answers: list[str] = []
    report: list[str] = []
    for candidate in found:
        try:
            open(candidate.device, baud=baud, timeout=PROBE_S).close()
            answers.append(candidate.device)
            report.append(f"{candidate}: says hello")
        except ContactFPGAError as error:
            report.append(f"{candidate}: {error}")
    if len(answers) == 1:
        return answers[0]
    many = "several boards answer; name one of them" if answers else "no board answers"
    raise PortNotFound(f"{many}. Candidates: " + "; ".join(report))


def _zones(item: Zones | ContactFPGAError) -> Zones:
    if isinstance(item, ContactFPGAError):
        raise item
    return item


def _checked(timeout: float) -> float:
    if not (isinstance(timeout, int | float) and math.isfinite(timeout) and timeout > 0):
        raise ValueError(f"timeout is {timeout!r}; it must be a positive number of seconds")
    return float(timeout)
