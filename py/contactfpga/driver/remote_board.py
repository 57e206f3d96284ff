"""What this process knows of a board that another process speaks to, from the memory that both share."""

from __future__ import annotations

import marshal
import pickle
import threading
import weakref
from collections import Counter
from collections.abc import Callable, Mapping

from contactfpga.driver.link import LOG
from contactfpga.driver.packed import unpack_error, unpack_frame
from contactfpga.driver.reader import COUNTED, Facts, Shared
from contactfpga.driver.ringqueue import Cursor
from contactfpga.driver.shared import ERROR, FRAME, SWEEP
from contactfpga.driver.stats import NetCounters, Stats
from contactfpga.errors import ContactFPGAError
from contactfpga.skin.sheet import Sheet
from contactfpga.wire.faults import Faults
from contactfpga.wire.hello import Hello
from contactfpga.wire.units import Sweep, UnitFacts
from contactfpga.zones.units import UnitHistory, UnitSamples
from contactfpga.zones.zone import Zones


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


class Waiter:
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
