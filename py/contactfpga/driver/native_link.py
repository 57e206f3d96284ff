"""A port that a thread in C reads, and everyone who waits for it: no other thread of Python's has to run first.

That thread notes when bytes came and decodes frames (:mod:`contactfpga.driver.native`). Whoever calls takes what came
and has the conversation say what it means, as it does for a :class:`~contactfpga.driver.link.Link` with a thread in
Python. While nobody calls, a thread does so some times a second.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable

from contactfpga.driver.conversation import Arrival, Conversation
from contactfpga.driver.events import Silence
from contactfpga.driver.framequeue import FrameQueue
from contactfpga.driver.link import READ_S, Link, Result, timed_out
from contactfpga.driver.native import Newest, Port, Unsettled
from contactfpga.driver.reads import Reads
from contactfpga.driver.recording import RecordingTransport
from contactfpga.driver.transport import SerialTransport, Transport
from contactfpga.errors import BoardClosed, ContactFPGAError
from contactfpga.skin import Skin
from contactfpga.wire.protocol import Frame
from contactfpga.zones.run import Run
from contactfpga.zones.zone import Zones

SERVE_S = 0.5
"""Interval of taking what came while nobody calls; logs are as late as this. A file of recorded bytes has
:data:`contactfpga.driver.link.READ_S`."""


class NativePort:
    """A serial port whose bytes the thread in C takes: a :class:`~contactfpga.driver.transport.Transport`."""

    live = threaded = True

    def __init__(self, inner: SerialTransport):
        self.name, self.clock, self.write = inner.name, inner.clock, inner.write
        self._inner = inner
        self.core = Port(inner.fileno(), inner.clock())

    def read(self, timeout_s: float) -> bytes:
        """Never called: :class:`NativeLink` takes what came from :attr:`core`."""
        raise AssertionError("a NativeLink takes what came")

    def close(self) -> None:
        self.core.close()
        self._inner.close()

    def lost(self, failure: int) -> ContactFPGAError:
        """The error for a lost port; ``failure`` is :attr:`contactfpga.driver.native.Port.failure`."""
        return self._inner.lost(OSError(failure, os.strerror(failure) if failure > 0 else "it ended"))


class NativeLink(Link):
    """A :class:`~contactfpga.driver.link.Link` to a board on a :class:`NativePort`."""

    def __init__(self, port: NativePort, transport: Transport, skin: Skin | None):
        self._port, self._core = port, port.core
        self._record = transport.take if isinstance(transport, RecordingTransport) else None
        self._settled = self._taking = False
        self._ahead: set[FrameQueue] = set()  # of which frames were shown before they were taken
        self._shown: tuple[int, Frame | None] = 0, None  # number and frame of what was shown last
        super().__init__(transport, skin)

    @property
    def conversation(self) -> Conversation:
        """The conversation after all that came by now."""
        self.catch_up()
        return self._said

    @conversation.setter
    def conversation(self, said: Conversation) -> None:
        self._said = said

    @property
    def last_s(self) -> float:
        """Time at which the last frame came, in s on the host's clock."""
        self.catch_up()
        return self._last_s

    @last_s.setter
    def last_s(self, moment: float) -> None:
        self._last_s = moment

    def catch_up(self) -> None:
        """Take all that came, and what follows from how late it is."""
        with self.changed:
            if self._taking or self._inherited:
                return
            self._taking = True
            try:
                if (found := self._core.take()) is not None:
                    self._take_reads(*found)
                now = self.transport.clock()
                self._said.pass_time(now, self._core.paused(now))
            finally:
                self._taking = False
            if self._failure is None and (failure := self._core.failure):
                self._failure = self._port.lost(failure)

    def _take_reads(self, reads: Reads, begun: bytes, missing: int) -> None:
        said, self._settled = self._said, False
        if missing:
            said.lost_track(begun, missing)
        if self._record is not None:
            for at in range(len(reads)):
                self._record(reads.data_of(at), reads.at_s[at])
        for at_s, events in said.receive_reads(reads):
            for event in events:
                self._pass_on(event)
                if isinstance(event, (Arrival, Run)):
                    self._last_s = at_s
        self._core.decode(said.decodes)
        for queue in self._ahead:
            queue.ahead = 0
        self._ahead.clear()

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
        start = self._said.stats.bytes
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
        """Seconds until the deadline; raises what :meth:`wait_for` does where nothing can come by then. ``start``:
        bytes that had come when it began to wait."""
        if self._failure is not None:
            raise self._failure.with_traceback(None)
        if (left := deadline - self.transport.clock()) > 0:
            return left
        raise timed_out(self.transport.name, timeout, self._said, start, self.net)

    def linger(self, until: float, seconds: float) -> None:
        while (left := until - self.clock()) > 0 and self._failure is None:
            self._core.wait_for_much(min(left, READ_S))
            self.catch_up()

    def newest(self, queue: FrameQueue, timeout: float) -> Zones | None:
        deadline, start = self.clock() + timeout, self._said.stats.bytes
        while True:
            with self.changed:
                self.check_open()
                try:
                    if (zones := self._newest(queue)) is not None:
                        return zones
                except Unsettled:
                    return None
                if queue:
                    return None
                left, seen = self._left(deadline, timeout, start), self._core.taken + queue.ahead
            self._core.wait(seen, min(left, READ_S))

    def _newest(self, queue: FrameQueue) -> Zones | None:
        """The newest frame, none that the queue has had; raises :class:`Unsettled` where what came does not tell it."""
        core = self._core
        try:
            found = core.newest(core.taken + queue.ahead) if self._settled else self._settle(queue)
        except Unsettled:
            found = self._settle(queue)
        if found is None or queue.first_error() is not None:
            return None
        queue.clear()
        queue.ahead = found.packets - core.taken
        self._ahead.add(queue)
        frame, before = core.frame(), None
        if found.before:
            known, shown = self._shown
            before = shown if known == found.packets - 1 else core.frame_before()
        self._shown = found.packets, frame
        return self._said.frame_from(frame, found.time_us, before, found.line_s, found.at_s)

    def _settle(self, queue: FrameQueue) -> Newest | None:
        self.catch_up()
        self._core.settle(self._said.steady())
        self._settled = True
        return self._core.newest(self._core.taken + queue.ahead)

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

    def abandon(self) -> None:
        super().abandon()
        self._core.wake()
