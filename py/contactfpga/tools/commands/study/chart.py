"""The command `contactfpga study chart`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from contactfpga.choices import labellers
from contactfpga.tools.console import flags, numbers, outputs
from contactfpga.tools.console.interrupt import Interruption

if TYPE_CHECKING:
    from contactfpga_sim.lab.chart.compute import Point, Task
    from contactfpga_sim.lab.chart.methods import Method

EXTRA = "chart"


def add_flags(flag: flags.Flags) -> None:
    flag("--method NAME ...", "Chart only this method; can be repeated.")
    flag("--labeller NAME ...", "Add this labeller, module:attribute of your own, to the methods; can be repeated.")
    flag("--family NAME ...", "Use only these scenes; can be repeated.")
    flag("--placements N", "Number of scenes per point.", numbers.whole(1, 1_000_000), 400)
    flag("--seed N", "Seed of the placements.", numbers.SEED, 0)
    flags.workers(flag)
    flag("--no-size", "Leave out place and route.")
    flags.output_folder(flag, "build/chart")


def run(args: argparse.Namespace) -> int:
    from contactfpga_sim.apps import pool
    from contactfpga_sim.lab.chart import host, times_picture
    from contactfpga_sim.lab.chart import numbers as table
    from contactfpga_sim.lab.chart.compute import study
    from contactfpga_sim.lab.chart.methods import Method

    tasks = _tasks(args)
    folder = outputs.folder(args.output)
    so_far: dict[Task, Point] = {}
    try:
        with pool.executor(args.jobs, args.dask) as executor, pool.progress() as step:
            points = study(tasks, executor, not args.no_size, step, so_far)
    except KeyboardInterrupt:
        raise Interruption(_kept([so_far[task] for task in tasks if task in so_far], len(tasks), folder)) from None
    path = folder / "chart.csv"
    table.write(map(host.timed, points), path)
    print(path, flush=True)
    points = table.read(path, {task.method: Method(task.skin, task.cover) for task in tasks})
    print(times_picture.save(points, folder / "times.svg"))
    return 0


def _tasks(args: argparse.Namespace) -> list[Task]:
    from contactfpga_sim.lab.chart.compute import FAMILIES_DRAWN, Task
    from contactfpga_sim.lab.chart.methods import METHODS
    from contactfpga_sim.model.scenes.families import FAMILIES

    known = METHODS | _own(args)
    methods = flags.known("--method", args.method, list(known))
    flags.known("--family", args.family, list(FAMILIES))
    return [
        Task(method, *known[method], family, args.placements, args.seed)
        for family in args.family or FAMILIES_DRAWN
        for method in methods
    ]


def _own(args: argparse.Namespace) -> dict[str, Method]:
    from contactfpga_sim.lab.chart.methods import by

    return {name: method for one in args.labeller or () for name, method in by(labellers.find(one)).items()}


def _kept(points: list[Point], of: int, folder: Path) -> str:
    from contactfpga_sim.lab.chart import numbers as table

    again = "run the same command again to go on from there"
    if not points:
        return f"interrupted before the first of {of} points was finished; {again}"
    path = folder / "chart-so-far.csv"
    table.write(points, path)
    return f"interrupted; {len(points)} of {of} points are in {path}, without sizes and the host's times; {again}"
