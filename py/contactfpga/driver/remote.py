"""A port that a process of its own reads (:mod:`contactfpga.driver.reader`), as a board's methods use it.

What a :class:`~contactfpga.driver.link.Link` does with a thread that decodes, this does with memory that the other
process writes: no other thread of this process has to run before a frame is here.
"""

from __future__ import annotations

import contextlib
import json
import marshal
import os
import pickle
import select
import socket
import subprocess
import sys
import threading
import time
import weakref
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path

from contactfpga.driver import forks
from contactfpga.driver.address import Replay, SheetOf, Sim, parse
from contactfpga.driver.events import Silence
from contactfpga.driver.link import ASK_S, LOG, Result, check_command, denied_error, timed_out
from contactfpga.driver.packed import unpack_error, unpack_frame
from contactfpga.driver.reader import COUNTED, LONGEST_MESSAGE, MEMORY_BYTES, Facts, Shared
from contactfpga.driver.recording import Tap
from contactfpga.driver.ringqueue import Cursor, RingQueue
from contactfpga.driver.shared import ERROR, FRAME, SWEEP, Marks, WriterGone
from contactfpga.driver.stats import NetCounters, Stats
from contactfpga.driver.transport import OPEN_PORTS, SimulatedPort, user_of
from contactfpga.errors import AddressError, BoardClosed, ContactFPGAError, PortBusy, PortLost, ReadTimeout
from contactfpga.skin import Skin
from contactfpga.skin.sheet import Sheet
from contactfpga.wire.command import Command
from contactfpga.wire.faults import Faults
from contactfpga.wire.hello import Hello
from contactfpga.wire.units import Sweep, UnitFacts
from contactfpga.zones.run import Run
from contactfpga.zones.units import UnitHistory, UnitSamples
from contactfpga.zones.zone import Zones

START_S = 60.0
"""How long the process may take to start, on a machine that is busy."""
END_S = 5.0
"""How long it may take to give the port back."""

_CODE = """import json, sys
numbers, sys.path[:] = json.loads(sys.argv[1])
from contactfpga.driver.reader import main
main(*numbers)"""


class RemotePort:
    """The port, as far as this process knows it: a :class:`~contactfpga.driver.transport.Transport` that nobody reads
    here."""

    live = threaded = True

    def __init__(self, name: str):
        self.name = name

    def clock(self) -> float:
        return time.monotonic()


class ReaderProcess:
    """The process, its socket and the memory that it writes."""

    def __init__(self, name: str, baud: int, skin: Skin | None, record: str | Path | None):
        memory = os.memfd_create("contactfpga", os.MFD_CLOEXEC)
        try:
            os.ftruncate(memory, MEMORY_BYTES)
            self.shared = Shared.of(memory)
            self.wake = os.eventfd(0, os.EFD_CLOEXEC | os.EFD_NONBLOCK)
            self.control, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            with theirs:
                numbers = theirs.fileno(), memory, self.wake
                command = [sys.executable, "-c", _CODE, json.dumps([numbers, sys.path]), f"reader of {name}"]
                self.process = subprocess.Popen(
                    command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, pass_fds=numbers
                )
        finally:
            os.close(memory)
        try:
            self._begin(name, pickle.dumps((os.getpid(), name, baud, skin, record)))
        except BaseException:
            self.end()
            raise

    def _begin(self, name: str, asked: bytes) -> None:
        self.control.send(asked)
        self.control.settimeout(START_S)
        try:
            answer = self.control.recv(LONGEST_MESSAGE)
        except TimeoutError:
            answer = b""
        if not answer:
            raise ContactFPGAError(
                f"{name}: its reader process did not start within {START_S:g} s; open it with reader='thread'"
            )
        told = pickle.loads(answer)
        if isinstance(told, Exception):
            raise told
        self.begun_s: float = told

    def send(self, *message: object) -> None:
        """Tell it something; nothing where it has ended."""
        with contextlib.suppress(OSError):
            self.control.send(pickle.dumps(message))

    def end(self) -> Exception | None:
        """Have it give the port back, and end; returns what went wrong with that."""
        told = b""
        self.send("close")
        with contextlib.suppress(OSError):
            self.control.settimeout(END_S)
            told = self.control.recv(LONGEST_MESSAGE)
        self.control.close()
        try:
            self.process.wait(END_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        os.close(self.wake)
        found: Exception | None = pickle.loads(told) if told else None
        return found

    def disown(self) -> None:
        """In a child of this process: it is the parent's."""
        self.control.close()
        os.close(self.wake)
        self.process.returncode = 0


class RemoteHistory(UnitHistory):
    """A history that first takes the sweeps that have come."""

    def __init__(self, facts: UnitFacts, clock_hz: int, take: Callable[[], None]):
        super().__init__(facts, clock_hz)
        self._take = take

    def at(self, time_us: int) -> UnitSamples | None:
        self._take()
        return super().at(time_us)

    def take(self, time_us: int, last: Sweep, count: int, lows: list[int], highs: list[int]) -> None:
        """A sweep of that time, and how many there are with it; earlier ones may be lost."""
        self.add(last, time_us)
        self.count, self.lows, self.highs = count, lows, highs


class RemoteLines:
    """What a board said of its lines."""

    def __init__(self, said: RemoteConversation):
        self._said = said

    @property
    def told(self) -> Faults | None:
        return self._said.facts.told


class RemoteUnits:
    """What a board said of its pressure units."""

    def __init__(self, said: RemoteConversation):
        self._said = said

    @property
    def history(self) -> UnitHistory | None:
        said = self._said
        found = said.histories().get(said.facts.history)
        said.take_sweeps()
        return found


class RemoteConversation:
    """What is known of the conversation that the other process has with the board."""

    def __init__(self, shared: Shared):
        self._shared = shared
        self._facts, self._version = Facts(), -1
        self._stats, self._stats_version = Stats(), -1
        self._net: tuple[int, ...] | None = None
        self._histories: dict[int, RemoteHistory] = {}
        self._lock, self._facts_lock = threading.Lock(), threading.Lock()
        self._sweeps = Cursor(shared.ring, self)
        self.places: weakref.WeakKeyDictionary[Zones, int] = weakref.WeakKeyDictionary()
        """Where frames that were asked for begin in the ring."""
        self.lines, self.units = RemoteLines(self), RemoteUnits(self)

    @property
    def facts(self) -> Facts:
        """What changes seldom."""
        version = self._shared.facts.version
        if version != self._version:
            with self._facts_lock:
                logged, facts = self._facts.logged, pickle.loads(self._shared.facts.read())
                self._facts, self._version = facts, version
            new = min(facts.logged - logged, len(facts.lines))
            for level, line in facts.lines[len(facts.lines) - max(new, 0) :]:
                LOG.log(level, "%s", line)
        return self._facts

    @property
    def hello(self) -> Hello | None:
        return self.facts.hello

    @property
    def numbers(self) -> frozenset[int]:
        return self.facts.numbers

    @property
    def stats(self) -> Stats:
        """The counters; always the same object."""
        slot, stats = self._shared.stats, self._stats
        marks = self._shared.ring.marks()
        if (version := slot.version) != self._stats_version:
            values, damaged, self._net = marshal.loads(slot.read())
            vars(stats).update(zip(COUNTED, values, strict=True))
            stats.damaged = Counter(damaged)
            self._stats_version = version
        stats.frames, stats.bytes = marks.frames, marks.bytes
        return stats

    @property
    def net(self) -> NetCounters | None:
        """Counters of the network."""
        self.stats  # noqa: B018
        return None if self._net is None else NetCounters(*self._net)

    def sheets(self) -> dict[int, Sheet]:
        """By the numbers in frames."""
        return self.facts.sheets

    def histories(self) -> Mapping[int, RemoteHistory]:
        """By the numbers in frames."""
        for number, (units, clock_hz) in self.facts.histories.items():
            if number not in self._histories:
                self._histories[number] = RemoteHistory(units, clock_hz, self.take_sweeps)
        return self._histories

    def place_of(self, zones: Zones) -> int:
        return self.places.get(zones, -1)

    def take_sweeps(self) -> None:
        """Put all sweeps that have come into their histories."""
        ring = self._shared.ring
        with self._lock:
            marks = ring.marks()
            while (found := self._sweeps.message(marks)) is not None:
                if found.kind == SWEEP and (body := ring.body(self._sweeps.place)) is not None:
                    number, time_us, last, *known = marshal.loads(body)
                    if (history := self.histories().get(number)) is not None:
                        history.take(time_us, Sweep(*last), *known)
                self._sweeps.skip(found)


class _Waiter:
    """A call that waits for the frame which answers its ticket."""

    def __init__(self, shared: Shared, said: RemoteConversation):
        self.ticket = 0
        self._ring, self._said = shared.ring, said
        self._cursor = Cursor(shared.ring, said)

    def look(self) -> Zones | ContactFPGAError | None:
        """What has been found by now."""
        marks = self._ring.marks()
        cursor = self._cursor
        while (found := cursor.message(marks)) is not None:
            place = cursor.place
            wanted = found.kind == ERROR or (found.kind == FRAME and found.answers >= self.ticket)
            body = self._ring.body(place) if wanted else None
            if wanted and body is None:
                continue
            cursor.skip(found)
            if body is None:
                continue
            if found.kind == FRAME:
                zones, _ = unpack_frame(body, self._said.sheets(), self._said.histories())
                self._said.places[zones] = place
                return zones
            error, unreadable = unpack_error(body)
            if unreadable:
                return error
        return None


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

    def _asked(self, what: str, until: float, *numbers: int) -> _Waiter:
        """Ask the other process, which counts tickets as they are counted here."""
        waiter = _Waiter(self._shared, self.conversation)
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
