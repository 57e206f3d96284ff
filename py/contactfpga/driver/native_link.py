"""A link whose port is read by a thread in C, so that frames wait for no other Python thread.

The C thread notes arrivals and decodes frames (:mod:`contactfpga.driver.native`). Calling threads let the conversation
interpret them; without calls, a thread does so every two seconds. While frames continue one another, the newest is
known before the others are taken.
"""

from __future__ import annotations

import contextlib
import os
import threading
from collections.abc import Callable
from typing import NamedTuple

from contactfpga.driver.conversation import Conversation
from contactfpga.driver.events import Silence
from contactfpga.driver.framequeue import FrameQueue
from contactfpga.driver.link import READ_S, Link, Result, timed_out
from contactfpga.driver.native import NativeFit, NewestUnknown, Port, Steady
from contactfpga.driver.reads import Reads
from contactfpga.driver.recording import RecordingTransport
from contactfpga.driver.transport import SerialTransport, Transport
from contactfpga.errors import BoardClosed, ContactFPGAError
from contactfpga.skin import Skin
from contactfpga.wire.protocol import Frame
from contactfpga.zones.run import Run
from contactfpga.zones.zone import Zones

SERVE_S = 2.0
"""Interval in s of interpretation without calls, which delays logs; for a file of recorded bytes it is
:data:`contactfpga.driver.link.READ_S`.
"""


class NativePort:
    """A serial port that the C thread reads: a :class:`~contactfpga.driver.transport.Transport`."""

    live = threaded = True

    def __init__(self, inner: SerialTransport):
        self.name, self.clock, self.write = inner.name, inner.clock, inner.write
        self._inner = inner
        self.core = Port(inner.fileno(), inner.clock())

    def read(self, timeout_s: float) -> bytes:
        """Never called: :class:`NativeLink` reads from :attr:`core`."""
        raise AssertionError("a NativeLink takes what came")

    def close(self) -> None:
        self.core.close()
        self._inner.close()

    def lost(self, failure: int) -> ContactFPGAError:
        """The error for a lost port; ``failure`` is :attr:`contactfpga.driver.native.Port.failure`."""
        return self._inner.lost(OSError(failure, os.strerror(failure) if failure > 0 else "it ended"))


class _Base(NamedTuple):
    steady: Steady
    packets: int
    more_frames: int
    """Frame number minus packet number, constant while frames continue one another."""


class NativeLink(Link):
    """A :class:`~contactfpga.driver.link.Link` to a board on a :class:`NativePort`.

    The newest frame does not need the lock :attr:`changed`, under which threads may work long.
    """

    fit = NativeFit

    def __init__(self, port: NativePort, transport: Transport, skin: Skin | None):
        self._port, self._core = port, port.core
        self._record = transport.take if isinstance(transport, RecordingTransport) else None
        self._taking = False
        self._showing = threading.Lock()  # held for short only: for what follows, and the core's newest frame
        self._base: _Base | None = None
        self._shown: tuple[int, Frame | None] = 0, None  # packet and frame of what was shown last
        super().__init__(transport, skin)

    @property
    def conversation(self) -> Conversation:
        self.catch_up()
        return self._conversation

    @conversation.setter
    def conversation(self, conversation: Conversation) -> None:
        self._conversation = conversation

    @property
    def last_s(self) -> float:
        self.catch_up()
        return self._last_s

    @last_s.setter
    def last_s(self, moment: float) -> None:
        self._last_s = moment

    def catch_up(self) -> None:
        """Take everything received, and conclude from its delay."""
        with self.changed:
            if self._taking or self._inherited:
                return
            self._taking = True
            try:
                if (found := self._core.take()) is not None:
                    self._take_reads(*found)
                now = self.transport.clock()
                self._conversation.pass_time(now, self._core.paused(now))
            finally:
                self._taking = False
            if self._failure is None and (failure := self._core.failure):
                self._failure = self._port.lost(failure)

    def _take_reads(self, reads: Reads, begun: bytes, missing: int) -> None:
        conversation = self._conversation
        if missing:
            conversation.skip(missing, begun)
        if self._record is not None:
            for at in range(len(reads)):
                self._record(reads.data_of(at), reads.at_s[at])
        for at_s, events in conversation.take(reads):
            for event in events:
                self._pass_on(event)
                if isinstance(event, Run):
                    self._last_s = at_s
        with self._showing:
            self._core.decode(conversation.frame_format)

    def queue(self, maxsize: int, all_events: bool) -> FrameQueue:
        with self.changed:
            self.catch_up()
            return super().queue(maxsize, all_events)

    def silence(self, since: float) -> Silence:
        self.catch_up()
        return super().silence(since)

    def take_what_came(self) -> None:
        self.catch_up()

    # ---- who waits

    def wait_for(self, found: Callable[[], Result | None], deadline: float, timeout: float) -> Result:
        start = self._conversation.stats.bytes
        while True:
            with self.changed:
                self.check_open()
                if (result := found()) is not None:
                    return result
                self.catch_up()
                if (result := found()) is not None:
                    return result
                left, seen = self._left(deadline, timeout, start), self._core.taken
            self._send()
            self._core.wait(seen, min(left, READ_S))

    def _left(self, deadline: float, timeout: float, start: int) -> float:
        """Seconds until the deadline; raises if nothing can come by then. ``start``: bytes received before the wait."""
        if self._failure is not None:
            raise self._failure.with_traceback(None)
        if (left := deadline - self.transport.clock()) > 0:
            return left
        raise timed_out(self.transport.name, timeout, self._conversation, start, self.net)

    def linger(self, until: float, seconds: float) -> None:
        while (left := until - self.clock()) > 0 and self._failure is None:
            self._core.wait_for_much(min(left, READ_S))
            self.catch_up()

    def newest(self, queue: FrameQueue, timeout: float) -> Zones | None:
        deadline, start = self.clock() + timeout, self._conversation.stats.bytes
        while True:
            try:
                found = self._newest(queue)
            except NewestUnknown:
                return None
            if not isinstance(found, int):
                return found
            self._core.wait(found, min(self._left(deadline, timeout, start), READ_S))
            self.check_open()

    def _newest(self, queue: FrameQueue) -> Zones | int | None:
        """The newest frame that the queue has not had; otherwise the number of the packet after which it comes; None if
        the queue decides. Raises :class:`NewestUnknown`.
        """
        try:
            return self._show(queue)
        except NewestUnknown:
            self._settle()
            return self._show(queue)

    def _show(self, queue: FrameQueue) -> Zones | int | None:
        core = self._core
        with self._showing:
            if (base := self._base) is None:
                raise NewestUnknown
            if queue.others:
                return None
            steady, packets, more_frames = base
            seen = max(packets, queue.seen - more_frames)
            if (found := core.newest(seen)) is None:
                return None if queue else seen
            if not queue.show(found.packets + more_frames):
                return found.packets
            before = steady.before
            if found.after_another:
                known, shown = self._shown
                before = shown if shown is not None and known == found.packets - 1 else core.before()
            self._shown = found.packets, found.frame
        return steady.zones(found.frame, found.time_us, before, found.line)

    def _settle(self) -> None:
        with self.changed:
            self.catch_up()
            with self._showing:
                steady = self._conversation.steady()
                self._core.settle(steady)
                packets = self._core.taken
                self._base = None if steady is None else _Base(steady, packets, self._frames - packets)

    # ---- the thread that takes what came while nobody calls, and its end

    def _read_all(self) -> None:
        while True:
            self._core.wait_for_much(SERVE_S if self._record is None else READ_S)
            with self.changed:
                try:
                    self.check_open()
                    self.catch_up()
                except BoardClosed:
                    self._leave()
                    return
                except BaseException as error:  # whoever calls next gets it
                    self._failure = error
                if self._failure is not None:
                    return
            with contextlib.suppress(ContactFPGAError):  # the next call says so
                self._send()

    def forked(self) -> None:
        super().forked()
        self._showing = threading.Lock()

    def abandon(self) -> None:
        super().abandon()
        self._core.wake()
