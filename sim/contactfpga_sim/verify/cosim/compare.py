"""Lockstep comparison of gateware and golden model."""

from __future__ import annotations

from typing import Any

from contactfpga.errors import ContactFPGAError
from contactfpga_sim.model.golden.trace import BOUNDARIES, Trace

Event = tuple[Any, ...]


class Mismatch(ContactFPGAError, AssertionError):
    """The first difference between two traces.

    ``expected`` and ``got``: payloads at ``boundary`` in ``cycle``; None without one.
    """

    def __init__(self, boundary: str, expected: Event | None, got: Event | None):
        self.boundary = boundary
        self.cycle: int = min(event[0] for event in (expected, got) if event is not None)
        self.expected = self._now(expected)
        self.got = self._now(got)
        super().__init__(
            f"gateware and golden model differ: first difference at cycle {self.cycle}, boundary {boundary!r}: "
            f"expected {self._tell(expected)}, got {self._tell(got)}"
        )

    def _now(self, event: Event | None) -> Event | None:
        return event[1:] if event is not None and event[0] == self.cycle else None

    def _tell(self, event: Event | None) -> str:
        if event is None:
            return "nothing"
        described = describe(self.boundary, event)
        return described if event[0] == self.cycle else f"nothing (next is {described} at cycle {event[0]})"


def compare(expected: Trace, got: Trace) -> int:
    """Number of agreeing events over the common cycles of two traces, which exposes an empty comparison.

    Raises :class:`Mismatch` for the first difference, at the earliest boundary in data order.
    """
    cycles = min(expected.cycles, got.cycles)
    expected, got = expected.until(cycles), got.until(cycles)
    found = [found for name in BOUNDARIES if (found := _first(name, expected.events(name), got.events(name)))]
    if found:
        raise min(found, key=lambda mismatch: mismatch.cycle)
    return sum(len(expected.events(name)) for name in BOUNDARIES)


def _first(boundary: str, expected: list[Event], got: list[Event]) -> Mismatch | None:
    for index in range(max(len(expected), len(got))):
        want = expected[index] if index < len(expected) else None
        have = got[index] if index < len(got) else None
        if want != have:
            return Mismatch(boundary, want, have)
    return None


def describe(boundary: str, event: Event) -> str:
    """Payload of an event in words."""
    match boundary:
        case "rows":
            return f"row {event[1]:#b}" + (" (last)" if event[2] else "")
        case "records" | "items":
            return f"{'end mark' if event[2] else boundary[:-1]} {event[1]:#x}"
        case "bytes":
            return f"byte {event[1]:#04x}"
        case _:
            return f"level {event[1]}"
