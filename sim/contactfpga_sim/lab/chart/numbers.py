"""The chart's numbers as CSV."""

from __future__ import annotations

import csv
import dataclasses
from collections.abc import Iterable, Mapping
from pathlib import Path

from contactfpga.inputs.files import replaced
from contactfpga_sim.apps.errors import METRICS
from contactfpga_sim.apps.score import Interval
from contactfpga_sim.apps.stats import Quantile
from contactfpga_sim.lab.chart.compute import KINDS, Point, Task
from contactfpga_sim.lab.chart.methods import METHODS, Method
from contactfpga_sim.lab.chart.times import Times

QUANTILES = ("touch_median_us", "touch_q95_us", "electric_median_us", "electric_q95_us")
ENDS = ("", "_low", "_high", "_count")
ERRORS = tuple(f"{kind}_{name}" for kind in KINDS for name in METRICS)
SINGLE = ("bytes", "lower_bound_us", "host_us", "luts")
FIELDS = (
    *("family", "method", "placements", "seed"),
    *(name + end for name in (*QUANTILES, "not_felt") for end in ENDS),
    *SINGLE,
    *(name + end for name in ERRORS for end in ENDS),
    "command",
)


def command(point: Point) -> str:
    task = point.task
    return (
        f'contactfpga study chart --method "{task.method}" --family {task.family} --placements {task.count} '
        f"--seed {task.seed}"
    )


def write(points: Iterable[Point], path: Path) -> None:
    """A line per point: times in us and errors with intervals, LUT4 and clock on the UP5K."""
    with replaced(path) as new, open(new, "w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, FIELDS, lineterminator="\n")
        table.writeheader()
        for point in points:
            table.writerow(_line(point))


def _line(point: Point) -> dict[str, object]:
    task, times = point.task, point.times
    line: dict[str, object] = {
        "family": task.family,
        "method": task.method,
        "placements": task.count,
        "seed": task.seed,
        "command": command(point),
        "bytes": f"{times.bytes:.1f}",
        "lower_bound_us": f"{times.lower_bound_us:.1f}",
        "host_us": f"{point.host_us:.1f}",
    }
    line |= {name: "" if (value := getattr(point, name)) is None else f"{value:g}" for name in SINGLE[3:]}
    for name in QUANTILES:
        line |= _fields(name, getattr(times, name), ".1f")
    for kind in KINDS:
        for name in METRICS:
            line |= _fields(f"{kind}_{name}", point.errors[kind][name], ".6g")
    return line | _fields("not_felt", times.not_felt, ".6g")


def _fields(name: str, found: Interval | Quantile, form: str) -> dict[str, object]:
    *values, count = dataclasses.astuple(found)
    return dict(zip((name + end for end in ENDS), (*(format(value, form) for value in values), count), strict=True))


def read(path: Path, methods: Mapping[str, Method] = METHODS) -> list[Point]:
    """The rounded points of :func:`write`."""
    with open(path, newline="", encoding="utf-8") as file:
        return [_point(line, methods) for line in csv.DictReader(file)]


def _point(line: dict[str, str], methods: Mapping[str, Method]) -> Point:
    method = line["method"]
    task = Task(method, *methods[method], line["family"], int(line["placements"]), int(line["seed"]))
    errors = {kind: {name: Interval(*_values(line, f"{kind}_{name}")) for name in METRICS} for kind in KINDS}
    times = Times(
        **{name: Quantile(*_values(line, name)) for name in QUANTILES},
        not_felt=Interval(*_values(line, "not_felt")),
        bytes=float(line["bytes"]),
        lower_bound_us=float(line["lower_bound_us"]),
    )
    return Point(task, errors, times, int(line["luts"]) if line["luts"] else None, float(line["host_us"]))


def _values(line: dict[str, str], name: str) -> tuple[float, float, float, int]:
    value, low, high, count = (float(line[name + end]) for end in ENDS)
    return value, low, high, int(count)
