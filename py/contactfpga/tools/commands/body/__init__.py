"""`contactfpga body`: many sheets on one robot; a file per topic."""

from __future__ import annotations

import argparse

from contactfpga.tools.commands.body import learn, register, show

HELP = "Show the contacts on all links of a robot in one coordinate frame."
EXTRA = None

TOPICS = {"show": show, "register": register, "learn": learn}
USUAL_TOPIC = "show"
"""What `contactfpga body ROBOT.toml` is short for."""


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the topics, each with its flags."""
    parser.usage = f"%(prog)s ROBOT.toml ...\n       %(prog)s {{{','.join(TOPICS)}}} ..."
    commands = parser.add_subparsers(dest="topic", required=True, metavar="TOPIC", prog=parser.prog)
    for name, topic in TOPICS.items():
        topic.add_flags(commands.add_parser(name, help=topic.HELP, description=topic.HELP))


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    status: int = TOPICS[args.topic].run(args)
    return status
