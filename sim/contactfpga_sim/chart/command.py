"""`contactfpga chart`: the picture of speed against accuracy, and its numbers."""

from __future__ import annotations

import argparse
import contextlib
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from pathlib import Path

from contactfpga_sim.chart import draw
from contactfpga_sim.chart.methods import METHODS
from contactfpga_sim.chart.study import Point, Task, study
from contactfpga_sim.families import FAMILIES

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


def executor(args: argparse.Namespace) -> Executor:
    """What ``args.dask`` and ``args.jobs`` ask for."""
    if args.dask is None:
        return ProcessPoolExecutor(args.jobs)
    from distributed import Client

    return Client(args.dask).get_executor()


def _with_progress(tasks: list[Task], workers: Executor, with_size: bool) -> list[Point]:
    with progress("placements") as step:
        return study(tasks, workers, with_size, step)


@contextlib.contextmanager
def progress(first: str) -> Iterator[Callable[[str, int], None]]:
    """A bar; what it gives is called with the name and number of all steps after each of them."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns) as shown:
        bar = shown.add_task(first)

        def step(name: str, of: int) -> None:
            shown.update(bar, advance=1, total=of, description=name)

        yield step
