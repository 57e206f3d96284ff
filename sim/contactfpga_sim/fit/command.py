"""`contactfpga fit`: the cheapest Skin that is good enough for given scenes."""

from __future__ import annotations

import argparse
import json
import shlex
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from contactfpga.commands.cover import UNSOLVED
from contactfpga.skin import Skin
from contactfpga_sim import pool
from contactfpga_sim.fit import show
from contactfpga_sim.fit.candidates import METHODS, SCANS, Candidate, candidates, pitches_for, size_for
from contactfpga_sim.fit.goals import Goals
from contactfpga_sim.fit.search import fit
from contactfpga_sim.fit.sources import default_count, source
from contactfpga_sim.fit.trial import Fit, Task


def main(args: argparse.Namespace) -> int:
    """Run the command."""
    task, tried = asked(args)
    with pool.executor(args.jobs, args.dask) as executor, pool.progress() as step:
        found = fit(task, tried, executor, step)
    if args.output and found.answer:
        command = shlex.join(["contactfpga", *sys.argv[1:]]) if sys.argv[1:] else "contactfpga fit"
        Path(args.output).write_text(show.toml(found, command), encoding="utf-8")
    if args.json:
        print(json.dumps(show.plain(found)))
    else:
        _print(found, args.output)
    return 0 if found.answer and not found.broken else UNSOLVED


def asked(args: argparse.Namespace) -> tuple[Task, list[Candidate]]:
    """The task, and all candidates; raises ValueError for what cannot be."""
    sources = tuple(source(name, args.seed, args.threshold) for name in args.scenes)
    base = Skin.load(args.skin) if args.skin else None
    goals = Goals(
        miscounted=_share(args.miscounted),
        missed=_share(args.missed),
        barycenter_mm=args.barycenter_mm,
        area=_share(args.area),
        latency_us=args.latency_us,
    )
    count = default_count(sources) if args.placements is None else args.placements
    for one in sources:
        goals.check_count(one.most(count))
    tried = candidates(
        base or Skin(),
        pitches_for(base, sources, args.pitch_mm),
        size_for(base, sources),
        _methods(args.labeller),
        _known("--scan", args.scan, SCANS),
        args.baud,
    )
    return Task(sources, tuple(args.scenes), base or Skin(), goals, count, args.host_us, args.quick), tried


def _share(percent: float | None) -> float | None:
    return None if percent is None else percent / 100


def _methods(labellers: Sequence[str] | None) -> list[dict[str, Any]]:
    def by(method: dict[str, Any]) -> str:
        return "cells" if method["report"] == "cells" else method["labeller"]

    chosen = _known("--labeller", labellers, list(dict.fromkeys(map(by, METHODS))))
    return [method for method in METHODS if by(method) in chosen]


def _known(option: str, names: Sequence[str] | None, known: Sequence[str]) -> Sequence[str]:
    for name in names or ():
        if name not in known:
            raise ValueError(f"{option} {name!r} is not known; take one of: {', '.join(known)}")
    return names or known


def _print(found: Fit, output: str | None) -> None:
    console = Console() if sys.stdout.isatty() else Console(width=160)
    console.print(_table(show.rows(found), bold="the answer"))
    console.print(_table(show.reported(found)))
    for line in show.notes(found):
        console.print(line, highlight=False, markup=False)
    if output and found.answer:
        console.print(f"Skin: {output}", highlight=False, markup=False)


def _table(rows: Iterable[Sequence[str]], bold: str | None = None) -> Table:
    head, *lines = rows
    table = Table(box=box.SIMPLE_HEAD)
    for index, name in enumerate(head):
        last = index == len(head) - 1
        table.add_column(name, justify="left" if index < 2 or last else "right", overflow="fold")
    for line in lines:
        table.add_row(*map(escape, line), style="bold" if line[-1] == bold else None)
    return table
