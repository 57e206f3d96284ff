"""Measures other people's labellers like ours: exact or not, how late, how large, how fast. See docs/rivals.md.

    python scripts/measure_rivals.py [--clone FOLDER] [--enter FILE.py] [--sizes 16 32 64]

Needs git and, for LinkRunCCA, ghdl (sudo apt install ghdl); and contactfpga with its extras `sim` and `boards`.
"""

from __future__ import annotations

import argparse
import runpy
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from rivals.campaign import FRAMES, measure
from rivals.house import DEVICES, SEEDS, BitstreamFailed, ContactFPGAError, guarded
from rivals.linkruncca import LINK_RUN_CCA
from rivals.report import Measured, exactness_table, provenance, sizes_table, summary_table
from rivals.rival import Rival, RivalError

RIVALS = {rival.name.lower(): rival for rival in (LINK_RUN_CCA,)}
"""Those that can be measured. docs/rivals.md says what a further one needs."""

SIZES = (16, 32, 64)
"""Sheets that the pages show."""

CLONES = Path("build/rivals")
TABLES = (provenance, exactness_table, sizes_table, summary_table)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; its status."""
    options = _parser().parse_args(arguments)
    began = time.monotonic()
    try:
        rival = entered(options.enter) if options.enter else RIVALS[options.rival]
        devices = [device for device in DEVICES if device.title.lower() in options.devices]
        clone = _clone(rival, options.clone)
        measured = measure(rival, clone, sorted(set(options.sizes)), devices, options.seeds)
        print("\n\n".join(table(measured) for table in TABLES))
    except (ContactFPGAError, BitstreamFailed, OSError) as error:
        print(f"measure_rivals: {error}", file=sys.stderr)
        return 1
    print(f"{time.monotonic() - began:.0f} s", file=sys.stderr)
    return 0


def compute() -> Measured:
    """What the pages show."""
    return measure(LINK_RUN_CCA, _clone(LINK_RUN_CCA, None), list(SIZES), list(DEVICES), SEEDS)


def entered(file: Path) -> Rival:
    """``RIVAL`` of a Python file, which runs."""
    if not file.is_file():
        raise RivalError(f"--enter is {str(file)!r}; there is no such file, give one like scripts/rivals/lone_cells.py")
    found = runpy.run_path(str(file)).get("RIVAL")
    if not isinstance(found, Rival):
        raise RivalError(f"{file} has no RIVAL; set it as scripts/rivals/lone_cells.py does")
    return found


def _clone(rival: Rival, folder: Path | None) -> Path:
    if folder is None:
        folder = CLONES / rival.name.lower()
        rival.fetch(folder)
    rival.check(folder)
    return folder


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--rival", choices=sorted(RIVALS), default="linkruncca")
    parser.add_argument("--enter", type=Path, metavar="FILE.py", help="measure the RIVAL of this file, which runs")
    parser.add_argument("--clone", type=Path, help="folder of its clone (default: one is made in build/rivals)")
    parser.add_argument("--sizes", type=int, nargs="+", choices=sorted(FRAMES), default=SIZES, metavar="N")
    names = [device.title.lower() for device in DEVICES]
    parser.add_argument("--devices", nargs="*", choices=names, default=names, help="none: only exactness and latency")
    parser.add_argument("--seeds", type=int, choices=range(1, 10), default=SEEDS, metavar="1..9")
    return parser


if __name__ == "__main__":
    sys.exit(guarded(main))
