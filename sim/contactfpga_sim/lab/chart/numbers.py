"""The chart's numbers: a line per point, written as CSV and read back."""

from __future__ import annotations

import csv
import dataclasses
from collections.abc import Iterable, Mapping
from pathlib import Path

from contactfpga.inputs.files import replaced
from contactfpga.skin import Skin
from contactfpga_sim.lab.chart.compute import KINDS, Point, Task
from contactfpga_sim.lab.chart.errors import METRICS, Interval
from contactfpga_sim.lab.chart.methods import METHODS
from contactfpga_sim.lab.chart.speed import Speed

TIMES = tuple(field.name for field in dataclasses.fields(Speed))
ENDS = ("", "_low", "_high", "_count")
"""After a metric's name, the fields of its interval."""


def command(point: Point) -> str:
    """What works out this point alone."""
    task = point.task
    return (
        f'contactfpga study chart --method "{task.method}" --family {task.family} --placements {task.count} '
        f"--seed {task.seed}"
    )


def write(points: Iterable[Point], path: Path) -> None:
    """Errors with their 95 % intervals, times in us, LUT4 and clock on the UP5K."""
    with replaced(path) as new, open(new, "w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        errors = [f"{kind}_{name}{end}" for kind in KINDS for name in METRICS for end in ENDS]
        head = ("family", "method", "placements", "seed", *TIMES, "host_us", "luts", "fmax_mhz")
        table.writerow([*head, *errors, "command"])
        for point in points:
            task = point.task
            times = [f"{value:.1f}" for value in (*dataclasses.astuple(point.speed), point.host_us)]
            size = ["" if value is None else f"{value:g}" for value in (point.luts, point.fmax_mhz)]
            found = [
                f"{value:.6g}"
                for kind in KINDS
                for name in METRICS
                for value in dataclasses.astuple(point.errors[kind][name])
            ]
            table.writerow([task.family, task.method, task.count, task.seed, *times, *size, *found, command(point)])


def read(path: Path, methods: Mapping[str, Skin] = METHODS) -> list[Point]:
    """What :func:`write` wrote, rounded as it was written; ``methods``: the Skin of each method by its name."""
    with open(path, newline="", encoding="utf-8") as file:
        return [_point(line, methods) for line in csv.DictReader(file)]


def _point(line: dict[str, str], methods: Mapping[str, Skin]) -> Point:
    method = line["method"]
    task = Task(method, methods[method], line["family"], int(line["placements"]), int(line["seed"]))
    errors = {kind: {name: _interval(line, f"{kind}_{name}") for name in METRICS} for kind in KINDS}
    luts, fmax = (float(line[name]) if line[name] else None for name in ("luts", "fmax_mhz"))
    speed = Speed(*(float(line[name]) for name in TIMES))
    return Point(task, errors, speed, None if luts is None else int(luts), fmax, float(line["host_us"]))


def _interval(line: dict[str, str], name: str) -> Interval:
    mean, low, high, count = (float(line[name + end]) for end in ENDS)
    return Interval(mean, low, high, int(count))
