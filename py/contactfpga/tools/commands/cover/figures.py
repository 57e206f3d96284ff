"""The command `contactfpga cover figures`."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from contactfpga.design.cover import line
from contactfpga.design.cover.task import FIRST_DESIGN, Task
from contactfpga.tools.commands.cover import MM
from contactfpga.tools.console import flags, outputs, results

EXTRA = "sim"


def add_flags(flag: flags.Flags) -> None:
    flag("--case CASE", "Case to draw: a .toml file (default: the paper's).")
    flag("--data FILE.csv", "Forces in N and deformations in m; draw their line too.")
    flags.output_folder(flag, "build/cover")
    flag("--format", "Format.", ("png", "svg"), "png")
    flags.json(flag, "Print in JSON what was drawn.")


def run(args: argparse.Namespace) -> int:
    folder = outputs.folder(args.output)
    from contactfpga.design.cover import drawing  # matplotlib, which only drawing needs

    task = Task.load(args.case) if args.case else FIRST_DESIGN
    data = line.read(args.data) if args.data else None
    files = drawing.draw(folder, args.format, task, data)
    known: dict[str, Any] = {"files": files}
    fitted = line.fit(*data) if data else None
    if fitted:
        known |= {"stiffness_n_m": fitted.stiffness_n_m, "correlation": fitted.correlation}
    results.show(args, known, lambda: _show(files, fitted))
    return 0


def _show(files: Iterable[Path], fitted: line.StraightLine | None) -> None:
    for file in files:
        print(f"drew {file}")
    if fitted:
        print(f"line: {fitted.stiffness_n_m / MM:.4g} N/mm, correlation {fitted.correlation:.5f}")
