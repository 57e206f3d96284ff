"""The command `contactfpga plot`."""

from __future__ import annotations

import argparse
from pathlib import Path

from contactfpga import terminal
from contactfpga.tools.console import flags, outputs

EXTRA = "view"

ENDINGS = (".png", ".svg")


def add_flags(flag: flags.Flags) -> None:
    flag("RECORDING", "File of `contactfpga record` or of `contactfpga zones --record`.")
    flags.output(flag, "PNG or SVG, by its ending (default: RECORDING.png, in this folder).")
    flag("--link NAME", "Board to draw from a recording of several (default: the first).")


def run(args: argparse.Namespace) -> int:
    from contactfpga.tools.view import board_recording, plot

    with terminal.reading(args.recording) as tell:
        recording = board_recording.load(args.recording, args.link, reading=tell)
    path = Path(args.output or f"{Path(args.recording).stem}.png")
    if path.suffix.lower() not in ENDINGS:
        raise ValueError(f"--output is {str(path)!r}; it must end in {' or '.join(ENDINGS)}")
    plot.draw(recording, outputs.file(path))
    terminal.say(str(path))
    return 0
