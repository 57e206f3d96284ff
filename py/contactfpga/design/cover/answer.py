"""Answers without a number, and invalid input."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.values import is_finite, shown

Floats = NDArray[np.float64]

MAX_LENGTH_M = 1.0
"""Upper limit of a cover's lengths on a robot; larger ones are probably in mm."""


SMALLEST, LARGEST = 1e-12, 1e12
"""Limits of nonzero SI values in a file, whose powers are finite."""


TINIEST, HUGEST = 1e-25, 1e25
"""Limits of any nonzero SI number, whose products are finite."""


class CoverError(ContactFPGAError, ValueError):
    """An impossible value of a cover."""


@dataclasses.dataclass(frozen=True)
class NoSolution:
    """The reason why a question has no answer."""

    reason: str

    def __str__(self) -> str:
        return f"no solution: {self.reason}"

    def to_dict(self) -> dict[str, str]:
        return {"no_solution": self.reason}


def positive(name: str, value: float, unit: str) -> float:
    """Check that ``value`` is finite and above 0; raises :class:`CoverError`."""
    if not is_finite(value) or value <= 0:
        raise CoverError(f"{name} is {shown(value)}; it must be a finite number above 0 {unit}".rstrip())
    if value < TINIEST:
        raise CoverError(f"{name} is {shown(value)}; it must be at least {TINIEST:g} {unit}".rstrip())
    return _below_hugest(name, value, unit)


def not_negative(name: str, value: float, unit: str) -> float:
    """Check that ``value`` is finite and at least 0; raises :class:`CoverError`."""
    if not is_finite(value) or value < 0:
        raise CoverError(f"{name} is {shown(value)}; it must be a finite number, 0 {unit} or above".replace("  ", " "))
    return _below_hugest(name, value, unit)


def finite(name: str, value: float) -> float:
    """Check that ``value`` is finite; raises :class:`CoverError`."""
    if not is_finite(value):
        raise CoverError(f"{name} is {shown(value)}; it must be a finite number")
    return _below_hugest(name, value, "")


def _below_hugest(name: str, value: float, unit: str) -> float:
    if abs(value) > HUGEST:
        raise CoverError(f"{name} is {shown(value)}; it must be at most {HUGEST:g} {unit}".rstrip())
    return float(value)


def numbers(name: str, values: Floats | float, unit: str) -> Floats:
    """An array of finite numbers; raises :class:`CoverError`."""
    try:
        found = np.asarray(values, float)
    except OverflowError:  # one of Python's whole numbers
        found = np.asarray(np.inf)
    if not (np.abs(found) <= HUGEST).all():
        raise CoverError(f"{name} has a value that is no finite number, at most {HUGEST:g} {unit}".rstrip())
    return found
