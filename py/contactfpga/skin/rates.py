"""What follows from clock and baud rate alone, and so from a Skin and from a hello alike."""

from __future__ import annotations

SAMPLED_BIT_CLOCKS = 4
"""From this many clocks per bit on, a receiver can sample near the middle of each bit."""


def bit_clocks(clock_hz: int, baud: int) -> int:
    """Clocks of the gateware per bit on the wire."""
    return round(clock_hz / baud)


def pulsed(clock_hz: int, baud: int) -> bool:
    """Whether the board is sent pulses instead of bytes (docs/protocol.md): it has too few clocks per bit to sample."""
    return bit_clocks(clock_hz, baud) < SAMPLED_BIT_CLOCKS
