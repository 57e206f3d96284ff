"""Flags of several commands."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from contactfpga.boards import BOARDS, find
from contactfpga.boards.spec import BoardSpec
from contactfpga.choices.choice import look_in
from contactfpga.design import kits
from contactfpga.driver import driver
from contactfpga.driver.driver import Board
from contactfpga.errors import ContactFPGAError
from contactfpga.skin import Skin
from contactfpga.skin.several import Several
from contactfpga.tools.console import numbers

PORT = (
    "Device path, name:NAME, usb:SERIAL or zenoh://KEY of a board (PORT#1: sheet 1 of several at one board), sim://, "
    "replay://FILE or flexitac://DEVICE (default: the one supported board that is plugged in; with --skin, the one "
    "with that Skin)."
)
SKIN = "Require a board built from this Skin, and use its baud rate."


def connection(parser: argparse.ArgumentParser, port: str = PORT, skin: str = SKIN) -> None:
    """Add the flags of :func:`opened`; ``port``, ``skin``: their help."""
    parser.add_argument("port", nargs="?", metavar="PORT", help=port)
    reading(parser, skin)


def reading(parser: argparse.ArgumentParser, skin: str = SKIN) -> None:
    """Add the flags for opening a port; ``skin``: help of this option."""
    parser.add_argument("--skin", metavar="FILE", help=skin)
    parser.add_argument(
        "--baud", type=numbers.BAUD, metavar="N", help="Bits per second (default: the Skin's, or 3000000)."
    )
    wait = "Seconds to wait for the board (default: 1)."
    parser.add_argument("--timeout", type=numbers.SECONDS, default=1.0, metavar="S", help=wait)


def sheet(parser: argparse.ArgumentParser, skin: str) -> None:
    """Add a Skin's file or a kit's name; ``skin``: help of the former."""
    parser.add_argument("--skin", metavar="FILE", help=skin)
    kit(parser)


def kit(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--kit", metavar="NAME", help="The sheet of this kit (docs/kits.md).")


def sheet_file(args: argparse.Namespace) -> str | None:
    """The Skin's file by the options of :func:`sheet`, or None."""
    given: str | None = args.skin
    if not args.kit:
        return given
    if given:
        raise ContactFPGAError("give --skin or --kit, not both; a kit has its own Skin")
    return str(kits.kit(args.kit).skin_path)


def board(args: argparse.Namespace) -> BoardSpec | None:
    """The board of ``--board``, its argument or ``--kit``; None if none is given. A module may lie in this folder."""
    if not args.kit:
        if args.board and ":" in args.board:
            look_in(Path.cwd(), args.board)
        return find(args.board) if args.board else None
    found = kits.kit(args.kit).board
    if args.board and args.board != found.name:
        raise ContactFPGAError(f"the kit {args.kit!r} is for {found.name}, not {args.board}; leave the board out")
    return found


def named_board(args: argparse.Namespace) -> BoardSpec:
    """Like :func:`board`; raises :class:`ContactFPGAError` instead of None."""
    found = board(args)
    if found is None:
        known = " or --kit ".join(kits.names())
        raise ContactFPGAError(f"name a board, {', '.join(BOARDS)}, or a kit: --kit {known}")
    return found


def design(parser: argparse.ArgumentParser, skin: str) -> None:
    """Add one Skin, a kit's or several; ``skin``: help of the first option."""
    sheet(parser, skin)
    parser.add_argument("--sheets", metavar="FILE", help="Several sheets at this one FPGA (docs/several.md).")


def designed(args: argparse.Namespace, usual: Skin, load: Callable[[str], Skin] = Skin.load) -> Skin | Several:
    """The design by the options of :func:`design`, or the default Skin."""
    args.skin = sheet_file(args)
    if args.skin and args.sheets:
        raise ContactFPGAError("give --skin or --sheets, not both; the Skins of several sheets are in their file")
    if args.sheets:
        return Several.load(args.sheets)
    return load(args.skin) if args.skin else usual


def seconds(parser: argparse.ArgumentParser) -> None:
    """Add the duration of commands that run until Ctrl-C."""
    long = "End after this many seconds (default: at Ctrl-C)."
    parser.add_argument("--seconds", type=numbers.SECONDS, metavar="S", help=long)


def forces(parser: argparse.ArgumentParser, what: str) -> None:
    units = f"{what}, from the board's pressure units in this TOML file (docs/haptics.md)."
    parser.add_argument("--units", metavar="FILE", help=units)
    friction = "Friction coefficient of what touches (default: 0.5); needs --units."
    parser.add_argument("--friction", type=numbers.number(0, 10), metavar="MU", help=friction)


def check_forces(args: argparse.Namespace) -> None:
    """Raise :class:`ContactFPGAError` for friction without forces, before a board is opened."""
    if args.friction is not None and args.units is None:
        raise ContactFPGAError("--friction needs --units: it is used for forces only")


def once(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--once", action="store_true", help="Ask for one frame, show it, and exit.")


def opened(args: argparse.Namespace, record: str | None = None) -> Board:
    """The board by the arguments of a command."""
    return driver.open(args.port, args.skin, baud=args.baud, record=record, timeout=args.timeout)


def known_skin(board: Board) -> Skin | None:
    """The board's Skin; None if only its hello is known."""
    try:
        return board.skin
    except ContactFPGAError:
        return None


SI = "Print one JSON object in SI units."
FRAMES = "Print every frame as a line with one JSON object."


def json(parser: argparse.ArgumentParser, text: str = "Print one JSON object.") -> None:
    """Add the flag of :func:`contactfpga.tools.console.results.show`."""
    parser.add_argument("--json", action="store_true", help=text)


def workers(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--jobs", type=numbers.JOBS, metavar="N", help="Number of processes (default: one per core).")
    dask = "Send the work to the Dask cluster with this scheduler."
    parser.add_argument("--dask", metavar="ADDRESS", help=dask)


def output(parser: argparse.ArgumentParser, text: str, metavar: str = "FILE", default: str | None = None) -> None:
    parser.add_argument("-o", "--output", metavar=metavar, default=default, help=text)


def output_folder(parser: argparse.ArgumentParser, default: str) -> None:
    output(parser, f"Folder for the results (default: {default}).", "DIR", default)


def known(option: str, names: list[str] | None, choices: list[str]) -> list[str]:
    """The given names, or all choices; raises ValueError for an unknown one."""
    for name in names or ():
        if name not in choices:
            raise ValueError(f"{option} {name!r} is not known; take one of: {'; '.join(choices)}")
    return names or choices
