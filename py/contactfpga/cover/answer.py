"""Answers that are no number, and input that cannot be."""

from __future__ import annotations

import dataclasses
import math
from numbers import Real

from contactfpga.errors import ContactFPGAError


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
    if isinstance(value, bool) or not isinstance(value, Real) or not 0 < value < math.inf:
        raise CoverError(f"{name} is {value!r}; it must be a finite number above 0 {unit}".rstrip())
    return float(value)


def not_negative(name: str, value: float, unit: str) -> float:
    """``value`` if it is a finite number, 0 or above; raises :class:`CoverError` otherwise."""
    if isinstance(value, bool) or not isinstance(value, Real) or not 0 <= value < math.inf:
        raise CoverError(f"{name} is {value!r}; it must be a finite number, 0 {unit} or above".replace("  ", " "))
    return float(value)
