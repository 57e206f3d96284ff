"""A process that reads one port for another process: it holds the conversation with the board, and puts what comes
into memory that both share.

:mod:`contactfpga.driver.remote` starts the process and reads the memory. Requests come over a socket. The process ends
with the process that started it, however that ends.
"""

from __future__ import annotations

import contextlib
import dataclasses
import gc
import logging
import marshal
import mmap
import operator
import os
import pickle
import select
import signal
import socket
import sys
from typing import Any, NamedTuple

from contactfpga.driver.clock import Timeline
from contactfpga.driver.conversation import Arrival, Event
from contactfpga.driver.events import UnitLine
from contactfpga.driver.link import LOG, Link
from contactfpga.driver.packed import pack_error, pack_frame, pack_run
from contactfpga.driver.recording import FileTap, RecordingTransport
from contactfpga.driver.shared import ERROR, FRAME, RUN, SIDE, SWEEP, Ring, Slot
from contactfpga.driver.stats import NetCounters, Stats
from contactfpga.driver.transport import Transport, connect
from contactfpga.errors import ContactFPGAError
from contactfpga.skin import Skin
from contactfpga.skin.sheet import Sheet
from contactfpga.wire.command import Command
from contactfpga.wire.faults import Faults
from contactfpga.wire.hello import Hello
from contactfpga.wire.units import UnitFacts
from contactfpga.zones.run import Run
from contactfpga.zones.units import UnitHistory, UnitSamples

RING_BYTES = 4 << 20
"""Size of the ring, enough for 16,384 waiting frames with a few zones each."""
_STATS_BYTES, _FACTS_BYTES = 4096, 128 << 10
_RING_AT = _STATS_BYTES + _FACTS_BYTES
MEMORY_BYTES = _RING_AT + Ring.HEAD + RING_BYTES

MOST_SHEETS = 64
"""Sheets and histories of which frames can still be taken, the newest."""

WITH_EACH = ("frames", "bytes")
"""Counters that each frame changes; :class:`contactfpga.driver.shared.Marks` have them."""
COUNTED = tuple(
    field.name for field in dataclasses.fields(Stats) if field.name not in ("damaged", "net", "dropped", *WITH_EACH)
)
"""The others, which the process that reads counts."""
MOST_LINES = 32
"""For the log that wait to be taken."""

SWITCH_S = 0.0005
"""How soon a request is sent while frames are decoded."""

LONGEST_MESSAGE = 1 << 16


class Shared(NamedTuple):
    """What is in the memory."""

    stats: Slot
    """What :func:`counters_in` gives."""
    facts: Slot
    """:class:`Facts`, pickled."""
    ring: Ring

    @classmethod
    def of(cls, descriptor: int) -> Shared:
        """Of the memory that a descriptor leads to."""
        memory = memoryview(mmap.mmap(descriptor, MEMORY_BYTES))
        return cls(Slot(memory[:_STATS_BYTES]), Slot(memory[_STATS_BYTES:_RING_AT]), Ring(memory[_RING_AT:]))


@dataclasses.dataclass
class Facts:
    """What changes seldom."""

    hello: Hello | None = None
    told: Faults | None = None
    readable: bool = False
    """Frames can be read, as :attr:`contactfpga.driver.conversation.Conversation.sheet`."""
    numbers: frozenset[int] = frozenset()
    sheets: dict[int, Sheet] = dataclasses.field(default_factory=dict)
    """By the numbers in frames."""
    histories: dict[int, tuple[UnitFacts, int]] = dataclasses.field(default_factory=dict)
    """Units and clock of each, by the numbers in frames."""
    history: int = 0
    """The present one; 0: the board has no units."""
    failure: BaseException | None = None
    """Why nothing can come any more."""
    logged: int = 0
    """Lines for the log since the port was opened."""
    lines: tuple[tuple[int, str], ...] = ()
    """The last of them, with their levels."""


class Lines(logging.Handler):
    """Passes what is logged about the port to the other process."""

    def __init__(self, facts: Facts):
        super().__init__(logging.INFO)
        self._facts = facts

    def emit(self, record: logging.LogRecord) -> None:
        facts = self._facts
        facts.logged += 1
        facts.lines = (*facts.lines, (record.levelno, record.getMessage()))[-MOST_LINES:]


class NotedUnits(UnitLine):
    """Sweeps of pressure units, noted for the other process."""

    def __init__(self, stats: Stats):
        super().__init__(stats)
        self.noted: list[tuple[UnitHistory, tuple[Any, ...]]] = []
        """Of each sweep its history and what :meth:`contactfpga.driver.remote.RemoteHistory.take` takes."""
        self.clock_hz = 0

    def take_hello(self, hello: Hello) -> None:
        self.clock_hz = hello.clock_hz
        super().take_hello(hello)

    def take(self, plain: bytes, timeline: Timeline) -> UnitSamples | None:
        history, samples = self.history, super().take(plain, timeline)
        if samples is not None and history is not None and history.last is not None:
            last = dataclasses.astuple(history.last)
            self.noted.append((history, (samples.time_us, last, history.count, history.lows, history.highs)))
        return samples


class ReaderLink(Link):
    """A link whose frames go to another process."""

    def __init__(self, transport: Transport, skin: Skin | None, shared: Shared, wake: int):
        super().__init__(transport, skin)
        self._shared, self._wake = shared, wake
        self._facts = Facts()
        self.log = Lines(self._facts)
        """To be added to the logger."""
        self._histories: dict[int, UnitHistory] = {}
        self._units = self.conversation.units = NotedUnits(self.conversation.stats)
        self._sheet: Sheet | None = None
        self._number = 0
        self._counted: tuple[Any, ...] = ()
        shared.ring.begin()
        self._show_facts()
        self._publish()

    def fail(self, error: BaseException) -> None:
        """Nothing can come any more; the lock is held."""
        if self._facts.failure is None:
            self._facts.failure = error
            self._show_facts()
            self._publish()

    def _take(self, data: bytes) -> None:
        super()._take(data)
        if data:
            self._publish()

    def _read_all(self) -> None:
        super()._read_all()
        with self.changed:
            if self._failure is not None:
                self.fail(self._failure)

    def _pass_on(self, event: Event | Run) -> None:
        super()._pass_on(event)
        ring = self._shared.ring
        if isinstance(event, Arrival):
            zones = event.zones
            numbers = self._number_of(zones.sheet), self._number_of_history(zones._history)
            ring.put(FRAME, pack_frame(event, *numbers), 1, event.answers)
        elif isinstance(event, Run):
            numbers = self._number_of(event.sheet), self._number_of_history(event.history)
            ring.put(RUN, pack_run(event, *numbers), len(event))
        elif isinstance(event, ContactFPGAError):
            ring.put(ERROR, pack_error(event, self.conversation.sheet is None))
        elif not isinstance(event, Hello):
            ring.put(SIDE, pickle.dumps(event))
        if ring.hidden > ring.size // 4:
            self._publish()

    def _number_of_history(self, history: UnitHistory | None) -> int:
        for number, known in reversed(self._histories.items()):
            if known is history:
                return number
        if history is None:
            return 0
        number = next(reversed(self._histories), 0) + 1
        self._histories[number] = history
        self._facts.histories[number] = history.facts, self._units.clock_hz
        for old in (self._histories, self._facts.histories):
            old.pop(number - MOST_SHEETS, None)
        self._show_facts()
        return number

    def _number_of(self, sheet: Sheet) -> int:
        if sheet is not self._sheet:
            if sheet != self._sheet:
                self._number += 1
                self._facts.sheets[self._number] = sheet
                self._facts.sheets.pop(self._number - MOST_SHEETS, None)
                self._show_facts()
            self._sheet = sheet
        return self._number

    def _show_facts(self) -> None:
        facts, said = self._facts, self.conversation
        facts.history = 0 if said.units.history is None else self._number_of_history(said.units.history)
        self._logged_lines = facts.logged
        facts.hello, facts.told, facts.readable = said.hello, said.lines.told, said.sheet is not None
        facts.numbers = frozenset(said.numbers)
        self._shared.facts.write(pickled(facts))

    def _publish(self) -> None:
        """Show all that was put into the ring, and wake who waits."""
        said, shared, facts = self.conversation, self._shared, self._facts
        for history, sweep in self._units.noted:
            shared.ring.put(SWEEP, marshal.dumps((self._number_of_history(history), *sweep)))
        self._units.noted.clear()
        if said.units.history is not self._histories.get(facts.history):
            self._show_facts()
        same = said.hello is facts.hello and said.lines.told is facts.told and facts.logged == self._logged_lines
        if not same or len(said.numbers) != len(facts.numbers):
            self._show_facts()
        counted = counters_in(said.stats, self.net)
        if counted != self._counted:
            self._counted = counted
            shared.stats.write(marshal.dumps(counted))
        shared.ring.publish(shared.facts.version, said.stats.bytes, self._last_bytes, self.last_s)
        os.eventfd_write(self._wake, 1)


def pickled(facts: Facts) -> bytes:
    """Facts as bytes, whatever the failure is."""
    try:
        return pickle.dumps(facts)
    except Exception:
        return pickle.dumps(dataclasses.replace(facts, failure=ContactFPGAError(repr(facts.failure))))


_COUNTED = operator.attrgetter(*COUNTED)


def counters_in(stats: Stats, net: NetCounters | None) -> tuple[Any, ...]:
    """Counters but those that each frame changes, as plain values that are no longer changed."""
    return _COUNTED(stats), dict(stats.damaged), None if net is None else tuple(vars(net).values())


def served(control: socket.socket, link: ReaderLink) -> None:
    """Do what comes over the socket until it says that this is all, or until who has the other end is gone."""
    owner = os.getppid()
    gone = select.poll()
    gone.register(control, select.POLLIN)
    with contextlib.ExitStack() as opened:
        with contextlib.suppress(OSError):  # gone already
            descriptor = os.pidfd_open(owner)
            opened.callback(os.close, descriptor)
            gone.register(descriptor, select.POLLIN)
        while True:
            ready = dict(gone.poll())
            if control.fileno() not in ready:
                return
            message = control.recv(LONGEST_MESSAGE)
            if not message:
                return
            what, *arguments = pickle.loads(message)
            if what == "close":
                return
            with link.changed:
                _do(link, what, arguments)
            try:
                link._send()
            except ContactFPGAError as error:
                with link.changed:
                    link.fail(error)


def _do(link: ReaderLink, what: str, arguments: list[float]) -> None:
    now, said = link.transport.clock(), link.conversation
    if what == "ask":
        said.ask(now, arguments[0])
    elif what == "command":
        until, *numbers = arguments
        said.command(Command(*map(int, numbers)), now, until)
    else:
        said.end_command()


def main(control_descriptor: int, memory_descriptor: int, wake: int) -> None:
    """What the process does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the owner's, whose end is this one's
    sys.setswitchinterval(SWITCH_S)
    control = socket.socket(fileno=control_descriptor)
    owner_pid, name, baud, skin, record = pickle.loads(control.recv(LONGEST_MESSAGE))
    try:
        transport = connect(name, baud)
        if record is not None:
            transport = RecordingTransport(transport, FileTap(record))
        link = ReaderLink(transport, skin, Shared.of(memory_descriptor), wake)
    except Exception as error:
        control.send(pickle.dumps(error))
        return
    os.close(memory_descriptor)
    LOG.setLevel(logging.INFO)
    LOG.addHandler(link.log)
    gc.freeze()
    if os.getppid() != owner_pid:
        return
    control.send(pickle.dumps(link.last_s))
    link.start()
    served(control, link)
    closed = None
    try:
        link.close()
    except Exception as error:
        closed = error
    with contextlib.suppress(OSError):
        control.send(pickle.dumps(closed))
    sys.stderr.flush()
    os._exit(0)
