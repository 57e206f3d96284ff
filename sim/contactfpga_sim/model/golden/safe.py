"""What several levels make of the pin ``contact``; whether a fault is known; and ``alive``."""

from __future__ import annotations

import bisect
from collections.abc import Iterable, Sequence

from contactfpga_sim.model.golden.facts import Facts
from contactfpga_sim.model.golden.scan import Changes, Scan

TICK_US = 1000


def fault(scanned: Iterable[Scan], told: Changes) -> Changes:
    """(cycle, level) of every change of whether the board knows of a fault: by a frame's tag, or by what is told of
    lines."""
    marks = [(one.told, 0, one.fault) for one in scanned] + [(cycle, 1, word > 0) for cycle, word in told]
    by_tag = by_lines = False
    levels = []
    for cycle, of_lines, level in sorted(marks):
        by_tag, by_lines = (by_tag, level) if of_lines else (level, by_lines)
        levels.append((cycle, int(by_tag or by_lines)))
    return _changes(levels)


def either(one: Changes, other: Changes) -> Changes:
    """Of a level that is high while one of two is."""
    cycles = sorted({cycle for cycle, _ in (*one, *other)})
    return _changes((cycle, _level(one, cycle) | _level(other, cycle)) for cycle in cycles)


def later(level: Changes) -> Changes:
    """The same from a register."""
    return [(cycle + 1, high) for cycle, high in level]


def alive(facts: Facts, well: Sequence[int], faulty: Changes, cycles: int) -> Changes:
    """Of the alive pin, for the rising cycles in which the sheet was ``well``."""
    period, level, changes = TICK_US * facts.clocks_per_us, 0, []
    for tick in range(period - 1, cycles, period):
        last = bisect.bisect_left(well, tick) - 1  # the last time before the tick, as a later one is after more faults
        seen = well[last] if last >= 0 else -1
        if seen >= max(0, tick - period) and not _level(faulty, seen) and not _rises(faulty, seen, tick - 1):
            level ^= 1
            changes.append((tick + 1, level))
    return changes


def _level(changes: Changes, cycle: int) -> int:
    index = bisect.bisect_right(changes, cycle, key=lambda change: change[0]) - 1
    return changes[index][1] if index >= 0 else 0


def _rises(changes: Changes, begin: int, end: int) -> bool:
    return any(begin < cycle <= end and level for cycle, level in changes)


def _changes(levels: Iterable[tuple[int, int]]) -> Changes:
    """Those of (cycle, level) that differ from the one before, the last one of each cycle; low at first."""
    found: Changes = []
    for cycle, level in dict(levels).items():
        if level != (found[-1][1] if found else 0):
            found.append((cycle, level))
    return found
