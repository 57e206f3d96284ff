"""One port and everyone who waits for it: who reads, who is notified, how it ends."""

from __future__ import annotations

import contextlib
import logging
import math
import threading
import weakref
from collections.abc import Callable, Collection
from typing import Protocol

from contactfpga.driver import forks
from contactfpga.driver.clock import ClockFit
from contactfpga.driver.conversation import Arrival, Conversation, Event
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
from contactfpga.skin import Skin
from contactfpga.wire.command import COMMANDS, Command
from contactfpga.wire.faults import Faults
from contactfpga.wire.hello import Hello, describe
from contactfpga.zones.run import Run
from contactfpga.zones.zone import Zones

LOG = logging.getLogger("contactfpga")
"""Says which board it is and that its faults are gone (INFO), that it was restarted, how many frames were lost, and
which faults it has (WARNING). Silent unless the program sets up logging. Twice per second at most but for faults, which
it tells as they change."""
LOG.addHandler(logging.NullHandler())

READ_S = 0.05
"""How often the reader checks whether the board was closed."""

ASK_S = 1.0
"""How often :meth:`Link.ask` asks."""

SIMULATED_READ_S = 0.002
"""The most simulated time that passes in one read, for which :meth:`Link.close` may have to wait."""

Result = Zones | SideEvent | ContactFPGAError | Hello | bool
"""What is waited for."""


class _Waiter:
    """A call of :meth:`Board.read` that waits for its frame."""

    def __init__(self, ticket: int):
        self.ticket = ticket
        self.found: Zones | ContactFPGAError | None = None

    def look(self) -> Zones | ContactFPGAError | None:
        """What has been found by now."""
        return self.found


class Link:
    """A transport, what is said over it, and the threads that wait for that.

    A port's bytes are read by a thread of its own. Where time passes only while it is read (``sim://``), or all is
    there already (``replay://``), one of the threads that wait reads for all.
    """

    fit: type[ClockFit] = ClockFit
    """Fit of the board's clock to the host's."""

    def __init__(self, transport: Transport, skin: Skin | None):
        self.transport = transport
        rng = getattr(transport, "rng", None)
        self.conversation = Conversation(transport.name, skin, transport.live, rng, self.fit)
        self.changed = threading.Condition()
        """To be held while any state is looked at."""
        self._queues: weakref.WeakSet[FrameQueue] = weakref.WeakSet()
        self.last: Zones | Run | None = None
        """What came last."""
        self.last_s = transport.clock()
        """When it came."""
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
        """Begin to read, once those listen who want to hear all from the first byte on."""
        if self.transport.threaded:
            threading.Thread(target=self._read_all, name=f"reader of {self.transport.name}", daemon=True).start()

    def queue(self, maxsize: int, all_events: bool) -> FrameQueue:
        """A queue for what comes from now on, as long as it is kept; with all events first the faults that the board
        told last."""
        with self.changed:
            queue = FrameQueue(maxsize, all_events, self._frames)
            self._queues.add(queue)
            if all_events and self.conversation.lines.told:
                queue.put(self.conversation.lines.told)
        return queue

    def leave(self, queue: object) -> None:
        """Put nothing more into this queue; the lock is held."""
        self._queues.discard(queue)  # type: ignore[arg-type]

    def clock(self) -> float:
        """Seconds on the clock that timeouts run on."""
        self.check_open()
        return self.transport.clock()

    def read(self, timeout: float) -> Result:
        """Ask the board; the first frame scanned after now, or the error that came in its place."""
        deadline = self.clock() + timeout
        with self.changed:
            self.check_open()
            waiter = _Waiter(self.conversation.ask(self.transport.clock(), deadline))
            self._waiters.append(waiter)
        try:
            self._send()
            return self.wait_for(waiter.look, deadline, timeout)
        finally:
            with self.changed:
                self._waiters.remove(waiter)

    def ask(self) -> None:
        """Ask the board, at most once per second; nobody waits for the answer, which says how late frames are."""
        with self.changed:
            now = self.transport.clock()
            if now < self._asked_s + ASK_S:
                return
            self._asked_s = now
            self.conversation.ask(now, now)
        self._send()

    def command(self, command: Command, timeout: float) -> Result:
        """Have the board do something; the first frame scanned after it took the command, or the error that came in
        its place. Raises :class:`NoSuchCommand`."""
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
        """How long no frame has come, where someone waits since that moment; the lock is held."""
        last = self.last[len(self.last) - 1] if isinstance(self.last, Run) else self.last
        seconds = self.transport.clock() - max(since, self.last_s)
        return Silence(self.transport.name, seconds, self.conversation.stats.bytes - self._last_bytes, last)

    def abandon(self) -> None:
        """Have the reader give the port back: nobody can wait for anything any more. Takes no lock."""
        self._closing = True

    def close(self) -> None:
        """Give the port back; may be called twice."""
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
        """Whether a thread is in the transport; the lock is held."""
        return self._reading is not None or self._writing is not None

    def _leave(self) -> None:
        """What a thread does that was in the transport, with the lock held: the last one of a board that was closed
        gives the port back, unless :meth:`close` waits to do so and to tell its caller what fails."""
        if self._closing:
            self.changed.notify_all()
            if not self._in_use() and not self._closers:
                self.transport.close()

    def forked(self) -> None:
        """In a child process the port is closed, and stays open in its parent."""
        self.changed, self._commanding = threading.Condition(), threading.Lock()
        self._reading = self._writing = None
        self._closing = self._inherited = True

    def check_open(self) -> None:
        if self._inherited:
            raise BoardClosed(f"{self.transport.name} {forks.ELSEWHERE}")
        if self._closing:
            raise BoardClosed(f"{self.transport.name} was closed; open it again")

    def wait_for(self, found: Callable[[], Result | None], deadline: float, timeout: float) -> Result:
        """What ``found`` returns as soon as it is not None; raises :class:`ReadTimeout` at the deadline."""
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
                    raise timed_out(self.transport.name, timeout, self.conversation, start, self.net)
                if self.transport.threaded or self._reading is not None:
                    self.changed.wait(min(left, 1.0) if self.transport.threaded else READ_S)
                else:
                    self._read_once(min(left, SIMULATED_READ_S))

    def linger(self, until: float, seconds: float) -> None:
        """Receive until the moment ``until``, for at most ``seconds``. Raises as :meth:`wait_for`, except
        :class:`ReadTimeout` and :class:`PortLost`, which the next call raises."""
        with contextlib.suppress(ReadTimeout, PortLost):
            self.wait_for(lambda: None, until, seconds)

    def _read_once(self, seconds: float) -> int:
        """Read once, with the lock held, which is released meanwhile; returns the number of bytes."""
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
        """The network's counters, or None for a port without a network."""
        return counters_of(self.transport)

    def _denied(self) -> int:
        return 0 if self.net is None else self.net.denied

    def _take(self, data: bytes) -> None:
        for event in self.conversation.receive_runs(data, self.transport.clock()):
            self._pass_on(event)
        self.changed.notify_all()
        if not self.transport.threaded:
            self._send()

    def catch_up(self) -> None:
        """Take what someone else has read; where the threads that wait read for themselves, there is nothing."""

    def newest(self, queue: FrameQueue, timeout: float) -> Zones | None:
        """The newest frame, none that the queue has had, and have the queue go on after it; None where the queue has to
        be looked at. Raises as :meth:`wait_for`."""
        return None

    def take_what_came(self) -> None:
        """Read the bytes that wait at a port which no thread reads."""
        if self.transport.threaded:
            return
        with self.changed:
            self.check_open()
            while self._reading is None and self._read_once(0.0):
                pass

    def _pass_on(self, event: Event | Run) -> None:
        if isinstance(event, Hello):
            self._log(event)
            return
        if isinstance(event, Faults):
            self._log_fault(f"fault: {', '.join(event.names)}" if event else "")
        item = event.zones if isinstance(event, Arrival) else event
        between = isinstance(item, SideEvent)
        for queue in self._queues:
            if queue.all_events or not between:
                queue.put(item)
        if between:
            return
        if isinstance(item, (Zones, Run)):
            self._frames += 1 if isinstance(item, Zones) else len(item)
            self.last, self.last_s, self._last_bytes = item, self.transport.clock(), self.conversation.stats.bytes
        if isinstance(event, Run):  # what it answers, the frame before it has answered
            return
        for waiter in self._waiters:
            if waiter.found is not None:
                continue
            if isinstance(event, Arrival):
                waiter.found = event.zones if event.answers >= waiter.ticket else None
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
        """Write what has to be sent, in the order in which the conversation made it: one thread writes at a time, and
        what others ask meanwhile it writes next. A caller that holds the lock keeps it; else others go on."""
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
        """What the reader thread does, until the board is closed or the port is lost."""
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


def check_command(name: str, hello: Hello | None, command: Command) -> None:
    """Raises :class:`NoSuchCommand` where a board with this hello does not take the command."""
    if hello is None or command.what in hello.commands:
        return
    known = COMMANDS.get(command.what)
    step = f"build its Skin with {known[1]}" if known else f"it takes {sorted(hello.commands) or 'none'}"
    raise NoSuchCommand(f"{name}: this board takes no {command}; {step}")


def denied_error(name: str) -> NoSuchCommand:
    """The error of a command that a publisher did not pass on."""
    step = "start it with `contactfpga publish --allow-commands` if it shall"
    return NoSuchCommand(f"{name}: its publisher passes on no commands; {step}")


class Said(Protocol):
    """What of a conversation tells why no frame came."""

    @property
    def stats(self) -> Stats:
        """Counters of the packets that came."""

    @property
    def numbers(self) -> Collection[int]:
        """Numbers of the sheets whose packets came before any hello."""


def timed_out(name: str, timeout: float, said: Said, start: int, net: NetCounters | None) -> ReadTimeout:
    """The error of a port on which no frame came within ``timeout`` seconds; ``start``: bytes that had come before.
    ``net``: what is counted about the network; None: there is none."""
    stats = said.stats
    head = f"{name}: no frame within {timeout:g} s"
    if net is not None:
        head += refused(net)
    if stats.bytes == start:
        return BoardSilent(
            f"{head}, not one byte came; is the board powered and its bitstream loaded, is this its port? "
            f"`contactfpga doctor {name}` checks"
        )
    seen = f"{stats.bytes - start} bytes came"
    if not stats.hellos and (numbers := sorted(said.numbers)):
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
