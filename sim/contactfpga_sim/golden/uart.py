"""Serial: the level of the line for the bytes sent, and when a byte that comes in is received."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable


def line(sent: Iterable[tuple[int, int]], bit_clocks: int) -> list[tuple[int, int]]:
    """(cycle, level) of every change of the transmit pin for bytes (cycle, value)."""
    changes = []
    level = 1
    for cycle, value in sent:
        bits = [0, *(value >> bit & 1 for bit in range(8)), 1]
        for index, bit in enumerate(bits):
            if bit != level:
                changes.append((cycle + 1 + index * bit_clocks, bit))
                level = bit
    return changes


@dataclasses.dataclass(frozen=True)
class Byte:
    """A byte that was received: when its first data bit was, and its stop bit."""

    value: int
    first_bit: int
    stop: int


def received(sent: Iterable[tuple[int, bytes]], bit_clocks: int) -> list[Byte]:
    """What is received of (cycle, bytes), each of which begin at the pin back to back in that cycle."""
    found, free = [], 0
    for cycle, data in sent:
        if cycle < free:
            raise ValueError(f"bytes begin in cycle {cycle}; those before them take until {free}")
        for value in data:
            middle = cycle + 2 + bit_clocks // 2
            found.append(Byte(value, middle + bit_clocks, middle + 9 * bit_clocks))
            cycle += 10 * bit_clocks
        free = cycle
    return found
