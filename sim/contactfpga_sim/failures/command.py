"""`contactfpga failures`: turns every knob, writes the table and the pictures."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from contactfpga_sim import figures
from contactfpga_sim.failures import draw, page
from contactfpga_sim.failures.catalogue import STUDIES
from contactfpga_sim.failures.study import Turned


def main(args: argparse.Namespace) -> int:
    """Run the command: args.study (names or None for all), args.page (a file whose table is written anew, with its
    pictures beside it in images/failures, or None), args.output (a folder for pictures and table)."""
    for name in args.study or ():
        if name not in STUDIES:
            raise ValueError(f"--study {name!r} is not known; take one of {', '.join(STUDIES)}")
    if args.page and args.study:
        raise ValueError("--page takes all studies; leave --study out")
    turned = _with_progress(args.study or list(STUDIES))
    if args.page:
        path = Path(args.page)
        text = figures.update(path.read_text(), {"failures": lambda: page.table(turned), "pictures": page.pictures})
        path.write_text(text)
        print(path)
        _draw(turned, path.parent / "images" / "failures")
        return 0
    folder = Path(args.output)
    _draw(turned, folder)
    (folder / "failures.md").write_text(page.table(turned) + "\n")
    print(folder / "failures.md")
    return 0


def _draw(turned: Mapping[str, Mapping[str, Turned]], folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name, methods in turned.items():
        (folder / f"{name}.svg").write_text(draw.svg(STUDIES[name], methods), encoding="utf-8")
        print(folder / f"{name}.svg")


def _with_progress(names: list[str]) -> dict[str, dict[str, Turned]]:
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

    with Progress(TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn()) as progress:
        bar = progress.add_task("knobs", total=len(names))
        found = {}
        for name in names:
            progress.update(bar, description=STUDIES[name].title)
            found[name] = STUDIES[name].turn()
            progress.advance(bar)
        return found
