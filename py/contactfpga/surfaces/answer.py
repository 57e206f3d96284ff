"""A surface that cannot be, or a place that is not on one."""

from __future__ import annotations

from typing import Any

from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.values import is_finite, shown

LONGEST_MM = 1e6


class SurfaceError(ContactFPGAError, ValueError):
    """A surface, or a place on one, that cannot be; the message names the value and the limit."""


def length(name: str, value: Any, low: float = -LONGEST_MM, unit: str = "mm") -> float:
    """``value`` if it is a number above ``low``; raises :class:`SurfaceError`."""
    if not is_finite(value) or not low < value <= LONGEST_MM:
        what = f"a number above {low:g} and at most {LONGEST_MM:g} {unit}".rstrip()
        raise SurfaceError(f"{name} is {shown(value)}; it must be {what}")
    return float(value)
