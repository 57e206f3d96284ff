"""The command `contactfpga`. Nothing heavy is imported until a command needs it."""

from __future__ import annotations

import argparse
import importlib
import os
import sys
from collections.abc import Sequence

from contactfpga import __version__
from contactfpga.commands import cover_flags, fit_flags
from contactfpga.console import interrupt, numbers, terminal
from contactfpga.errors import ContactFPGAError, MissingExtra
from contactfpga.inputs.files import told
from contactfpga.inputs.values import visible_lines
from contactfpga.skin import limits

_COMMANDS = {
    "zones": "contactfpga.commands.zones",
    "wire": "contactfpga.commands.wire",
    "doctor": "contactfpga.commands.doctor",
    "build": "contactfpga.commands.build",
    "flash": "contactfpga.commands.flash",
    "board": "contactfpga_sim.board.virtual",
    "replay": "contactfpga_sim.board.replay",
    "cover": "contactfpga.commands.cover",
    "chart": "contactfpga_sim.studies.chart.command",
    "fit": "contactfpga_sim.studies.fit.command",
    "failures": "contactfpga_sim.studies.failures.command",
    "arm": "contactfpga_sim.studies.arm.command",
}
"""Module of each command; its ``main(args)`` returns the exit status."""

_EXTRAS = {
    "build": "boards",
    "chart": "chart",
    "fit": "chart",
    **dict.fromkeys(("board", "replay", "failures", "arm", "cover"), "sim"),
}
"""Extra with all that a command needs; of the others it depends on the port."""

_PORT = "device path, sim://, replay://FILE; none: the one supported board that is plugged in"
_BOARD = "icebreaker, icestick, ulx3s-12f or ulx3s-85f"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status; errors print one line that names the next step."""
    return interrupt.guarded(lambda: _run(arguments))


def _run(arguments: Sequence[str] | None) -> int:
    parser = _parser()
    args = parser.parse_args(arguments)
    if args.command is None:
        parser.print_help(sys.stderr)
        return 2
    try:
        return importlib.import_module(_COMMANDS[args.command]).main(args) or 0
    except BrokenPipeError:  # `contactfpga zones --json | head` closed its end, which is no error
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # nor is what is left to flush at exit
        return 0
    except ModuleNotFoundError as error:
        return _failed(_missing(args.command, error))
    except MissingExtra as error:  # of a part that does not know which command it serves
        extra = _EXTRAS.get(args.command)
        return _failed(MissingExtra(error.what, extra) if extra else error)
    except (ContactFPGAError, ValueError) as error:
        return _failed(error)
    except OSError as error:
        return _failed(told(error))


def _failed(reason: object) -> int:
    interrupt.silence_amaranth()
    # Names from files and devices are part of it.
    terminal.say(f"contactfpga: {visible_lines(str(reason))}", sys.stderr, hang=2)
    return 1


def _missing(command: str, error: ModuleNotFoundError) -> MissingExtra:
    package = (error.name or "").split(".")[0]
    extra = "cluster" if package == "distributed" else _EXTRAS.get(command, "cli" if package == "rich" else "sim")
    return MissingExtra(f"`contactfpga {command}` ({error})", extra)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="contactfpga",
        description="Contact zones of a switch-matrix skin.",
        epilog="Without a board: contactfpga zones sim://",
    )
    parser.add_argument("--version", action="version", version=__version__)
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
    _zones(commands.add_parser("zones", help="show the contact zones, live"))
    _wire(commands.add_parser("wire", help="show the pressed cells, live, to check the wiring"))
    _board(commands.add_parser("board", help="run the virtual board on a pseudo-terminal"))
    _doctor(commands.add_parser("doctor", help="say what is wrong between this computer and the board"))
    _build(commands.add_parser("build", help="build a bitstream for a board"))
    _flash(commands.add_parser("flash", help="write a bitstream into a board"))
    _replay(commands.add_parser("replay", help="put recorded frames through the compiled gateware"))
    cover_flags.add(commands.add_parser("cover", help="compute the soft cover: impact, sensitivity, design"))
    _chart(commands.add_parser("chart", help="chart what speed costs in accuracy"))
    fit_flags.add(commands.add_parser("fit", help="find the cheapest Skin that is good enough for given scenes"))
    _failures(commands.add_parser("failures", help="turn one knob after the other until something breaks"))
    _arm(commands.add_parser("arm", help="run the arm into a human arm, and see what force it takes"))
    return parser


def _connection(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("port", nargs="?", metavar="PORT", help=_PORT)
    parser.add_argument("--skin", metavar="FILE", help="Skin the board must be built from; its baud rate is taken")
    parser.add_argument("--baud", type=numbers.BAUD, help="bits per second (that of the Skin, else 3000000)")
    wait = "seconds to wait for the board (default: 1)"
    parser.add_argument("--timeout", type=numbers.SECONDS, default=1.0, help=wait)


def _zones(parser: argparse.ArgumentParser) -> None:
    _connection(parser)
    parser.add_argument("--once", action="store_true", help="ask for one frame, show it and end")
    parser.add_argument("--json", action="store_true", help="one JSON object a frame and line, every frame")
    parser.add_argument("--record", metavar="FILE", help="write every byte received to this file, for replay://FILE")


def _wire(parser: argparse.ArgumentParser) -> None:
    _connection(parser)
    parser.add_argument("--once", action="store_true", help="ask for one frame, show it and end")


def _board(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--skin", metavar="FILE", help="Skin of the board (default: the reference Skin)")
    parser.add_argument("--scene", metavar="NAME", help="what touches the sheet: a scene's name or a .npy file")
    parser.add_argument("--link", metavar="PATH", help="symbolic link to make to the pseudo-terminal")


def _doctor(parser: argparse.ArgumentParser) -> None:
    _connection(parser)
    long = "how long frames are counted (default: 1)"
    parser.add_argument("--seconds", type=numbers.SECONDS, default=1.0, help=long)


def _build(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("board", metavar="BOARD", help=_BOARD)
    parser.add_argument("--skin", metavar="FILE", help="Skin to build (default: one that fits the board)")
    parser.add_argument("--output", metavar="DIR", help="folder for what is built (default: build/BOARD)")
    start = "where place and route starts (default: 1)"
    parser.add_argument("--seed", type=numbers.whole(0, 2**31 - 1), default=1, metavar="N", help=start)


def _flash(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("board", metavar="BOARD", help=_BOARD)
    parser.add_argument("file", nargs="?", metavar="FILE", help="bitstream (default: the one in build/BOARD)")


def _replay(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("frames", metavar="FRAMES.npy", help="array (frames, rows, columns), bool or numbers")
    parser.add_argument("--connectivity", type=int, choices=(4, 8), default=8, help="default: 8")
    parser.add_argument("--threshold", type=numbers.CELL, help="cells above this count as pressed; needed for numbers")
    parser.add_argument(
        "--pitch-mm", type=numbers.PITCH_MM, default=10.0, help="distance of rows and columns (default: 10)"
    )
    bits, divided = numbers.whole(0, limits.MAX_BARYCENTER_BITS), "barycenters divided on the board, to 1/2^K cell"
    parser.add_argument("--barycenter-bits", type=bits, metavar="K", help=divided)
    parser.add_argument("--json", action="store_true", help="one JSON object a frame and line")


def _chart(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--method", action="append", metavar="NAME", help="only this one; can be repeated")
    parser.add_argument("--family", action="append", metavar="NAME", help="only these scenes; can be repeated")
    count = numbers.whole(1, 1_000_000)
    parser.add_argument("--placements", type=count, default=1000, metavar="N", help="for each point (default: 1000)")
    parser.add_argument("--seed", type=numbers.SEED, default=0, help="of the placements (default: 0)")
    parser.add_argument("--jobs", type=numbers.JOBS, metavar="N", help="processes (default: one a core)")
    parser.add_argument("--dask", metavar="ADDRESS", help="scheduler of a Dask cluster that does the work instead")
    parser.add_argument("--no-size", action="store_true", help="leave out place and route")
    parser.add_argument("--output", metavar="DIR", default="build/chart", help="folder (default: build/chart)")


def _failures(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--study", action="append", metavar="NAME", help="only this one; can be repeated")
    parser.add_argument("--page", metavar="FILE", help="page whose table and pictures are written anew")
    parser.add_argument("--output", metavar="DIR", default="build/failures", help="folder (default: build/failures)")


def _arm(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--case", default="paper", metavar="NAME", help="paper, paper-offset, push or a .toml file")
    late, usual = numbers.number(0, 10_000, "ms"), "that is put in (default: the paper's 6)"
    parser.add_argument("--latency", type=late, default=6.0, metavar="MS", help=usual)
    parser.add_argument("--skin", metavar="FILE", help="Skin of the sheet (default: the reference Skin)")
    parser.add_argument("--json", action="store_true", help="one JSON object, in SI units, and no pictures")
    parser.add_argument("--charts", action="store_true", help="draw force, safe speed and thickness against latency")
    parser.add_argument("--jobs", type=numbers.JOBS, metavar="N", help="processes for the charts (default: one a core)")
    parser.add_argument(
        "--dask", metavar="ADDRESS", help="scheduler of a Dask cluster that works the charts out instead"
    )
    parser.add_argument("--output", metavar="DIR", default="build/arm", help="folder (default: build/arm)")


if __name__ == "__main__":
    sys.exit(main())
