"""Flags of several commands."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

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


class Flags:
    """Adds flags to a command's parser, or to a group of its help, with a call for each."""

    def __init__(self, parser: Any):
        self.parser = parser

    def group(self, title: str) -> Flags:
        return Flags(self.parser.add_argument_group(title))

    def one_of(self) -> Flags:
        """Of the flags added to this, one must be given."""
        return Flags(self.parser.add_mutually_exclusive_group(required=True))

    def __call__(
        self,
        usage: str,
        text: str,
        kind: Callable[[str], object] | Sequence[object] | None = None,
        default: object = None,
        *,
        required: bool = False,
        dest: str | None = None,
    ) -> None:
        """Add a flag or an argument.

        ``usage``: as ``--once``, ``-o --output FILE``, ``--rpy R P Y`` or ``--unit K=STEPS ...``, which can be
        repeated; an argument as ``FILE``, ``[PORT]``, ``SCENES ...`` or ``[PORT ...]``. ``kind``: what reads the value,
        as in :mod:`contactfpga.tools.console.numbers`, or the choices. The help ends with the default unless ``text``
        states one. ``dest``: name of the value, by default that of the option, or of an argument up to its dot.
        """
        words = usage.strip("[]").split()
        names = [word for word in words if word.startswith("-")]
        values = [word for word in words if word not in (*names, "...")]
        given: dict[str, Any] = {"help": _with_default(text, default), "required": required, "dest": dest}
        if isinstance(kind, Sequence):
            given |= {"choices": kind, "type": type(kind[0])}
        else:
            given |= {"type": kind, "metavar": values[0] if len(values) == 1 else tuple(values) or None}
        given["default"] = default
        if not names:
            given["nargs"] = {"[": "*" if "..." in words else "?"}.get(usage[0], "+" if "..." in words else None)
            names = [given.pop("dest") or values[0].partition(".")[0].lower()]
            del given["required"]
        elif not values and kind is None:
            given = {"help": text, "action": "store_true"}
        elif "..." in words:
            given["action"] = "append"
        elif len(values) > 1:
            given["nargs"] = len(values)
        self.parser.add_argument(*names, **{name: value for name, value in given.items() if value is not None})


def _with_default(text: str, default: object) -> str:
    if default in (None, "", []) or "(default: " in text:
        return text
    values = default if isinstance(default, tuple) else (default,)
    shown = " ".join(f"{one:g}" if isinstance(one, float) else str(one) for one in values)
    return f"{text.removesuffix('.')} (default: {shown})."


def connection(flag: Flags, port: str = PORT, skin: str = SKIN) -> None:
    """Add the flags of :func:`opened`; ``port``, ``skin``: their help."""
    flag("[PORT]", port)
    reading(flag, skin)


def reading(flag: Flags, skin: str = SKIN) -> None:
    """Add the flags for opening a port; ``skin``: help of this option."""
    flag("--skin FILE", skin)
    flag("--baud N", "Bits per second (default: the Skin's, or 3000000).", numbers.BAUD)
    flag("--timeout S", "Seconds to wait for the board.", numbers.SECONDS, 1.0)


def sheet(flag: Flags, skin: str) -> None:
    """Add a Skin's file or a kit's name; ``skin``: help of the former."""
    flag("--skin FILE", skin)
    kit(flag)


def kit(flag: Flags) -> None:
    flag("--kit NAME", "The sheet of this kit (docs/kits.md).")


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


def design(flag: Flags, skin: str) -> None:
    """Add one Skin, a kit's or several; ``skin``: help of the first option."""
    sheet(flag, skin)
    flag("--sheets FILE", "Several sheets at this one FPGA (docs/several.md).")


def designed(args: argparse.Namespace, usual: Skin, load: Callable[[str], Skin] = Skin.load) -> Skin | Several:
    """The design by the options of :func:`design`, or the default Skin."""
    args.skin = sheet_file(args)
    if args.skin and args.sheets:
        raise ContactFPGAError("give --skin or --sheets, not both; the Skins of several sheets are in their file")
    if args.sheets:
        return Several.load(args.sheets)
    return load(args.skin) if args.skin else usual


def seconds(flag: Flags) -> None:
    """Add the duration of commands that run until Ctrl-C."""
    flag("--seconds S", "End after this many seconds (default: at Ctrl-C).", numbers.SECONDS)


def forces(flag: Flags, what: str) -> None:
    flag("--units FILE", f"{what}, from the board's pressure units in this TOML file (docs/haptics.md).")
    flag("--friction MU", "Friction coefficient of what touches (default: 0.5); needs --units.", numbers.number(0, 10))


def check_forces(args: argparse.Namespace) -> None:
    """Raise :class:`ContactFPGAError` for friction without forces, before a board is opened."""
    if args.friction is not None and args.units is None:
        raise ContactFPGAError("--friction needs --units: it is used for forces only")


def once(flag: Flags) -> None:
    flag("--once", "Ask for one frame, show it, and exit.")


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


def json(flag: Flags, text: str = "Print one JSON object.") -> None:
    """Add the flag of :func:`contactfpga.tools.console.results.show`."""
    flag("--json", text)


def workers(flag: Flags) -> None:
    flag("--jobs N", "Number of processes (default: one per core).", numbers.JOBS)
    flag("--dask ADDRESS", "Send the work to the Dask cluster with this scheduler.")


def output(flag: Flags, text: str, metavar: str = "FILE", default: str | None = None) -> None:
    flag(f"-o --output {metavar}", text, default=default)


def output_folder(flag: Flags, default: str) -> None:
    output(flag, "Folder for the results.", "DIR", default)


def known(option: str, names: list[str] | None, choices: list[str]) -> list[str]:
    """The given names, or all choices; raises ValueError for an unknown one."""
    for name in names or ():
        if name not in choices:
            raise ValueError(f"{option} {name!r} is not known; take one of: {'; '.join(choices)}")
    return names or choices
