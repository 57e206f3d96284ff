"""Answers that are no number, and input that cannot be."""

from __future__ import annotations

import dataclasses

from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.values import is_finite, shown

MAX_LENGTH_M = 1.0
"""No thickness, pitch, offset or radius of a cover on a robot is longer: who writes 5 means mm."""


SMALLEST, LARGEST = 1e-12, 1e12
"""Of what a file says in SI units, 0 aside; powers of it are still numbers."""


class CoverError(ContactFPGAError, ValueError):
    """A value that no cover can have; the message names it and the limit."""


@dataclasses.dataclass(frozen=True)
class NoSolution:
    """The question has no answer, and why."""

    reason: str

    def __str__(self) -> str:
        return f"no solution: {self.reason}"


def positive(name: str, value: float, unit: str) -> float:
    """``value`` if it is a finite number above 0; raises :class:`CoverError` otherwise."""
    if not is_finite(value) or value <= 0:
        raise CoverError(f"{name} is {shown(value)}; it must be a finite number above 0 {unit}".rstrip())
    return float(value)


def not_negative(name: str, value: float, unit: str) -> float:
    """``value`` if it is a finite number, 0 or above; raises :class:`CoverError` otherwise."""
    if not is_finite(value) or value < 0:
        raise CoverError(f"{name} is {shown(value)}; it must be a finite number, 0 {unit} or above".replace("  ", " "))
    return float(value)


def finite(name: str, value: float) -> float:
    """``value`` if it is a finite number; raises :class:`CoverError` otherwise."""
    if not is_finite(value):
        raise CoverError(f"{name} is {shown(value)}; it must be a finite number")
    return float(value)
