"""`contactfpga chart`: the picture of speed against accuracy, and its numbers."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path

from contactfpga.console import outputs
from contactfpga.console.interrupt import Interrupted
from contactfpga_sim.scenes.families import FAMILIES
from contactfpga_sim.studies import pool
from contactfpga_sim.studies.chart import host, numbers, picture
from contactfpga_sim.studies.chart.methods import METHODS
from contactfpga_sim.studies.chart.study import Point, Task, study

FAMILIES_DRAWN = ("bumper", "fingers", "pair", "palm", "edge")


def main(args: argparse.Namespace) -> int:
    """Run the command."""
    _known("--method", args.method, METHODS)
    _known("--family", args.family, FAMILIES)
    folder = outputs.folder(args.output)
    tasks = [
        Task(method, METHODS[method], family, args.placements, args.seed)
        for family in args.family or FAMILIES_DRAWN
        for method in args.method or METHODS
    ]
    so_far: dict[Task, Point] = {}
    try:
        with pool.executor(args.jobs, args.dask) as executor, pool.progress() as step:
            points = [host.timed(point) for point in study(tasks, executor, not args.no_size, step, so_far)]
    except KeyboardInterrupt:
        raise Interrupted(_kept([so_far[task] for task in tasks if task in so_far], len(tasks), folder)) from None
    table = folder / "chart.csv"
    numbers.write(points, table)
    print(table, flush=True)
    picture.save(numbers.read(table), folder)
    for name in ("chart.png", "chart.svg"):
        print(folder / name)
    return 0


def _kept(points: list[Point], of: int, folder: Path) -> str:
    """Where the points are that were finished, in a file of their own: a whole chart from before stays."""
    again = "the same command goes on from there"
    if not points:
        return f"interrupted before the first of {of} points was finished; {again}"
    path = folder / "chart-so-far.csv"
    numbers.write(points, path)
    return f"interrupted; {len(points)} of {of} points are in {path}, without sizes and the host's times; {again}"


def _known(option: str, names: Iterable[str] | None, known: Iterable[str]) -> None:
    for name in names or ():
        if name not in known:
            raise ValueError(f"{option} {name!r} is not known; take one of: {'; '.join(known)}")
