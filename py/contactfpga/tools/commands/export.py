"""The command `contactfpga export`."""

from __future__ import annotations

import argparse

from contactfpga import terminal
from contactfpga.tools.console import outputs

EXTRA = "analysis"


def add_flags(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("recording", metavar="RECORDING.mcap", help="What `contactfpga record` wrote.")
    parser.add_argument("table", metavar="OUT", help="The table: OUT.parquet, OUT.npz or OUT.csv.")


def run(args: argparse.Namespace) -> int:
    from contactfpga.tools.recordings.export import export
    from contactfpga.tools.recordings.recording import Recording

    recording = Recording(args.recording)
    path = outputs.file(args.table, "OUT")
    rows = export(recording, path)
    terminal.say(f"{path}: {rows:,} rows of {recording.duration_s:.1f} s")
    for link, count in (+recording.unused).items():
        terminal.say(f"{link}: {count:,} bytes could not be used; they are damaged, or no hello comes before them")
    return 0
