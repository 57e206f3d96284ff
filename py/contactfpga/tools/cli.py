"""The command `contactfpga`: table of its commands, and error handling."""

from __future__ import annotations

import argparse
import functools
import sys
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any, NoReturn, Protocol

from contactfpga import __version__, terminal
from contactfpga.choices.choice import trusted
from contactfpga.errors import MissingExtra
from contactfpga.inputs.values import shortened, suggestion, visible_lines
from contactfpga.shipped import with_pages
from contactfpga.tools import commands
from contactfpga.tools.console import interrupt, outputs

if TYPE_CHECKING:
    from contactfpga.tools.console.flags import Flags

COMMANDS = {
    "zones": "Show the contact zones live.",
    "view": "Show the sheet in the browser, live or from a recording; press a virtual one with the mouse.",
    "body": "Show the contacts on all links of a robot in one coordinate frame.",
    "wire": "Show the pressed cells live, to check wiring, bounce and settle times.",
    "board": "Run the virtual board on a pseudo-terminal.",
    "doctor": "Find out what is wrong between this computer and the board.",
    "bringup": "Lead through the first power-up of a kit, and write a report of it.",
    "build": "Build a bitstream for a board; print its wiring.",
    "flash": "Write a bitstream to a board.",
    "latency": "Measure the time from a touch to the last byte, through USB and to your code, on simulated gateware.",
    "wave": "Simulate a touch clock by clock and write the waveform of every signal (VCD).",
    "record": "Record a board, or all boards of a robot, into an MCAP file; repair one that was not closed.",
    "replay": "Send recorded frames through the compiled gateware.",
    "plot": "Draw a recording: where, when and how large it was touched.",
    "export": "Write a recording as a table: Parquet, NPZ or CSV.",
    "publish": "Publish boards over the network (Eclipse Zenoh); zenoh://KEY reads one.",
    "ros": "Publish contacts as ROS 2 topics, with no ROS installed.",
    "sheet": "Lay out the sheet of a Skin as files to order: board, Gerbers, drill, parts, caps.",
    "ip": "Write the gateware as Verilog for another design, with assertions, testbench and example.",
    "settle": "Compute the times that the circuit of a sheet needs.",
    "cover": "Compute the soft cover: touches felt, impact, sensitivity and design.",
    "haptics": "Compute forces at contacts from pressure units; set their zeros and thresholds.",
    "fit": "Find the cheapest Skin that is good enough for given scenes.",
    "study": "Chart speed against accuracy; run a robot arm into a human arm.",
}
"""Help of each command. Its module in :mod:`contactfpga.tools.commands`, a :class:`Subcommand` or a
:class:`TopicGroup`, is imported on call.
"""

FIRST = {
    "view": "press a virtual sheet in the browser",
    "zones sim://": "see the zones of a virtual board",
    "doctor": "check the board that is plugged in",
    "zones": "see its contact zones, live",
    "build icebreaker --wiring": "see how to wire a sheet to a board",
}

NOW = {
    "chart": "contactfpga study chart",
    "arm": "contactfpga study arm",
    "surface": "contactfpga body surface",
    "recover": "contactfpga record --recover",
    **dict.fromkeys(("failures", "study failures"), "docs/failures.md; `make pages NAME=failures` makes its tables"),
    **dict.fromkeys(("flips", "study flips"), "docs/flips.md; `make pages NAME=flips` makes its tables"),
}
"""Old names of commands and topics: what has their answer now."""


class Subcommand(Protocol):
    """A command or topic. Its module needs only the host's packages; ``run`` imports further ones."""

    @property
    def EXTRA(self) -> str | None:  # noqa: N802
        """The extra with all needs of the command; None if they depend on the port."""

    def add_flags(self, flag: Flags) -> None:
        """Add the command's flags to its parser."""

    def run(self, args: argparse.Namespace) -> int:
        """Run the command; returns the exit status."""


class TopicGroup(Protocol):
    """A command of several topics: a package with a :class:`Subcommand` per topic."""

    @property
    def TOPICS(self) -> dict[str, str]:  # noqa: N802
        """Help of each topic."""

    @property
    def USUAL(self) -> tuple[str, str] | None:  # noqa: N802
        """The default topic, and its place in the usage."""

    def run(self, topic: Callable[[], int]) -> int:
        """Run a topic, with common handling of errors."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status; an error prints one line with the next step."""
    return interrupt.guarded(lambda: _run(arguments))


def _run(arguments: Sequence[str] | None) -> int:
    parser = _parser()
    args = parser.parse_args(arguments)
    if args.command is None:
        print(_first(), file=sys.stderr)
        return 2
    try:
        with trusted(args.trust), outputs.no_empty_folders():
            status: int = args.run(args)
            return status
    except ModuleNotFoundError as error:
        return interrupt.failed(_missing(args.command, args.extra, error))
    except MissingExtra as error:  # of a part that does not know which command it serves
        extras = ",".join(dict.fromkeys(filter(None, (args.extra, error.extra))))
        return interrupt.failed(MissingExtra(error.what, extras))
    except ValueError as error:
        return interrupt.failed(error)


def _first() -> str:
    commands = [f"contactfpga {words}" for words in FIRST]
    width = max(map(len, commands))
    steps = [f"  {command:{width}}   {what}" for command, what in zip(commands, FIRST.values())]
    return "\n".join(
        [*steps, "", "contactfpga --help lists all commands, contactfpga COMMAND --help the options of one."]
    )


def _missing(command: str, extra: str | None, error: ModuleNotFoundError) -> MissingExtra:
    package = (error.name or "").split(".")[0]
    usual = extra or ("cli" if package == "rich" else "sim")
    return MissingExtra(f"`contactfpga {command}` ({error})", "cluster" if package == "distributed" else usual)


def _parser() -> Parser:
    parser = Parser(
        prog="contactfpga",
        description="Contact zones of a switch-matrix skin.",
        epilog="Without a board, try: contactfpga zones sim://",
    )
    parser.add_argument("--version", action="version", version=__version__)
    listed = parser.add_subparsers(dest="command", metavar="COMMAND")
    for name, said in COMMANDS.items():
        listed.add_parser(name, help=said, description=said, add=functools.partial(_add_command, name))
    return parser


def _add_command(name: str, parser: Parser) -> None:
    module = import_module(f"{commands.__name__}.{name}")
    if hasattr(module, "TOPICS"):
        _add_topics(module, module.__name__, parser)
    else:
        _add_flags(module, parser, module.run)


def _add_topics(group: TopicGroup, package: str, parser: Parser) -> None:
    if group.USUAL is not None:
        parser.usual_topic, instead = group.USUAL
        parser.usage = f"%(prog)s {instead} ...\n       %(prog)s {{{','.join(group.TOPICS)}}} ..."
    topics = parser.add_subparsers(dest="topic", required=True, metavar="TOPIC", prog=parser.prog)
    for name, said in group.TOPICS.items():
        add = functools.partial(_add_topic, group, f"{package}.{name}")
        topics.add_parser(name, help=said, description=said, add=add)


def _add_topic(group: TopicGroup, module: str, parser: Parser) -> None:
    topic: Subcommand = import_module(module)
    _add_flags(topic, parser, lambda args: group.run(lambda: topic.run(args)))


def _add_flags(command: Subcommand, parser: Parser, run: Callable[[argparse.Namespace], int]) -> None:
    from contactfpga.tools.console.flags import Flags  # with the driver, which the list of commands does without

    command.add_flags(Flags(parser))
    parser.add_argument("--trust", action="store_true", help="Import, and so run, modules that Skin files name.")
    parser.set_defaults(run=run, extra=command.EXTRA)


class _Help(argparse.HelpFormatter):
    def _split_lines(self, text: str, width: int) -> list[str]:
        return terminal.wrapped(" ".join(text.split()), width).split("\n")


class Parser(argparse.ArgumentParser):
    """Parser that accepts options anywhere. Plain argparse refuses an optional word after an option, as the port in
    `contactfpga record FILE --seconds 2 PORT`.

    ``add`` adds the arguments on first use, so that listed parsers load nothing.
    """

    _within = False

    usual_topic: str | None = None
    """Topic of a command whose first word names none."""

    def __init__(self, *args: Any, add: Callable[[Parser], None] | None = None, **options: Any):
        super().__init__(*args, **{"formatter_class": _Help, **options})
        self._add = add

    def complete(self) -> None:
        add, self._add = self._add, None
        if add is not None:
            add(self)
            for action in self._actions:
                action.help = action.help and with_pages(action.help)

    @property
    def topics(self) -> dict[str, Parser]:
        """The parsers of commands or topics below this one, by name."""
        self.complete()
        actions = [action for action in self._actions if isinstance(action, argparse._SubParsersAction)]
        return {name: parser for action in actions for name, parser in action.choices.items()}

    def error(self, message: str) -> NoReturn:
        """End with argparse's message, with control characters escaped."""
        super().error(visible_lines(shortened(message)))

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if isinstance(action, argparse._SubParsersAction) and value not in action.choices:
            old = f"{self.prog} {value}"
            if now := NOW.get(old.removeprefix("contactfpga ")):
                interrupt.failed(f"{old} is now {now}")
                self.exit(2)
            raise argparse.ArgumentError(action, f"{value!r} is none; {suggestion(value, action.choices)}")
        super()._check_value(action, value)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """argparse's method, with options anywhere."""
        topics = self.topics
        if self.usual_topic is not None and args and args[0] not in ("-h", "--help", *topics):
            args = [self.usual_topic, *args]
        if self._within or topics:
            return super().parse_known_args(args, namespace)
        self._within = True  # what comes next calls this method, for the options and then for the rest
        try:
            return self.parse_known_intermixed_args(args, namespace)
        finally:
            self._within = False


def leaves(parser: Parser) -> Iterator[Parser]:
    """The parsers of topics, and of commands without topics."""
    for topic in parser.topics.values():
        yield from leaves(topic)
    if not parser.topics:
        yield parser


if __name__ == "__main__":
    sys.exit(main())
