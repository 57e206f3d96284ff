"""Serial: the level of the line for the bytes sent, and when a byte that comes in is received."""

from __future__ import annotations

import itertools
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


def received(requests: Iterable[int], bit_clocks: int) -> list[int]:
    """Cycle at which each byte is received whose start bit begins at the pin at the cycle given."""
    starts = list(requests)
    if any(late - early < 10 * bit_clocks for early, late in itertools.pairwise(starts)):
        raise ValueError(f"requests must be at least one byte, {10 * bit_clocks} clocks, apart")
    return [start + 2 + bit_clocks // 2 + 9 * bit_clocks for start in starts]
