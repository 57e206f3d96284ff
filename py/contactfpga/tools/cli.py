"""The command `contactfpga`: the table of its commands, and how they fail."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from typing import Protocol

from contactfpga import __version__
from contactfpga.choices.choice import trusted
from contactfpga.errors import MissingExtra
from contactfpga.tools.commands import (
    arm,
    board,
    body,
    build,
    chart,
    cover,
    doctor,
    export,
    failures,
    fit,
    flash,
    flips,
    haptics,
    latency,
    plot,
    publish,
    record,
    recover,
    replay,
    ros,
    settle,
    surface,
    view,
    wire,
    zones,
)
from contactfpga.tools.console import interrupt
from contactfpga.tools.console.parser import Parser


class Command(Protocol):
    """A file of :mod:`contactfpga.tools.commands`. It loads with the host alone; what else ``run`` needs, it
    imports."""

    @property
    def HELP(self) -> str:  # noqa: N802
        """A sentence."""

    @property
    def EXTRA(self) -> str | None:  # noqa: N802
        """The extra with all that the command needs; None where that depends on the port."""

    def add_flags(self, parser: argparse.ArgumentParser) -> None:
        """Add the command's flags to its parser."""

    def run(self, args: argparse.Namespace) -> int:
        """Run the command; returns the exit status."""


COMMANDS: dict[str, Command] = {
    "zones": zones,
    "body": body,
    "view": view,
    "wire": wire,
    "board": board,
    "doctor": doctor,
    "publish": publish,
    "build": build,
    "flash": flash,
    "replay": replay,
    "latency": latency,
    "record": record,
    "recover": recover,
    "export": export,
    "ros": ros,
    "plot": plot,
    "settle": settle,
    "surface": surface,
    "cover": cover,
    "haptics": haptics,
    "chart": chart,
    "fit": fit,
    "failures": failures,
    "flips": flips,
    "arm": arm,
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status; errors print one line that names the next step."""
    return interrupt.guarded(lambda: _run(arguments))


def _run(arguments: Sequence[str] | None) -> int:
    parser = _parser()
    args = parser.parse_args(_with_usual_topic(sys.argv[1:] if arguments is None else list(arguments)))
    if args.command is None:
        parser.print_help(sys.stderr)
        return 2
    command = COMMANDS[args.command]
    try:
        with trusted(args.trust):
            return command.run(args)
    except ModuleNotFoundError as error:
        return interrupt.failed(_missing(args.command, command.EXTRA, error))
    except MissingExtra as error:  # of a part that does not know which command it serves
        return interrupt.failed(MissingExtra(error.what, command.EXTRA) if command.EXTRA else error)
    except ValueError as error:
        return interrupt.failed(error)


def _with_usual_topic(arguments: list[str]) -> list[str]:
    """`contactfpga body ROBOT.toml` is short for a topic of that command."""
    if arguments[:1] == ["body"] and arguments[1:2] not in ([], ["-h"], ["--help"], *([name] for name in body.TOPICS)):
        return ["body", body.USUAL_TOPIC, *arguments[1:]]
    return arguments


def _missing(command: str, extra: str | None, error: ModuleNotFoundError) -> MissingExtra:
    package = (error.name or "").split(".")[0]
    usual = extra or ("cli" if package == "rich" else "sim")
    return MissingExtra(f"`contactfpga {command}` ({error})", "cluster" if package == "distributed" else usual)


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog="contactfpga",
        description="Contact zones of a switch-matrix skin.",
        epilog="Without a board, try: contactfpga zones sim://",
    )
    parser.add_argument("--version", action="version", version=__version__)
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    for name, command in COMMANDS.items():
        command.add_flags(commands.add_parser(name, help=command.HELP, description=command.HELP))
    for leaf in leaves(parser):
        leaf.add_argument("--trust", action="store_true", help="Import, and so run, modules that Skin files name.")
    return parser


def leaves(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    """The parsers of commands without topics, and of topics."""
    topics = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    for action in topics:
        for topic in action.choices.values():
            yield from leaves(topic)
    if not topics:
        yield parser


if __name__ == "__main__":
    sys.exit(main())
