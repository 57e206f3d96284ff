"""The command `contactfpga body`."""

from __future__ import annotations

from collections.abc import Callable

TOPICS = {
    "show": "Show every link's state and contacts (the usual topic: contactfpga body ROBOT.toml).",
    "register": "Find where a sheet sits on its link, by pressing a few known points.",
    "learn": "Learn which cells the folding cover presses over a joint's range, while nobody touches it.",
    "surface": "Lay a sheet on a mesh: a table of point and normal per cell.",
}
USUAL = "show", "ROBOT.toml"
"""Topic of `contactfpga body ROBOT.toml`."""


def run(topic: Callable[[], int]) -> int:
    return topic()
