"""The command `contactfpga cover`.

Input and JSON are in SI units, tables in mm and kPa.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

from contactfpga.design.cover.answer import MAX_LENGTH_M, CoverError
from contactfpga.tools.console import numbers

TOPICS = {
    "impact": "Compute compression, time and peak force when an arm runs into something.",
    "sense": "Compute the force that closes a switch under the cover, or how far a force reaches.",
    "felt": "Compute how light a finger a Skin's sheet feels, anywhere on it.",
    "places": "Fit the table by which a tracker places contacts by the order in which cells close.",
    "design": "Find material, thickness and pitch for an arm, a switch and limits.",
    "figures": "Draw the paper's curves, the impact over time and the design map.",
}
USUAL = None


def run(topic: Callable[[], int]) -> int:
    """Run a topic; raises :class:`CoverError` for numbers that are too large."""
    try:
        return topic()
    except OverflowError:
        raise CoverError("a number is too large to compute with; all are in SI units") from None


MM, KPA = 1e3, 1e-3


def notes(found: Iterable[str]) -> None:
    for note in found:
        print(f"note: {note}")


LENGTH, LENGTH_FROM_0 = numbers.length(MAX_LENGTH_M), numbers.length(MAX_LENGTH_M, 0.0)
ALONG = numbers.length(10.0)
KG = numbers.number(1e-6, 1e6, "kg")
SPEED = numbers.number(0, 1000, "m/s")
TORQUE = numbers.number(-1e6, 1e6, "Nm")
BRIEF = numbers.number(1e-6, 1, "s")
FACE = numbers.number(1e-12, 1e-2, "m2")
SHARE = numbers.number(0, 10, above=True)
ANGLE = numbers.number(-2 * math.pi, 2 * math.pi, "rad")
POISSON = numbers.number(-1, 0.5, above=True)
PASCAL = numbers.number(1, 1e12, "Pa")
NEWTON = numbers.number(1e-6, 1e6, "N")
