"""`contactfpga chart`: the picture of speed against accuracy, and its numbers."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from pathlib import Path

from contactfpga_sim import pool
from contactfpga_sim.chart import draw, host, numbers
from contactfpga_sim.chart.methods import METHODS
from contactfpga_sim.chart.study import Task, study
from contactfpga_sim.families import FAMILIES

FAMILIES_DRAWN = ("bumper", "fingers", "pair", "palm", "edge")


def main(args: argparse.Namespace) -> int:
    """Run the command."""
    _known("--method", args.method, METHODS)
    _known("--family", args.family, FAMILIES)
    tasks = [
        Task(method, METHODS[method], family, args.placements, args.seed)
        for family in args.family or FAMILIES_DRAWN
        for method in args.method or METHODS
    ]
    with pool.executor(args.jobs, args.dask) as executor, pool.progress() as step:
        points = [host.timed(point) for point in study(tasks, executor, not args.no_size, step)]
    folder = Path(args.output)
    folder.mkdir(parents=True, exist_ok=True)
    numbers.write(points, folder / "chart.csv")
    draw.save(numbers.read(folder / "chart.csv"), folder)
    for name in ("chart.csv", "chart.png", "chart.svg"):
        print(folder / name)
    return 0


def _known(option: str, names: Iterable[str] | None, known: Iterable[str]) -> None:
    for name in names or ():
        if name not in known:
            raise ValueError(f"{option} {name!r} is not known; take one of: {'; '.join(known)}")
