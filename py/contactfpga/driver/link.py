"""One port and all its listeners."""

from __future__ import annotations

import collections
import contextlib
import logging
import math
import threading
import weakref
from collections.abc import Callable, Collection
from typing import Protocol

from contactfpga.driver import forks
from contactfpga.driver.clock import ClockFit
from contactfpga.driver.conversation import Conversation, Event
from contactfpga.driver.events import SideEvent, Silence
from contactfpga.driver.framequeue import FrameQueue
from contactfpga.driver.stats import NetCounters, Stats, refused
from contactfpga.driver.transport import Transport, counters_of
from contactfpga.errors import (
    BoardClosed,
    BoardSilent,
    ContactFPGAError,
    NoSuchCommand,
    OnlyNoise,
    PortLost,
    ReadTimeout,
)
from contactfpga.inputs.values import shell_words
from contactfpga.skin import Skin
from contactfpga.wire.command import COMMANDS, Command
from contactfpga.wire.faults import Faults
from contactfpga.wire.hello import Hello, describe
from contactfpga.zones.run import Run
from contactfpga.zones.zone import Zones

LOG = logging.getLogger("contactfpga")
"""Logger of the board's identity and the end of its faults (INFO), and of restarts, lost frames and faults (WARNING),
at most twice per second except for faults. Silent unless the program configures logging.
"""
LOG.addHandler(logging.NullHandler())

READ_S = 0.05

ASK_S = 1.0

SIMULATED_READ_S = 0.002
"""Longest simulated time of one read, which may delay :meth:`Link.close`."""

Result = Zones | SideEvent | ContactFPGAError | Hello | bool


class _Waiter:
    def __init__(self, ticket: int):
        self.ticket = ticket
        self.found: Zones | ContactFPGAError | None = None
        self.number = 0
        """Number of the found frame on this link, from 1."""

    def look(self) -> Zones | ContactFPGAError | None:
        return self.found


class Link:
    """A transport, its conversation, and the threads that wait for results.

    A separate thread reads a live port. If time passes only during reads (``sim://``), or all bytes exist already
    (``replay://``), one of the waiting threads reads for all.
    """

    fit: type[ClockFit] = ClockFit

    def __init__(self, transport: Transport, skin: Skin | None):
        self.transport = transport
        rng = getattr(transport, "rng", None)
        self.conversation = Conversation(transport.name, skin, transport.live, rng, self.fit)
        self.changed = threading.Condition()
        """Lock of the whole state, notified on changes."""
        self._queues: weakref.WeakSet[FrameQueue] = weakref.WeakSet()
        self.last: Run | None = None
        self.last_s = transport.clock()
        self._frames = 0  # that came
        self._last_bytes = 0  # that had come by then
        self._asked_s = -math.inf  # by :meth:`ask`
        self._commanding = threading.Lock()
        self._waiters: list[_Waiter] = []
        self._failure: BaseException | None = None
        self._closing = False
        self._reading: int | None = None  # the thread that reads
        self._writing: int | None = None  # the thread that writes
        self._closers = 0  # threads that wait in :meth:`close`
        self._logged: tuple[int, int, int] | None = None  # restarts, lost frames, stuck columns; None: no hello yet
        self._inherited = False
        forks.watch(self)

    def start(self) -> None:
        """Begin to read, after registration of listeners that need the first byte."""
        if self.transport.threaded:
            threading.Thread(target=self._read_all, name=f"reader of {self.transport.name}", daemon=True).start()

    def queue(self, maxsize: int, all_events: bool) -> FrameQueue:
        """A queue for items from now on, while it is referenced; with all events, first the last reported faults."""
        with self.changed:
            queue = FrameQueue(maxsize, all_events, self._frames)
            self._queues.add(queue)
            if all_events and self.conversation.lines.reported:
                queue.put(self.conversation.lines.reported)
        return queue

    def leave(self, queue: object) -> None:
        """Put nothing more into this queue; the caller holds the lock."""
        self._queues.discard(queue)  # type: ignore[arg-type]

    def clock(self) -> float:
        self.check_open()
        return self.transport.clock()

    def read(self, timeout: float) -> tuple[Zones, int]:
        """Request a frame; returns the first one scanned after now, and its number on this link. Raises what came in
        its place.
        """
        deadline = self.clock() + timeout
        with self.changed:
            self.check_open()
            waiter = _Waiter(self.conversation.ask(self.transport.clock(), deadline))
            self._waiters.append(waiter)
        try:
            self._send()
            return frame_of(self.wait_for(waiter.look, deadline, timeout)), waiter.number
        finally:
            with self.changed:
                self._waiters.remove(waiter)

    def ask(self) -> None:
        """Send a request, at most once per second, whose answer bounds the frames' latency."""
        with self.changed:
            now = self.transport.clock()
            if now < self._asked_s + ASK_S:
                return
            self._asked_s = now
            self.conversation.ask(now, now)
        self._send()

    def command(self, command: Command, timeout: float) -> Result:
        """Send a command; returns the first frame scanned after the board took it, or an error. Raises
        :class:`NoSuchCommand`.
        """
        deadline, denied = self.clock() + timeout, self._denied()
        if not self._commanding.acquire(timeout=timeout):
            raise ReadTimeout(f"{self.transport.name}: another command was not answered within {timeout:g} s")
        try:
            with self.changed:
                self.check_open()
                name = self.transport.name
                if not self.transport.live:
                    raise NoSuchCommand(f"{name} is a recording, which takes no {command}; open the board's port")
                check_command(name, self.conversation.hello, command)
                waiter = _Waiter(self.conversation.command(command, self.transport.clock(), deadline))
                self._waiters.append(waiter)
            try:
                self._send()
                return self.wait_for(waiter.look, deadline, timeout)
            except ReadTimeout:
                if self._denied() == denied:
                    raise
                raise denied_error(self.transport.name) from None
            finally:
                with self.changed:
                    self._waiters.remove(waiter)
                    self.conversation.end_command()
        finally:
            self._commanding.release()

    def silence(self, since: float) -> Silence:
        """Time without a frame, for a listener since that moment; the caller holds the lock."""
        last = None if self.last is None else self.last[len(self.last) - 1]
        seconds = self.transport.clock() - max(since, self.last_s)
        return Silence(self.transport.name, seconds, self.conversation.stats.bytes - self._last_bytes, last)

    def abandon(self) -> None:
        """Make the reader close a port without possible listeners. Takes no lock."""
        self._closing = True
        DROPPED.append(weakref.ref(self))

    def close(self) -> None:
        """Close the port; may be called twice."""
        with self.changed:
            self._closing = True
            self.changed.notify_all()
            if self._inherited:
                return
            if threading.get_ident() in (self._reading, self._writing):  # a scene's callback closes
                return  # what it was called by does the rest
            self._closers += 1
            try:
                while self._in_use():
                    self.changed.wait(1.0)
            finally:
                self._closers -= 1
            self.transport.close()

    def _in_use(self) -> bool:
        return self._reading is not None or self._writing is not None

    def _leave(self) -> None:
        """Leave the transport, with the lock held. The last thread of a closed board closes the port, unless
        :meth:`close` waits to do so.
        """
        if self._closing:
            self.changed.notify_all()
            if not self._in_use() and not self._closers:
                self.transport.close()

    def forked(self) -> None:
        """Close the port in a child process; it stays open in the parent."""
        self.changed, self._commanding = threading.Condition(), threading.Lock()
        self._reading = self._writing = None
        self._closing = self._inherited = True

    def check_open(self) -> None:
        if self._inherited:
            raise BoardClosed(f"{self.transport.name} {forks.ELSEWHERE}")
        if self._closing:
            raise BoardClosed(f"{self.transport.name} was closed; open it again")

    def wait_for(self, found: Callable[[], Result | None], deadline: float, timeout: float) -> Result:
        """The first result of ``found`` that is not None; raises :class:`ReadTimeout` at the deadline."""
        start = self.conversation.stats.bytes
        with self.changed:
            while True:
                self.check_open()
                if (result := found()) is not None:
                    return result
                if self._reading == threading.get_ident():
                    step = "a scene is called while its board is read, so read the board elsewhere"
                    raise ContactFPGAError(f"{self.transport.name}: its own scene would wait for it for ever; {step}")
                if self._failure is not None:
                    raise self._failure.with_traceback(None)
                left = deadline - self.transport.clock()
                if left <= 0:
                    if explain := getattr(self.transport, "no_frame", None):  # its hellos are not the sheet's
                        raise explain(timeout)
                    raise timed_out(self.transport.name, timeout, self.conversation, start, self.net)
                if self.transport.threaded or self._reading is not None:
                    self.changed.wait(min(left, 1.0) if self.transport.threaded else READ_S)
                else:
                    self._read_once(min(left, SIMULATED_READ_S))

    def linger(self, until: float, seconds: float) -> None:
        """Receive until the moment ``until``, for at most ``seconds``. :class:`ReadTimeout` and :class:`PortLost` are
        left to the next call.
        """
        with contextlib.suppress(ReadTimeout, PortLost):
            self.wait_for(lambda: None, until, seconds)

    def _read_once(self, seconds: float) -> int:
        self._reading = threading.get_ident()
        breaks = self._breaks()
        self.changed.release()
        try:
            data = self.transport.read(seconds)
        finally:
            self.changed.acquire()
            self._reading = None
            self.changed.notify_all()
            self._leave()
        self.check_open()
        if self._breaks() != breaks:
            self.conversation.doubt(self.transport.clock())
        self._take(data)
        return len(data)

    def _breaks(self) -> int:
        return 0 if self.net is None else self.net.passed_breaks

    @property
    def net(self) -> NetCounters | None:
        return counters_of(self.transport)

    def _denied(self) -> int:
        return 0 if self.net is None else self.net.denied

    def _take(self, data: bytes) -> None:
        for event in self.conversation.receive(data, self.transport.clock()):
            self._pass_on(event)
        self.changed.notify_all()
        if not self.transport.threaded:
            self._send()

    def catch_up(self) -> None:
        """Take bytes that another thread has read, if any does."""

    def newest(self, queue: FrameQueue, timeout: float) -> Zones | None:
        """The newest frame that the queue has not had, after which the queue continues; None if the queue decides.
        Raises the errors of :meth:`wait_for`.
        """
        return None

    def take_what_came(self) -> None:
        """Read the waiting bytes of a port that no thread reads."""
        if self.transport.threaded:
            return
        with self.changed:
            self.check_open()
            while self._reading is None and self._read_once(0.0):
                pass

    def _pass_on(self, event: Event) -> None:
        if isinstance(event, Hello):
            self._log(event)
            return
        if isinstance(event, Faults):
            self._log_fault(f"fault: {', '.join(event.names)}" if event else "")
        between = isinstance(event, SideEvent)
        for queue in self._queues:
            if queue.all_events or not between:
                queue.put(event)
        if between:
            return
        if isinstance(event, Run):
            self._frames += len(event)
            self.last, self.last_s, self._last_bytes = event, self.transport.clock(), self.conversation.stats.bytes
        for waiter in self._waiters:
            if waiter.found is not None:
                continue
            if isinstance(event, Run):
                if event.answers >= waiter.ticket:
                    waiter.found, waiter.number = event[0], self._frames - len(event) + 1
            elif isinstance(event, ContactFPGAError) and self.conversation.sheet is None:
                # Another Skin that can be read is no trouble for a new frame.
                waiter.found = event

    def _log(self, hello: Hello) -> None:
        name, stats = self.transport.name, self.conversation.stats
        if self._logged is None:
            LOG.info("%s: the board has %s", name, describe(hello))
        restarts, lost, stuck = self._logged or (0, 0, 0)
        if stats.restarts > restarts:
            LOG.warning("%s: the board was restarted", name)
        if stats.lost > lost:
            LOG.warning("%s: %d frames were lost, %d since the port was opened", name, stats.lost - lost, stats.lost)
        unnamed = 0 if hello.guard else hello.stuck
        if unnamed != stuck:
            self._log_fault(f"columns that read pressed while no row was driven: {unnamed}" if unnamed else "")
        self._logged = stats.restarts, stats.lost, unnamed

    def _log_fault(self, faults: str) -> None:
        if faults:
            LOG.warning("%s: %s", self.transport.name, faults)
        else:
            LOG.info("%s: no fault any more", self.transport.name)

    def _send(self) -> None:
        """Write the conversation's bytes in order. One thread writes for all; a caller that holds the lock keeps it."""
        with self.changed:
            while self._writing is None and not self._closing and (data := self.conversation.data_to_send()):
                self._writing = threading.get_ident()
                self.changed.release()
                try:
                    self.transport.write(data)
                finally:
                    self.changed.acquire()
                    self._writing = None
                    self._leave()
            self.check_open()

    def _read_all(self) -> None:
        while True:
            with self.changed:
                try:
                    self.check_open()
                    self._read_once(READ_S)
                except BoardClosed:
                    self._leave()
                    return
                except BaseException as error:  # whoever calls next gets it
                    self._failure = error
                    self.changed.notify_all()
                    return
            with contextlib.suppress(ContactFPGAError):  # the next read says so
                self._send()


DROPPED: collections.deque[weakref.ref[Link]] = collections.deque(maxlen=64)
"""Links whose boards were dropped without being closed; while they live, their ports may be open."""


def frame_of(found: object) -> Zones:
    """The awaited frame; raises the error that came in its place."""
    found = checked_item(found)
    assert isinstance(found, Zones)
    return found


def checked_item(found: object) -> object:
    """The awaited item; raises the error that came in its place."""
    if isinstance(found, ContactFPGAError):
        raise found
    return found


def check_command(name: str, hello: Hello | None, command: Command) -> None:
    """Raises :class:`NoSuchCommand` if a board with this hello does not take the command."""
    if hello is None or command.what in hello.commands:
        return
    known = COMMANDS.get(command.what)
    step = f"build its Skin with {known[1]}" if known else f"it takes {sorted(hello.commands) or 'none'}"
    raise NoSuchCommand(f"{name}: this board takes no {command}; {step}")


def denied_error(name: str) -> NoSuchCommand:
    """The error of a command that a publisher did not pass on."""
    step = "start it with `contactfpga publish --allow-commands` if it shall"
    return NoSuchCommand(f"{name}: its publisher passes on no commands; {step}")


class PacketFacts(Protocol):
    """Part of a conversation that explains missing frames."""

    @property
    def stats(self) -> Stats:
        """Counters of received packets."""

    @property
    def numbers(self) -> Collection[int]:
        """Sheet numbers in packets before the first hello."""


def timed_out(name: str, timeout: float, packets: PacketFacts, start: int, net: NetCounters | None) -> ReadTimeout:
    """The error of a port without a frame within ``timeout`` seconds; ``start``: earlier bytes; ``net``: the network's
    counters.
    """
    stats = packets.stats
    head = f"{name}: no frame within {timeout:g} s"
    if net is not None:
        head += refused(net)
    if stats.bytes == start:
        return BoardSilent(
            f"{head}, not one byte came; is the board powered and its bitstream loaded, is this its port? "
            f"`contactfpga doctor {shell_words(name)}` checks"
        )
    seen = f"{stats.bytes - start} bytes came"
    if not stats.hellos and (numbers := sorted(packets.numbers)):
        ports = ", ".join(f"{name}#{number}" for number in numbers)
        return OnlyNoise(f"{name}: this board serves several sheets; open one of them: {ports}")
    if not stats.frames and not stats.hellos:
        damaged = ", ".join(f"{count} {reason}" for reason, count in stats.damaged.items()) or "none whole"
        return OnlyNoise(
            f"{head}; {seen}, but no valid packet ({damaged}); is the baud rate the Skin's, "
            "and is this a contactfpga board?"
        )
    step = "send less to the board"
    if net is not None:
        step = "if there are access rules, let this program write to KEY/ask"
    return ReadTimeout(
        f"{head}; {seen}, {stats.hellos} hellos and {stats.frames} frames since the port was opened; "
        f"give it a longer timeout, or {step}"
    )
