"""Types of numbers on the command line, whose errors name range and unit."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import TypeVar

from contactfpga.skin import Skin

_Number = TypeVar("_Number", int, float)

MIN_LENGTH_M = 1e-6
IN_METERS = "lengths are in m, 5 mm is 0.005"


def number(low: float, high: float, unit: str = "", *, above: bool = False, hint: str = "") -> Callable[[str], float]:
    """A finite number from ``low`` (with ``above``: above it) to ``high``."""
    return _between(float, "number", low, high, unit, above, hint)


def whole(low: int, high: int, unit: str = "") -> Callable[[str], int]:
    return _between(int, "whole number", low, high, unit, False, "")


def shortened(text: str) -> str:
    return text if len(text) <= 40 else f"{text[:40]}..."


def or_none(kind: Callable[[str], float]) -> Callable[[str], float | None]:
    def read(text: str) -> float | None:
        if text == "none":
            return None
        try:
            return kind(text)
        except argparse.ArgumentTypeError as error:
            raise argparse.ArgumentTypeError(f"{error}, nor 'none'") from None

    return read


def length(high: float, low: float = MIN_LENGTH_M) -> Callable[[str], float]:
    """A length in m, whose range excludes values in mm."""
    return number(low, high, "m", hint=IN_METERS)


def _between(
    parse: Callable[[str], _Number], what: str, low: float, high: float, unit: str, above: bool, hint: str
) -> Callable[[str], _Number]:
    ends = f"above {low:.12g} and at most {high:.12g}" if above else f"from {low:.12g} to {high:.12g}"
    wanted = f"a {what} {ends} {unit}".rstrip() + (f"; {hint}" if hint else "")

    def read(text: str) -> _Number:
        try:
            value = parse(text)
        except ValueError:
            value = None
        # Not a number is not between anything.
        if value is None or not low <= value <= high or (above and value == low):
            raise argparse.ArgumentTypeError(f"{shortened(text)!r} is not {wanted}")
        return value

    return read


SECONDS = number(0, 86_400, "s", above=True)
BAUD = whole(*Skin.limits("baud"))
PITCH_MM = number(*Skin.limits("pitch_x_mm"))
CELL = number(-1e300, 1e300)
SEED = whole(0, 2**63 - 1)
JOBS = whole(1, 1024, "processes")
TURN = number(-7, 7, "rad", hint="angles are in rad, 90 degrees are 1.5708")
