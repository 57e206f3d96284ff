"""Fault reports, and when one is due (docs/timing.md)."""

from __future__ import annotations

import bisect
import math
from collections.abc import Sequence

from contactfpga_sim.model.golden.facts import Facts
from contactfpga_sim.model.golden.packet import Packet

KIND, SLOT = 9, 1


class FaultHistory:
    """The fault word by cycle, initially 0."""

    def __init__(self) -> None:
        self._cycles = [0]
        self._words = [0]

    def change(self, cycle: int, word: int) -> None:
        """Set the word from ``cycle`` on; cycles rise."""
        assert cycle >= self._cycles[-1], "changes come in order"
        self._cycles.append(cycle)
        self._words.append(word)

    def at(self, cycle: int) -> int:
        return self._words[bisect.bisect_right(self._cycles, cycle) - 1]

    def between(self, first: int, last: int) -> list[tuple[int, int, int]]:
        """(first, last, word) of each stretch of cycles."""
        begin = bisect.bisect_right(self._cycles, first) - 1
        ends = [*self._cycles[begin + 1 :], last + 1]
        stretches = zip(self._cycles[begin:], ends, self._words[begin:])
        return [(max(first, start), min(last, end - 1), word) for start, end, word in stretches if start <= last]


def report(facts: Facts, digits: Sequence[int] | None = None) -> bytes:
    """A report of these digits, by default without faults."""
    return _sealed(facts, _digits(0, facts.fault_bits) if digits is None else digits, 0)


def slot(facts: Facts, number: int, rows: int, columns: int) -> bytes:
    """A self-test slot that read these rows and columns, bit 0 the first."""
    lines = _digits(rows | columns << facts.rows, facts.rows + facts.columns)
    return _sealed(facts, _digits(number, 14) + lines, SLOT)


def _sealed(facts: Facts, digits: Sequence[int], flags: int) -> bytes:
    packet = Packet()
    packet.push(bytes([*(128 + digit for digit in digits), KIND << 4 | flags]))
    return packet.wire(facts.fingerprint[:2], facts.closing)


def _digits(word: int, bits: int) -> list[int]:
    return [word >> start & 127 for start in range(0, bits, 7)]


class Reports:
    """When a report is due. Each digit of a report is read in the cycle after the handover of the byte before it.
    Between reports, cycle t checks the digit at t modulo a power of two; a difference makes a report due two cycles
    later."""

    def __init__(self, facts: Facts, history: FaultHistory):
        self._facts = facts
        self._history = history
        self._places = -(-facts.fault_bits // 7)
        self._period = 1 << math.ceil(math.log2(self._places + 2))
        self._since = 0
        self._handed: Sequence[int] | None = None
        self._due: int | None = None

    def greet(self, cycle: int) -> None:
        """A hello was taken in this cycle."""
        self._due = cycle + 1 if self._due is None else min(self._due, cycle + 1)

    def due(self, cycle: int) -> int | None:
        """Cycle from which a report waits, if not after ``cycle``."""
        found = [at for at in (self._due, self._differs(cycle - 2)) if at is not None and at <= cycle]
        return min(found, default=None)

    def send(self, handed: Sequence[int], idle: int) -> None:
        """Send a report with bytes handed over in these cycles."""
        self._handed = handed
        self._due, self._since = None, idle

    def pause(self, idle: int) -> None:
        """Send another packet of this kind; nothing is compared until ``idle``."""
        self._due, self._since = None, idle

    def packet(self, handed: Sequence[int]) -> bytes:
        """The report with bytes handed over in these cycles."""
        return report(self._facts, self._sent(handed))

    def _sent(self, handed: Sequence[int] | None) -> list[int]:
        if handed is None:
            return [0] * self._places
        words = (self._history.at(cycle + 1) for cycle in handed[: self._places])
        return [word >> 7 * place & 127 for place, word in enumerate(words)]

    def _differs(self, last: int) -> int | None:
        if last < self._since:
            return None
        sent = self._sent(self._handed)
        found = []
        for begin, end, word in self._history.between(self._since, last):
            for place, digit in enumerate(_digits(word, self._facts.fault_bits), 1):
                cycle = begin + (place - begin) % self._period
                if digit != sent[place - 1] and cycle <= end:
                    found.append(cycle + 2)
        return min(found, default=None)
