"""The command `contactfpga haptics`."""

from __future__ import annotations

from collections.abc import Callable

from contactfpga.inputs import files
from contactfpga.robot.haptics.values import HapticsError
from contactfpga.tools.console import interrupt

BAD_INPUT = 2
"""Exit status for unusable files."""

TOPICS = {
    "contacts": "Compute the force at each contact from a wrench.",
    "wrench": "Compute the wrench on the link from the readings of its pressure units.",
    "place": "Compare places for the pressure units of a link.",
    "zero": "Read the zeros of a board's pressure units while nothing touches, and set them on the board.",
    "threshold": "Set the deviations from zero at which a board's units and their weighted sums raise contact.",
}
USUAL = None


def run(topic: Callable[[], int]) -> int:
    """Run a topic; returns :data:`BAD_INPUT` for an unusable file or number."""
    try:
        return topic()
    except (HapticsError, OSError) as error:
        if isinstance(error, BrokenPipeError):
            raise
        interrupt.failed(HapticsError(files.reason_of(error)) if isinstance(error, OSError) else error)
        return BAD_INPUT
