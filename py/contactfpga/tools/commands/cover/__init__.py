"""`contactfpga cover`: the soft cover's impact, sensitivity and design; a file per topic."""

from __future__ import annotations

from collections.abc import Callable

from contactfpga.design.cover.answer import CoverError

TOPICS = {
    "impact": "Compute compression, time and peak force when an arm runs into something.",
    "sense": "Compute the force that closes a switch under the cover, or how far a force reaches.",
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
