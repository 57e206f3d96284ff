"""`contactfpga cover`: the soft cover's impact, sensitivity and design; a file per topic."""

from __future__ import annotations

import argparse

from contactfpga.design.cover.answer import CoverError
from contactfpga.tools.commands.cover import design, figures, impact, sense

HELP = "Compute the soft cover: impact, sensitivity and design."
EXTRA = "sim"

TOPICS = {"impact": impact, "sense": sense, "design": design, "figures": figures}


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
    except OverflowError:
        raise CoverError("a number is too large to compute with; all are in SI units") from None
