"""The link: packets of every kind, and of several sheets, on one line."""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from typing import Protocol

from contactfpga_sim.model.golden.facts import Facts
from contactfpga_sim.model.golden.faults import FaultHistory, Reports, report, slot
from contactfpga_sim.model.golden.hello import DIGITS, State, hello


class Sender(Protocol):
    """A sheet's link as the line sees it."""

    def waits_from(self, cycle: int) -> int | None:
        """The cycle from which a packet waits, as known in ``cycle``; None: none."""

    def take(self, taken: int, cycle: int) -> None:
        """Send the next packet from cycle ``taken`` on."""


class SharedLine:
    """Asks one sheet per cycle, round-robin, until one sends a packet; then the next is asked.

    A sheet's thread that is ahead waits until all sheets have reached its cycle by :meth:`advance`.
    """

    def __init__(self, sheets: int):
        self.links: dict[int, Sender] = {}
        self.idle_from = 0
        """Cycle from which a packet can be taken."""
        self.uart_from = 0
        """Cycle from which a byte can be handed over."""
        self._sheets = sheets
        self._first_asked = 0
        self._reached = [-1.0] * sheets
        self._changed = threading.Condition()

    def advance(self, number: int, cycle: int) -> None:
        """Advance the line by this sheet up to and including ``cycle``."""
        with self._changed:
            self._reach(number, cycle)
            while min(self._reached) < cycle:
                self._changed.wait()

    def leave(self, number: int) -> None:
        """Stop waiting for a sheet that has ended."""
        with self._changed:
            self._reach(number, math.inf)

    def _reach(self, number: int, cycle: float) -> None:
        before, self._reached[number] = min(self._reached), cycle
        known = min(self._reached)
        if known > before or self._sheets == 1:
            self._take_to(known)
            self._changed.notify_all()

    def next_take(self, cycle: int) -> int | None:
        """Cycle of the next packet, as known in ``cycle``; None: none waits."""
        waiting = self._waiting(cycle)
        return waiting[0] if waiting else None

    def _waiting(self, known: int) -> tuple[int, int] | None:
        """(cycle, sheet) of the next packet."""
        found = (self._first(number, known) for number in self.links)
        return min((one for one in found if one is not None), default=None)

    def _take_to(self, cycle: float) -> None:
        if cycle == math.inf:
            return
        known = int(cycle)
        while waiting := self._waiting(known):
            taken, number = waiting
            if taken > known:
                return
            self._first_asked = (number + 1) % self._sheets
            self.links[number].take(taken, known)

    def _first(self, number: int, known: int) -> tuple[int, int] | None:
        """(cycle, sheet) of this sheet's next packet, if no other's is earlier."""
        wait = self.links[number].waits_from(known)
        if wait is None:
            return None
        cycle = max(self.idle_from, wait)
        asked = self._first_asked + cycle - self.idle_from
        return cycle + (number - asked) % self._sheets, number


class Link:
    """Order of packets on the wire. Time only advances.

    ``faults``: the scan's fault words, known up to the cycle of each :meth:`advance`, at the end of :meth:`finish`.
    ``units``: (cycle from which it waits, packet) of each sweep, replaced by the next. ``line``: shared with other
    links; by default its own.
    """

    def __init__(
        self,
        facts: Facts,
        state: State,
        faults: FaultHistory | None = None,
        units: Sequence[tuple[int, bytes]] = (),
        line: SharedLine | None = None,
    ):
        self.bytes: list[tuple[int, int]] = []
        """(cycle, value) of every byte handed to the UART."""
        self.sent = 0
        self._facts = facts
        self._state = state
        self._byte_clocks = 10 * facts.bit_clocks
        self._hellos: list[int] = []
        self._blank: list[tuple[int, int, int]] = []
        """Hellos without their state: position in ``bytes``, cycle taken, frames sent by then."""
        self._frame: tuple[int, bytes] | None = None
        self._reports = Reports(facts, faults or FaultHistory()) if facts.fault_bits else None
        self._reported: list[int] = []
        self._after_report = -1
        self._slot: tuple[int, bytes] | None = None
        self._slot_over: int | None = None
        self._units = units
        self._swept = 0
        self._frames_since = 0
        self._ended: int | None = None
        """Cycle in which a second delimiter is sent if nothing waits."""
        self._line = line or SharedLine(1)
        self._number = 0 if facts.place is None else facts.place[0]
        self._line.links[self._number] = self

    def want_hello(self, cycle: int) -> None:
        """A hello waits from ``cycle`` on, and answers all requests until it is taken."""
        self._hellos.append(cycle)

    def offer(self, cycle: int, packet: bytes) -> None:
        """A complete frame waits from ``cycle`` on."""
        assert self._frame is None, "a waiting frame must be dropped first"
        self._frame = (cycle, packet)

    def drop(self) -> bool:
        """Drop the waiting frame; returns whether there was one."""
        waited = self._frame is not None
        self._frame = None
        return waited

    def offer_slot(self, cycle: int, number: int, rows: int, columns: int) -> None:
        """A slot of the self-test waits from ``cycle`` on."""
        assert self._slot is None, "one slot at a time"
        self._slot = (cycle, slot(self._facts, number, rows, columns))
        self._slot_over = None

    def slot_over(self, cycle: int) -> int | None:
        """Cycle in which the whole slot was taken, if not after ``cycle``. The wire advances no farther, because the
        next slot may be offered before ``cycle``."""
        while self._slot and (taken := self._line.next_take(cycle)) is not None and taken <= cycle:
            self.advance(taken)
        return self._slot_over if self._slot_over is not None and self._slot_over <= cycle else None

    def advance(self, cycle: int) -> None:
        """Advance the wire up to and including ``cycle``."""
        self._line.advance(self._number, cycle)

    def waits_from(self, cycle: int) -> int | None:
        return min((at for at in (self._ended, self._waits_from(cycle)) if at is not None), default=None)

    def _waits_from(self, cycle: int) -> int | None:
        due = self._due(cycle)
        frame_from = [self._frame[0]] if self._frame else []
        slot_from = [self._slot[0]] if self._slot else []
        swept = [self._units[self._swept][0]] if self._swept < len(self._units) else []
        return min((*self._hellos, *frame_from, *slot_from, *([] if due is None else [due]), *swept), default=None)

    def take(self, taken: int, cycle: int) -> None:
        due, wait = self._due(cycle), self._waits_from(cycle)
        after_report = taken if self._facts.place is not None and self._after_report >= 0 else self._after_report
        frame_is_next = taken == after_report and self._frame is not None and self._frame[0] <= taken
        self._after_report = -1
        if wait is None or wait > taken:
            self._send(taken, b"\0")
            self._ended = None
        elif self._hellos and min(self._hellos) <= taken:
            self._hellos = [wait for wait in self._hellos if wait > taken]
            self._send_hello(taken)
        elif due is not None and due <= taken and not frame_is_next:
            self._send_report(taken)
        elif self._slot and self._slot[0] <= taken and not frame_is_next:
            self._send_slot(taken, self._slot[1])
        elif not self._frame or self._frame[0] > taken or self._sweep_is_next(taken):
            self._send_sweep(taken)
        else:
            self._frames_since += 1
            packet = self._frame[1]
            self._frame = None
            self.sent += 1
            self._send(taken, packet)

    def _due(self, cycle: int) -> int | None:
        return self._reports.due(cycle) if self._reports and self._line.idle_from <= cycle else None

    def finish(self, cycle: int) -> None:
        """Advance the wire up to ``cycle``, and fill in the hellos' state."""
        self.advance(cycle)
        for begin, taken, sent in self._blank:
            self._fill_in(begin, taken, sent)
        for begin in self._reported:
            assert self._reports is not None
            handed = [cycle for cycle, _ in self.bytes[begin : begin + len(report(self._facts))]]
            self.bytes[begin : begin + len(handed)] = list(zip(handed, self._reports.packet(handed), strict=True))

    def _send_report(self, taken: int) -> None:
        assert self._reports is not None
        begin = len(self.bytes)
        self._reported.append(begin)
        self._send(taken, report(self._facts))
        self._after_report = self._line.idle_from
        self._reports.send([cycle for cycle, _ in self.bytes[begin:]], self._line.idle_from)

    def _sweep_is_next(self, cycle: int) -> bool:
        waits = self._swept < len(self._units) and self._units[self._swept][0] <= cycle
        return waits and self._frames_since >= 4

    def _send_sweep(self, taken: int) -> None:
        self._frames_since = 0
        while self._swept < len(self._units) and self._units[self._swept][0] <= taken:
            packet = self._units[self._swept][1]
            self._swept += 1
        self._send(taken, packet)

    def _send_slot(self, taken: int, packet: bytes) -> None:
        """Send a slot, which is over in the cycle after the handover of the last byte before its check."""
        assert self._reports is not None
        begin, self._slot = len(self.bytes), None
        self._send(taken, packet)
        self._slot_over = self.bytes[begin + len(packet) - 5][0] + 1
        self._after_report = self._line.idle_from
        self._reports.pause(self._line.idle_from)

    def _send_hello(self, taken: int) -> None:
        self._blank.append((len(self.bytes), taken, self.sent))
        if self._reports:
            self._reports.greet(taken)
        self._send(taken, hello(self._facts))

    def _fill_in(self, begin: int, taken: int, sent: int) -> None:
        before = (self.bytes[begin + place - 1][0] for place in DIGITS)
        digits = [self._state.digit(place, at + 1, sent, taken) for place, at in enumerate(before)]
        packet = hello(self._facts, digits)
        cycles = [cycle for cycle, _ in self.bytes[begin : begin + len(packet)]]
        self.bytes[begin : begin + len(packet)] = list(zip(cycles, packet, strict=True))

    def _send(self, taken: int, packet: bytes) -> None:
        cycle = max(taken + 2, self._line.uart_from)
        for value in packet:
            self.bytes.append((cycle, value))
            cycle += self._byte_clocks
        self._line.uart_from = cycle
        self._line.idle_from = cycle - self._byte_clocks + 1
        self._ended = self._line.idle_from if self._facts.rests else None
