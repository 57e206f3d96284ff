"""`contactfpga chart`: the picture of speed against accuracy, and its numbers."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
from concurrent.futures import Executor
from pathlib import Path

from contactfpga_sim.chart import draw
from contactfpga_sim.chart.methods import METHODS
from contactfpga_sim.chart.study import Point, Task, study
from contactfpga_sim.families import FAMILIES
from contactfpga_sim.workers import executor, progress

FAMILIES_DRAWN = ("bumper", "fingers", "pair", "palm", "edge")


def main(args: argparse.Namespace) -> int:
    """Run the command."""
    if args.placements < 1:
        raise ValueError(f"--placements is {args.placements}; it must be at least 1")
    _known("--method", args.method, METHODS)
    _known("--family", args.family, FAMILIES)
    tasks = [
        Task(method, METHODS[method], family, args.placements, args.seed)
        for family in args.family or FAMILIES_DRAWN
        for method in args.method or METHODS
    ]
    with executor(args) as workers:
        points = _with_progress(tasks, workers, not args.no_size)
    folder = Path(args.output)
    folder.mkdir(parents=True, exist_ok=True)
    figure = draw.picture(points)
    for ending in ("png", "svg"):
        figure.savefig(folder / f"chart.{ending}", dpi=130, metadata={"Date": None} if ending == "svg" else None)
    draw.write_csv(points, folder / "chart.csv")
    for name in ("chart.png", "chart.svg", "chart.csv"):
        print(folder / name)
    return 0


def _known(option: str, names: Iterable[str] | None, known: Iterable[str]) -> None:
    for name in names or ():
        if name not in known:
            raise ValueError(f"{option} {name!r} is not known; take one of: {'; '.join(known)}")


def _with_progress(tasks: list[Task], workers: Executor, with_size: bool) -> list[Point]:
    with progress("placements") as step:
        return study(tasks, workers, with_size, step)
