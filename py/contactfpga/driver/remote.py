"""A port that a process of its own reads (:mod:`contactfpga.driver.reader`), as a board's methods use it.

What a :class:`~contactfpga.driver.link.Link` does with a thread that decodes, this does with memory that the other
process writes: no other thread of this process has to run before a frame is here.
"""

from __future__ import annotations

import contextlib
import os
import select
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

from contactfpga.driver import forks
from contactfpga.driver.address import Replay, SheetOf, Sim, parse
from contactfpga.driver.events import Silence
from contactfpga.driver.link import ASK_S, Result, check_command, denied_error, timed_out
from contactfpga.driver.reader_process import ReaderProcess
from contactfpga.driver.recording import Tap
from contactfpga.driver.remote_board import RemoteConversation, Waiter
from contactfpga.driver.ringqueue import Cursor, RingQueue
from contactfpga.driver.shared import Marks, WriterGone
from contactfpga.driver.stats import NetCounters
from contactfpga.driver.transport import OPEN_PORTS, SimulatedPort, user_of
from contactfpga.errors import AddressError, BoardClosed, PortBusy, PortLost, ReadTimeout
from contactfpga.skin import Skin
from contactfpga.wire.command import Command
from contactfpga.zones.run import Run
from contactfpga.zones.zone import Zones


class RemotePort:
    """The port, as far as this process knows it: a :class:`~contactfpga.driver.transport.Transport` that nobody reads
    here."""

    live = threaded = True

    def __init__(self, name: str):
        self.name = name

    def clock(self) -> float:
        return time.monotonic()


class RemoteLink:
    """A :class:`~contactfpga.driver.link.Link` to a port that a process of its own reads."""

    def __init__(self, name: str, reader: ReaderProcess):
        self.transport = RemotePort(name)
        self._reader = reader
        self._shared = reader.shared
        self.conversation = RemoteConversation(self._shared)
        self.changed = threading.Condition()
        self._asking, self._commanding = threading.Lock(), threading.Lock()
        self._tickets = 0
        self._asked_s = -float("inf")
        self._closing = self._inherited = self._over = False
        self._control = reader.control.fileno()
        self._waiting = threading.local()
        forks.watch(self)

    def start(self) -> None:
        """It reads already."""

    def queue(self, maxsize: int, all_events: bool) -> RingQueue:
        """A queue for what comes from now on; with all events first the faults that the board told last."""
        while True:
            queue = RingQueue(self._shared.ring, self.conversation, maxsize, all_events)
            told = self.conversation.lines.told
            if self._marks().facts == self._shared.facts.version:
                break
        if all_events and told:
            queue.put_back(told)
        return queue

    def _marks(self) -> Marks:
        try:
            return self._shared.ring.marks()
        except WriterGone:
            raise self._gone() from None

    def _gone(self) -> PortLost:
        return PortLost(f"{self.transport.name}: its reader process has ended; open it again")

    @property
    def last_s(self) -> float:
        """When a frame came last."""
        return self._marks().last_s

    def clock(self) -> float:
        """Seconds on the clock that timeouts run on."""
        self.check_open()
        return self.transport.clock()

    def read(self, timeout: float) -> Result:
        """Ask the board; the first frame scanned after now, or the error that came in its place."""
        deadline = self.clock() + timeout
        return self.wait_for(self._asked("ask", deadline).look, deadline, timeout)

    def _asked(self, what: str, until: float, *numbers: int) -> Waiter:
        """Ask the other process, which counts tickets as they are counted here."""
        waiter = Waiter(self._shared, self.conversation)
        with self._asking:
            self.check_open()
            self._tickets += 1
            waiter.ticket = self._tickets
            self._reader.send(what, until, *numbers)
        return waiter

    def ask(self) -> None:
        """Ask the board, at most once per second; nobody waits for the answer, which says how late frames are."""
        now = self.transport.clock()
        if now >= self._asked_s + ASK_S:
            self._asked_s = now
            self._asked("ask", now)

    def command(self, command: Command, timeout: float) -> Result:
        """Have the board do something; as :meth:`contactfpga.driver.link.Link.command`."""
        deadline, denied = self.clock() + timeout, self._denied()
        name = self.transport.name
        if not self._commanding.acquire(timeout=timeout):
            raise ReadTimeout(f"{name}: another command was not answered within {timeout:g} s")
        try:
            self.check_open()
            check_command(name, self.conversation.hello, command)
            waiter = self._asked("command", deadline, command.what, command.value)
            try:
                return self.wait_for(waiter.look, deadline, timeout)
            except ReadTimeout:
                if self._denied() == denied:
                    raise
                raise denied_error(name) from None
            finally:
                self._reader.send("end command")
        finally:
            self._commanding.release()

    @property
    def net(self) -> NetCounters | None:
        """What is counted about the network; None: there is none."""
        return self.conversation.net

    def _denied(self) -> int:
        return 0 if self.net is None else self.net.denied

    def silence(self, since: float) -> Silence:
        """How long no frame has come, where someone waits since that moment."""
        marks = self._marks()
        stats, last = self.conversation.stats, None
        if marks.last >= 0:
            cursor = Cursor(self._shared.ring, self.conversation)
            newest = self._shared.ring.look(marks.last)
            if newest is not None:
                cursor.jump(marks.last, newest)
                item = cursor.item(newest)
                last = item[len(item) - 1] if isinstance(item, Run) else item
        seconds = self.transport.clock() - max(since, marks.last_s)
        last = last if isinstance(last, Zones) else None
        return Silence(self.transport.name, seconds, stats.bytes - marks.last_bytes, last)

    def wait_for(self, found: Callable[[], Result | None], deadline: float, timeout: float) -> Result:
        """What ``found`` returns as soon as it is not None; raises :class:`ReadTimeout` at the deadline."""
        start = self._marks().bytes
        while True:
            self.check_open()
            ended = self._ended()
            with self.changed:
                try:
                    result = found()
                except WriterGone:
                    raise self._gone() from None
            if result is not None:
                return result
            if ended:
                raise self._failure()
            left = deadline - self.transport.clock()
            if left <= 0:
                raise timed_out(self.transport.name, timeout, self.conversation, start, self.net)
            self._wait(min(left, 1.0))

    def _wait(self, seconds: float) -> None:
        """Until something comes, at most so long. Each thread has its own look at the same event, which none takes."""
        events = getattr(self._waiting, "events", None)
        try:
            if events is None:
                with self._asking:
                    self.check_open()
                    events = self._waiting.events = select.epoll()
                    events.register(self._reader.wake, select.EPOLLIN | select.EPOLLET)
                    events.register(self._reader.control, select.EPOLLRDHUP)
            self._over = any(place == self._control for place, _ in events.poll(seconds)) or self._over
        except (OSError, ValueError):
            self.check_open()
            raise

    def _ended(self) -> bool:
        """Whether nothing can come any more, as far as is known."""
        return self._over or self.conversation.facts.failure is not None

    def _failure(self) -> BaseException:
        failure = self.conversation.facts.failure
        return self._gone() if failure is None else failure.with_traceback(None)

    def leave(self, queue: object) -> None:
        """It holds nothing here."""

    def linger(self, until: float, seconds: float) -> None:
        """Let all come that comes until then."""
        while (left := until - self.transport.clock()) > 0:
            self.check_open()
            time.sleep(min(left, 0.05))

    def check_open(self) -> None:
        if self._inherited:
            raise BoardClosed(f"{self.transport.name} {forks.ELSEWHERE}")
        if self._closing:
            raise BoardClosed(f"{self.transport.name} was closed; open it again")

    def take_what_came(self) -> None:
        """It is here already."""

    def abandon(self) -> None:
        """Have the port given back: nobody can wait for anything any more."""
        with contextlib.suppress(Exception):
            self.close()

    def close(self) -> None:
        """Give the port back; may be called twice."""
        with self._asking:
            if self._closing:
                return
            self._closing = True
        OPEN_PORTS.discard(self.transport)
        os.eventfd_write(self._reader.wake, 1)
        failure = self._reader.end()
        self.conversation.stats  # noqa: B018
        if failure is not None:
            raise failure

    def forked(self) -> None:
        """In a child process the port is closed, and stays open in its parent."""
        self.changed, self._asking, self._commanding = threading.Condition(), threading.Lock(), threading.Lock()
        if not self._closing:
            self._closing = self._inherited = True
            OPEN_PORTS.discard(self.transport)
            self._reader.disown()


def open_link(port: str | SimulatedPort, baud: int, skin: Skin | None, record: str | Path | Tap | None) -> RemoteLink:
    """Have a process of its own read a port. Raises as :func:`contactfpga.driver.transport.connect`, and
    :class:`AddressError` for what no other process can read."""
    name = port if isinstance(port, str) else "the virtual board"
    if why := refusal(port, record):
        raise AddressError(f"{name}: {why}; leave reader='process' out")
    try:
        file = record if record is None else os.path.abspath(str(record))
        link = RemoteLink(name, ReaderProcess(name, baud, skin, file))
    except PortBusy:
        raise PortBusy(f"{name} is in use: {user_of(name)}") from None
    OPEN_PORTS.add(link.transport)
    return link


def refusal(port: str | SimulatedPort, record: object = None) -> str:
    """Why no other process can read a port; empty where one can."""
    if missing := unavailable():
        return missing
    if not isinstance(port, str):
        return "a virtual board lives in the process that made it"
    if record is not None and not isinstance(record, (str, Path)):
        return "what records it is an object of this process"
    return REFUSED.get(type(parse(port)), "")


def unavailable() -> str:
    """Why there can be no reader process on this computer; empty where there can."""
    if not all(hasattr(os, name) for name in ("memfd_create", "eventfd", "pidfd_open")):
        return "a reader process needs Linux"
    return "" if sys.executable else "a reader process needs the path of Python, which sys.executable lacks"


REFUSED: dict[type, str] = {
    Sim: "a virtual board is simulated while it is read, in the process that reads it",
    Replay: "a recording is read as fast as it is asked for, which no other process helps",
    SheetOf: "the sheets of one port are read together, in one process",
}
"""Addresses that no other process can read, and why."""
