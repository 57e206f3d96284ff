"""Tables of the chart's page."""

from __future__ import annotations

import bisect
import math
from pathlib import Path

import numpy as np

from contactfpga.skin import Skin
from contactfpga_sim.apps import pool, speed
from contactfpga_sim.apps.score import Interval
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.chart import host, numbers, times_picture
from contactfpga_sim.lab.chart.compute import (
    FAMILIES_DRAWN,
    FAMILY,
    Point,
    Task,
    covered,
    front,
    in_all,
    reached_us,
    study,
)
from contactfpga_sim.lab.chart.methods import METHODS, SHEETS

NUMBERS = Path("docs/chart/chart.csv")

PLACEMENTS = 400

SIDES = (16, 32, 64)


def compute() -> list[Point]:
    """All methods with one family, and with the others those that differ in the sheet."""
    tasks = [
        Task(name, *method, family, PLACEMENTS, 0)
        for family in FAMILIES_DRAWN
        for name, method in METHODS.items()
        if family == FAMILY or name in SHEETS
    ]
    with pool.executor() as executor, pool.progress() as step:
        points = study(tasks, executor, True, step)
    numbers.write(map(host.timed, points), NUMBERS)
    return numbers.read(NUMBERS)


def draw(folder: Path, points: list[Point]) -> list[Path]:
    return [times_picture.save(points, folder.parent / "chart" / "times.svg")]


COMPARED = [f"{name}, 6.4 mm, tiles" for name in ("run", "serial", "projection", "cells", "reversal")]
KITS = COMPARED[0]
COVERS = [f"run, 6.4 mm, {cover}" for cover in ("tiles", "caps", "paper")]
"""Rows that the page shows of all methods, and of all families."""

HEAD = (
    "touch of the foam to last byte, median / 95 %",
    "not felt",
    "electronics alone",
    "miscounted",
    "missed",
    "barycenter of found",
    "area of found",
)


def front_table(points: list[Point]) -> writer.Table:
    """Per family the kits' design, then the covered methods that are Pareto-optimal in time and miscounts."""
    rows = []
    for family in dict.fromkeys(point.task.family for point in points):
        some = [point for point in points if point.task.family == family and covered(point.task)]
        best = front([(reached_us(point), point.errors["total"]["miscounted"].mean) for point in some])
        shown = [point for point in some if point.task.method == KITS]
        shown += [some[index] for index in best if some[index] not in shown]
        rows += [(family, _name(point), *_cells(point)) for point in shown]
    columns = ("family", HEAD[0], "miscounted", "barycenter of found")
    return writer.Table(("family", "method", *HEAD), rows, lambda row: row[1].startswith("**"), columns)


def methods_table(points: list[Point]) -> writer.Table:
    some = [point for point in points if point.task.family == FAMILY]
    rows = [(_name(point), *_cells(point), f"{point.luts:,}" if point.luts else "") for point in some]
    columns = ("method", HEAD[0], "electronics alone", "miscounted", "barycenter of found", "LUT4")
    return writer.Table(("method", *HEAD, "LUT4"), rows, lambda row: row[0].strip("*") in COMPARED, columns)


def families_table(points: list[Point]) -> writer.Table:
    """Miscounts and missed contacts by family; equal methods share a line."""
    families = list(dict.fromkeys(point.task.family for point in points))
    by = {(point.task.method, point.task.family): point for point in points}
    rows: dict[object, tuple[str, ...]] = {}
    for method in in_all(points):
        some = [by[method, family] for family in families]
        found = [point.errors["total"] for point in some]
        shares = [f"{_percent(one['miscounted'])}; {100 * one['missed'].mean:.1f} %" for one in found]
        alike = (some[0].task.skin.pitch_x_mm, some[0].task.cover, *shares)
        rows.setdefault(alike, (_name(some[0]), *shares))
    return writer.Table(("miscounted; missed", *families), list(rows.values()), lambda row: row[0].strip("*") in COVERS)


def _name(point: Point) -> str:
    return f"**{point.task.method}**" if point.task.method == KITS else point.task.method


def _cells(point: Point) -> tuple[str, ...]:
    found, times = point.errors["total"], point.times
    electric = [f"{one.value + point.host_us:.0f}" for one in (times.electric_median_us, times.electric_q95_us)]
    touch = " / ".join(_ms(one.value + point.host_us) for one in (times.touch_median_us, times.touch_q95_us))
    return (
        f"{touch} ({_ms(times.touch_q95_us.low)} to {_ms(times.touch_q95_us.high)})"
        if covered(point.task)
        else "at once",
        f"{100 * times.not_felt.mean:.0f} %",
        f"{' / '.join(electric)} us",
        _percent(found["miscounted"]),
        f"{100 * found['missed'].mean:.1f} %",
        f"{found['barycenter_mm'].mean:.2f} mm",
        f"{100 * found['area'].mean:.0f} %",
    )


def _ms(us: float) -> str:
    return "never" if math.isinf(us) else f"{us / 1e3:.1f} ms"


def _percent(share: Interval) -> str:
    return f"{100 * share.mean:.1f} % ({100 * share.low:.1f} to {100 * share.high:.1f})"


def host_table() -> writer.Table:
    """The page shows the least count for which the host is faster, for each sheet."""
    rows, shown = [], []
    for size in SIDES:
        skin = Skin(rows=size, columns=size, settle_us=9.0 if size == 64 else 5.0)
        most = min(size * size // 4, skin.derived.max_items)
        # Zones take longer the more there are, cells do not.
        even = bisect.bisect_left(range(1, most + 1), 0.0, key=lambda count: _later(skin, count)) + 1
        for count in sorted({1, 5, even - 1, even, most} & set(range(1, most + 1))):
            rows.append(_rival_row(skin, count))
            shown += [rows[-1]] if count == even else []
    head = ("sheet", "contacts", "zones from the board", "cells to the host", "labelled there in", "faster")
    return writer.Table(head, rows, lambda row: row in shown, head[:4])


def _later(skin: Skin, count: int) -> float:
    cells = _contacts(skin, count)
    return _frame(skin, cells)[0] - _frame(skin.replace(report="cells"), cells)[0] - host.label_us([cells], 8)


def _rival_row(skin: Skin, count: int) -> tuple[str, ...]:
    cells = _contacts(skin, count)
    board_us, board_bytes = _frame(skin, cells)
    cells_us, cells_bytes = _frame(skin.replace(report="cells"), cells)
    label_us = host.label_us([cells], 8)
    faster = "board" if board_us < cells_us + label_us else "host"
    times = (f"{board_us:.0f} us, {board_bytes} bytes", f"{cells_us:.0f} us, {cells_bytes} bytes", f"{label_us:.0f} us")
    return (f"{skin.rows}x{skin.columns}", str(count), *times, faster)


def _contacts(skin: Skin, count: int) -> np.ndarray:
    cells = np.zeros((skin.rows, skin.columns), bool)
    rows, columns = (skin.rows + 1) // 2, (skin.columns + 1) // 2
    chosen = np.linspace(0, rows * columns - 1, count).round().astype(int)
    cells[2 * (chosen // columns), 2 * (chosen % columns)] = True
    return cells


def _frame(skin: Skin, cells: np.ndarray) -> tuple[float, int]:
    """Microseconds from first row time to last byte, and bytes."""
    _, size = speed.touch(skin, cells, 0.5)
    return speed.frame_clocks(skin, cells, size) * 1e6 / skin.clock_hz, size
