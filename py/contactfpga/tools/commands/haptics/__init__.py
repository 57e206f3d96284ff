"""`contactfpga haptics`: forces at contacts, from pressure units; a file per topic."""

from __future__ import annotations

import argparse

from contactfpga.inputs import files
from contactfpga.robot.haptics.values import HapticsError
from contactfpga.tools.commands.haptics import contacts, place, threshold, wrench, zero
from contactfpga.tools.console import interrupt

HELP = "Compute forces at contacts from pressure units; set their zeros and thresholds."
EXTRA = "haptics"

BAD_INPUT = 2
"""Exit status: scripts tell a file that cannot be used from a failure."""

TOPICS = {"contacts": contacts, "wrench": wrench, "place": place, "zero": zero, "threshold": threshold}


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the topics, each with its flags."""
    commands = parser.add_subparsers(dest="topic", required=True, metavar="TOPIC")
    for name, topic in TOPICS.items():
        topic.add_flags(commands.add_parser(name, help=topic.HELP, description=topic.HELP))


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    try:
        status: int = TOPICS[args.topic].run(args)
        return status
    except (HapticsError, OSError) as error:
        if isinstance(error, BrokenPipeError):
            raise
        interrupt.failed(HapticsError(files.told(error)) if isinstance(error, OSError) else error)
        return BAD_INPUT
