"""The command `contactfpga`. Nothing heavy is imported until a command needs it."""

from __future__ import annotations

import argparse
import importlib
import importlib.metadata
import os
import sys
from collections.abc import Sequence

from contactfpga import interrupt, terminal
from contactfpga.commands import cover_flags, fit_flags
from contactfpga.errors import ContactFPGAError, MissingExtra

_COMMANDS = {
    "zones": "contactfpga.commands.zones",
    "wire": "contactfpga.commands.wire",
    "doctor": "contactfpga.commands.doctor",
    "build": "contactfpga.commands.build",
    "flash": "contactfpga.commands.flash",
    "board": "contactfpga_sim.board",
    "replay": "contactfpga_sim.replay",
    "cover": "contactfpga.commands.cover",
    "chart": "contactfpga_sim.chart.command",
    "fit": "contactfpga_sim.fit.command",
    "failures": "contactfpga_sim.failures.command",
    "arm": "contactfpga_sim.arm.command",
}
"""Module of each command; its ``main(args)`` returns the exit status."""

_PORT = "device path, sim://, replay://FILE; none: the one supported board that is plugged in"
_BOARD = "icebreaker, icestick, ulx3s-12f or ulx3s-85f"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status; errors print one line that names the next step."""
    return interrupt.guarded(lambda: _run(_parser().parse_args(arguments)))


def _run(args: argparse.Namespace) -> int:
    try:
        return importlib.import_module(_COMMANDS[args.command]).main(args) or 0
    except BrokenPipeError:  # `contactfpga zones --json | head` closed its end, which is no error
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # nor is what is left to flush at exit
        return 0
    except ModuleNotFoundError as error:
        return _failed(_missing(args.command, error))
    except (ContactFPGAError, ValueError, OSError) as error:
        return _failed(error)


def _failed(error: Exception) -> int:
    interrupt.silence_amaranth()
    terminal.say(f"contactfpga: {error}", sys.stderr, hang=2)
    return 1


def _missing(command: str, error: ModuleNotFoundError) -> MissingExtra:
    by_command = {"build": "boards", "chart": "chart", "fit": "chart"}.get(command, "sim")
    extra = {"rich": "cli", "distributed": "cluster"}.get((error.name or "").split(".")[0], by_command)
    return MissingExtra(f"`contactfpga {command}` ({error})", extra)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="contactfpga",
        description="Contact zones of a switch-matrix skin.",
        epilog="Without a board: contactfpga zones sim://",
    )
    parser.add_argument("--version", action="version", version=importlib.metadata.version("contactfpga"))
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
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
    parser.add_argument("--baud", type=int, help="bits a second (that of the Skin, else 3000000)")
    parser.add_argument("--timeout", type=float, default=1.0, help="seconds to wait for the board (default: 1)")


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
    parser.add_argument("--seconds", type=float, default=1.0, help="how long frames are counted (default: 1)")


def _build(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("board", metavar="BOARD", help=_BOARD)
    parser.add_argument("--skin", metavar="FILE", help="Skin to build (default: one that fits the board)")
    parser.add_argument("--output", metavar="DIR", help="folder for what is built (default: build/BOARD)")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="where place and route starts (default: 1)")


def _flash(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("board", metavar="BOARD", help=_BOARD)
    parser.add_argument("file", nargs="?", metavar="FILE", help="bitstream (default: the one in build/BOARD)")


def _replay(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("frames", metavar="FRAMES.npy", help="array (frames, rows, columns), bool or numbers")
    parser.add_argument("--connectivity", type=int, choices=(4, 8), default=8, help="default: 8")
    parser.add_argument("--threshold", type=float, help="cells above this count as pressed; needed for numbers")
    parser.add_argument("--pitch-mm", type=float, default=10.0, help="distance of rows and columns (default: 10)")
    parser.add_argument(
        "--barycenter-bits", type=int, metavar="K", help="barycenters divided on the board, to 1/2^K cell"
    )
    parser.add_argument("--json", action="store_true", help="one JSON object a frame and line")


def _chart(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--method", action="append", metavar="NAME", help="only this one; can be repeated")
    parser.add_argument("--family", action="append", metavar="NAME", help="only these scenes; can be repeated")
    parser.add_argument("--placements", type=int, default=1000, metavar="N", help="for each point (default: 1000)")
    parser.add_argument("--seed", type=int, default=0, help="of the placements (default: 0)")
    parser.add_argument("--jobs", type=int, metavar="N", help="processes (default: one a core)")
    parser.add_argument("--dask", metavar="ADDRESS", help="scheduler of a Dask cluster that does the work instead")
    parser.add_argument("--no-size", action="store_true", help="leave out place and route")
    parser.add_argument("--output", metavar="DIR", default="build/chart", help="folder (default: build/chart)")


def _failures(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--study", action="append", metavar="NAME", help="only this one; can be repeated")
    parser.add_argument("--page", metavar="FILE", help="page whose table and pictures are written anew")
    parser.add_argument("--output", metavar="DIR", default="build/failures", help="folder (default: build/failures)")


def _arm(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--case", default="paper", metavar="NAME", help="paper, paper-offset, push or a .toml file")
    parser.add_argument(
        "--latency", type=float, default=6.0, metavar="MS", help="that is put in (default: the paper's 6)"
    )
    parser.add_argument("--skin", metavar="FILE", help="Skin of the sheet (default: the reference Skin)")
    parser.add_argument("--json", action="store_true", help="one JSON object, in SI units, and no pictures")
    parser.add_argument("--charts", action="store_true", help="draw force, safe speed and thickness against latency")
    parser.add_argument("--jobs", type=int, metavar="N", help="processes for the charts (default: one a core)")
    parser.add_argument(
        "--dask", metavar="ADDRESS", help="scheduler of a Dask cluster that works the charts out instead"
    )
    parser.add_argument("--output", metavar="DIR", default="build/arm", help="folder (default: build/arm)")


if __name__ == "__main__":
    sys.exit(main())
