"""The command `contactfpga study`."""

from __future__ import annotations

from collections.abc import Callable

TOPICS = {
    "benchmark": "Score methods, your own among them, on scenes with a known truth.",
    "chart": "Chart what speed costs in accuracy.",
    "arm": "Run the robot arm into a human arm and see what force results.",
}
USUAL = None


def run(topic: Callable[[], int]) -> int:
    return topic()
