"""Measures other people's labellers like ours: exact or not, how late, how large, how fast. See docs/rivals.md.

    python scripts/measure_rivals.py [--clone FOLDER] [--sizes 16 32 64] [--page docs/rivals.md]

Needs git and, for LinkRunCCA, ghdl (sudo apt install ghdl); and contactfpga with its extras `sim` and `boards`.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from rivals.campaign import FRAMES, measure
from rivals.house import DEVICES, SEEDS, BitstreamFailed, ContactFPGAError, guarded, update
from rivals.linkruncca import LINK_RUN_CCA
from rivals.report import TABLES
from rivals.rival import Rival, RivalError

RIVALS = {rival.name.lower(): rival for rival in (LINK_RUN_CCA,)}
"""Those that can be measured. docs/rivals.md says what a further one needs."""

SIZES = (16, 32, 64)
"""Sheets that the pages show."""

CLONES = Path("build/rivals")


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; its status."""
    options = _parser().parse_args(arguments)
    began = time.monotonic()
    try:
        check_pages(options)
        rival = RIVALS[options.rival]
        devices = [device for device in DEVICES if device.title.lower() in options.devices]
        clone = _clone(rival, options.clone)
        measured = measure(rival, clone, sorted(set(options.sizes)), devices, options.seeds)
        found = {name: table(measured) for name, table in TABLES.items()}
        print("\n\n".join(found.values()))
        ready = {name: lambda text=text: text for name, text in found.items()}
        for page in options.page:
            page.write_text(update(page.read_text(encoding="utf-8"), ready), encoding="utf-8")
            print(f"measured {page}")
    except (ContactFPGAError, BitstreamFailed, OSError) as error:
        print(f"measure_rivals: {error}", file=sys.stderr)
        return 1
    print(f"{time.monotonic() - began:.0f} s", file=sys.stderr)
    return 0


def check_pages(options: argparse.Namespace) -> None:
    """Raise :class:`~rivals.rival.RivalError` unless each page has a place for a table, and the tables are whole."""
    for page in options.page:
        if not page.is_file():
            raise RivalError(f"--page is {page}; there is no such page")
        if not any(f"<!-- figures: {name} -->" in page.read_text(encoding="utf-8") for name in TABLES):
            marks = ", ".join(f"<!-- figures: {name} -->" for name in TABLES)
            raise RivalError(f"--page is {page}; it has none of the marks {marks}")
    if options.page and (set(SIZES) - set(options.sizes) or len(options.devices) < len(DEVICES)):
        needed = ", ".join(f"{size}x{size}" for size in SIZES)
        raise RivalError(f"the tables in --page need {needed} on every device; leave out --sizes and --devices")


def _clone(rival: Rival, folder: Path | None) -> Path:
    if folder is None:
        folder = CLONES / rival.name.lower()
        rival.fetch(folder)
    rival.check(folder)
    return folder


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--rival", choices=sorted(RIVALS), default="linkruncca")
    parser.add_argument("--clone", type=Path, help="folder of its clone (default: one is made in build/rivals)")
    parser.add_argument("--sizes", type=int, nargs="+", choices=sorted(FRAMES), default=SIZES, metavar="N")
    names = [device.title.lower() for device in DEVICES]
    parser.add_argument("--devices", nargs="*", choices=names, default=names, help="none: only exactness and latency")
    parser.add_argument("--seeds", type=int, choices=range(1, 10), default=SEEDS, metavar="1..9")
    parser.add_argument("--page", type=Path, nargs="+", default=[], help="also write the tables into these pages")
    return parser


if __name__ == "__main__":
    sys.exit(guarded(main))
