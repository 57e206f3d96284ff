"""`contactfpga failures`: turns every knob, writes the table and the pictures."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from contactfpga.console import outputs
from contactfpga.console.interrupt import Interrupted
from contactfpga_sim.pages import failures_page, figures
from contactfpga_sim.studies.failures import knob_pictures
from contactfpga_sim.studies.failures.catalogue import STUDIES
from contactfpga_sim.studies.failures.knob import Turned
from contactfpga_sim.studies.pool import progress


def main(args: argparse.Namespace) -> int:
    """Run the command: args.study (names or None for all), args.page (a file whose table is written anew, with its
    pictures beside it in images/failures, or None), args.output (a folder for pictures and table)."""
    for name in args.study or ():
        if name not in STUDIES:
            raise ValueError(f"--study {name!r} is not known; take one of {', '.join(STUDIES)}")
    if args.page and args.study:
        raise ValueError("--page takes all studies; leave --study out")
    folder = outputs.folder(args.output)
    path = outputs.file(args.page, "--page") if args.page else None
    pictures = outputs.folder(path.parent / "images" / "failures", "--page") if path else folder
    turned: dict[str, dict[str, Turned]] = {}
    try:
        _turn(args.study or list(STUDIES), turned)
    except KeyboardInterrupt:
        raise Interrupted(_kept(turned, folder)) from None
    if path:
        tables = {"failures": lambda: failures_page.table(turned), "pictures": failures_page.pictures}
        path.write_text(figures.update(path.read_text(encoding="utf-8"), tables), encoding="utf-8")
    else:
        path = _write(turned, folder / "failures.md")
    print(path, flush=True)
    _draw(turned, pictures)
    return 0


def _write(turned: Mapping[str, Mapping[str, Turned]], path: Path) -> Path:
    path.write_text(failures_page.table(turned) + "\n", encoding="utf-8")
    return path


def _kept(turned: Mapping[str, Mapping[str, Turned]], folder: Path) -> str:
    """Where what was finished is, in a file of its own: a whole table from before stays."""
    done = sum(map(len, turned.values()))
    if not done:
        return "interrupted before the first knob was turned"
    path = _write(turned, folder / "failures-so-far.md")
    return f"interrupted; {done} row{'' if done == 1 else 's'} of the table, all that was finished, in {path}"


def _draw(turned: Mapping[str, Mapping[str, Turned]], folder: Path) -> None:
    for name, methods in turned.items():
        (folder / f"{name}.svg").write_text(knob_pictures.svg(STUDIES[name], methods), encoding="utf-8")
        print(folder / f"{name}.svg")


def _turn(names: list[str], turned: dict[str, dict[str, Turned]]) -> None:
    """Turn the knobs one after the other; each is in ``turned`` as soon as it is done."""
    runs = sum(len(STUDIES[name].runs) for name in names)
    with progress() as step:
        for name in names:
            STUDIES[name].turn(lambda: step("knobs and methods", runs), turned.setdefault(name, {}))
