"""Serial line: levels for sent bytes, and reception."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterable


def line(sent: Iterable[tuple[int, int]], bit_clocks: int) -> list[tuple[int, int]]:
    """(cycle, level) of every change of the transmit pin for sent (cycle, value)."""
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
    """A received byte: cycles of its first data bit and of its stop bit."""

    value: int | None
    """None for a byte cut short."""
    first_bit: int | None
    """None without bits, like a mark among pulses."""
    stop: int


def pulsed(bit_clocks: int) -> bool:
    """Whether a board with ``bit_clocks`` per bit reads pulses instead of bytes."""
    return bit_clocks in (2, 3)


def received(sent: Iterable[tuple[int, bytes]], bit_clocks: int) -> list[Byte]:
    """Reception of (cycle, bytes), back to back at the pin from that cycle on."""
    starts = _starts(sent, bit_clocks)
    if pulsed(bit_clocks):
        return _of_pulses(starts, bit_clocks)
    found = []
    for cycle, value in starts:
        middle = cycle + 2 + bit_clocks // 2
        found.append(Byte(value, middle + bit_clocks, middle + 9 * bit_clocks))
    return found


def _starts(sent: Iterable[tuple[int, bytes]], bit_clocks: int) -> list[tuple[int, int]]:
    starts, free = [], 0
    for cycle, data in sent:
        if cycle < free:
            raise ValueError(f"bytes begin in cycle {cycle}; those before them take until {free}")
        starts += [(cycle + 10 * bit_clocks * index, value) for index, value in enumerate(data)]
        free = cycle + 10 * bit_clocks * len(data)
    return starts


def _of_pulses(starts: list[tuple[int, int]], bit_clocks: int) -> list[Byte]:
    found: list[Byte] = []
    bits: list[tuple[int, int]] = []  # (cycle, bit) of a byte so far
    for start, value in starts:
        for end, length in _lows(value):
            cycle = start + end * bit_clocks + 2
            if length in (4, 5, 6, 7):
                if bits:
                    found.append(Byte(None, bits[0][0], cycle))
                found.append(Byte(0, None, cycle + bool(bits)))
                bits = []
                continue
            bits.append((cycle, int(length < 4)))
            if len(bits) == 8:
                found.append(Byte(sum(bit << place for place, (_, bit) in enumerate(bits)), bits[0][0], cycle + 1))
                bits = []
    return [*found, Byte(None, bits[0][0], bits[-1][0])] if bits else found


def _lows(value: int) -> list[tuple[int, int]]:
    """(end, length) in bits of each low stretch of a byte, from the start bit's beginning."""
    levels = "0" + f"{value:08b}"[::-1] + "1"
    return [(match.end(), len(match[0])) for match in re.finditer("0+", levels)]
