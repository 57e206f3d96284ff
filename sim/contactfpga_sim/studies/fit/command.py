"""`contactfpga fit`: the cheapest Skin that is good enough for given scenes."""

from __future__ import annotations

import argparse
import json
import shlex
import sys
from collections.abc import Sequence
from typing import Any

from contactfpga.commands.cover import UNSOLVED
from contactfpga.console import outputs, terminal
from contactfpga.console.interrupt import Interrupted
from contactfpga.console.tables import tables
from contactfpga.skin import Skin
from contactfpga_sim.studies import pool
from contactfpga_sim.studies.fit import show
from contactfpga_sim.studies.fit.candidates import METHODS, SCANS, Candidate, candidates, pitches_for, size_for
from contactfpga_sim.studies.fit.goals import Goals
from contactfpga_sim.studies.fit.search import fit
from contactfpga_sim.studies.fit.sources import default_count, source
from contactfpga_sim.studies.fit.trial import Fit, SoFar, Task


def main(args: argparse.Namespace) -> int:
    """Run the command."""
    output = outputs.file(args.output) if args.output else None
    task, tried = asked(args)
    so_far: SoFar = {}
    try:
        with pool.executor(args.jobs, args.dask) as executor, pool.progress() as step:
            found = fit(task, tried, executor, step, so_far)
    except KeyboardInterrupt:
        raise Interrupted(_kept(so_far, len(tried), args.json)) from None
    if args.json:
        print(json.dumps(show.plain(found)), flush=True)
    else:
        _print(found)
    if output and found.answer:
        command = shlex.join(["contactfpga", *sys.argv[1:]]) if sys.argv[1:] else "contactfpga fit"
        output.write_text(show.toml(found, command), encoding="utf-8")
        if not args.json:
            print(f"Skin: {output}")
    return 0 if found.answer and not found.broken else UNSOLVED


def _kept(so_far: SoFar, of: int, as_json: bool) -> str:
    """Print what is known of the candidates; what is to be said of that."""
    again = "the same command goes on from there"
    if not so_far:
        return f"interrupted before the first of {of} candidates was measured; {again}"
    if as_json:
        print(json.dumps(show.plain_so_far(so_far.values())), flush=True)
    else:
        _table(show.rows_so_far(so_far.values()))
    return f"interrupted; of {of} candidates {len(so_far)} were measured, and no answer was chosen; {again}"


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


def _print(found: Fit) -> None:
    _table(show.rows(found), bold="the answer")
    _table(show.reported(found), keys=1)
    for line in show.notes(found):
        terminal.say(line)


def _table(rows: Sequence[Sequence[str]], keys: int = 4, bold: str | None = None) -> None:
    """Print; of the Skins what tells them apart comes first, and the verdict last."""
    console = terminal.console()
    styles = {number: "bold" for number, row in enumerate(rows[1:]) if row[-1] == bold}
    texts = [len(rows[0]) - 1] if keys > 1 else []
    for table in tables(rows, console.width, keys=keys, texts=texts, styles=styles):
        console.print(table)
        console.print()
