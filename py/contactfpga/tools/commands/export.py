"""The command `contactfpga export`."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from contactfpga import terminal
from contactfpga.tools.console import flags, outputs, results

EXTRA = "analysis"


def add_flags(flag: flags.Flags) -> None:
    flag("RECORDING", "File of `contactfpga record` or of `contactfpga zones --record`.")
    flag("OUT", "The table: OUT.parquet, OUT.npz or OUT.csv.", dest="table")
    flags.json(flag)


def run(args: argparse.Namespace) -> int:
    from contactfpga.tools.recordings.export import export
    from contactfpga.tools.recordings.recording import Recording

    recording = Recording(args.recording)
    path = outputs.file(args.table, "OUT")
    rows = export(recording, path)
    unused, duration_s = +recording.unused, recording.duration_s
    answer = {"file": path, "rows": rows, "duration_s": duration_s, "unused_bytes": unused}
    results.show(args, answer, lambda: _show(path, rows, duration_s, unused))
    return 0


def _show(path: Path, rows: int, duration_s: float, unused: Mapping[str, int]) -> None:
    terminal.say(f"{path}: {rows:,} rows of {duration_s:.1f} s")
    for link, count in unused.items():
        terminal.say(f"{link}: {count:,} bytes could not be used; they are damaged, or no hello comes before them")
