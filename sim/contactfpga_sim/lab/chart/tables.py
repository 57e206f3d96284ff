"""The tables of the chart's page."""

from __future__ import annotations

import bisect
from pathlib import Path

import numpy as np

from contactfpga.skin import Skin
from contactfpga_sim.lab import pool, writer
from contactfpga_sim.lab.chart import front_picture, host, numbers, picture, speed
from contactfpga_sim.lab.chart.compute import FAMILIES_DRAWN, Point, Task, front, study
from contactfpga_sim.lab.chart.methods import METHODS

NUMBERS = Path("docs/chart/chart.csv")
"""Of the chart that the page shows."""

PLACEMENTS = 1000
"""Scenes of each point."""

SHEETS = (16, 32, 64)


def compute() -> list[Point]:
    """Every point of the chart, as the file of its numbers has it."""
    tasks = [Task(method, skin, family, PLACEMENTS, 0) for family in FAMILIES_DRAWN for method, skin in METHODS.items()]
    with pool.executor() as executor, pool.progress() as step:
        points = [host.timed(point) for point in study(tasks, executor, True, step)]
    numbers.write(points, NUMBERS)
    return numbers.read(NUMBERS)


def draw(folder: Path, points: list[Point]) -> list[Path]:
    """The chart, and the README's picture."""
    chart, small = folder.parent / "chart", folder / "front.svg"
    picture.save(points, chart)
    front_picture.save(points, small)
    return [chart / "chart.svg", small]


def front_table(points: list[Point]) -> str:
    """The methods of each family that no other beats in the time and in the share of scenes miscounted."""
    head = ("family", "method", "touch to zones, median / worst", "miscounted", "barycenter", "area", "LUT4")
    lines: list[str] = []
    for family in dict.fromkeys(point.task.family for point in points):
        some = [point for point in points if point.task.family == family]
        best = front(
            [(point.speed.median_us + point.host_us, point.errors["total"]["miscounted"].mean) for point in some]
        )
        lines += [_line(some[index]) for index in best]
    return writer.table(head, lines)


def _line(point: Point) -> str:
    found = point.errors["total"]
    count, place, area = found["miscounted"], found["barycenter_mm"], found["area"]
    times = (point.speed.median_us + point.host_us, point.speed.worst_us + point.host_us)
    cells = (
        point.task.family,
        point.task.method,
        "{:.0f} / {:.0f} us".format(*times),
        f"{100 * count.mean:.1f} % ({100 * count.low:.1f} to {100 * count.high:.1f})",
        f"{place.mean:.2f} mm",
        f"{100 * area.mean:.0f} %",
        f"{point.luts:,}" if point.luts else "",
    )
    return writer.line(cells)


def host_table() -> str:
    """Zones from the board against cells labelled on the host: by sheet and number of touched places."""
    head = ("sheet", "contacts", "zones from the board", "cells to the host", "labelled there in", "faster")
    lines = []
    for size in SHEETS:
        skin = Skin(rows=size, columns=size, settle_us=9.0 if size == 64 else 5.0)
        most = min(size * size // 4, skin.derived.max_items)
        # Zones take longer the more there are, cells do not.
        even = bisect.bisect_left(range(1, most + 1), 0.0, key=lambda count: _later(skin, count)) + 1
        for count in sorted({1, 5, even - 1, even, most} & set(range(1, most + 1))):
            lines.append(_rival_line(skin, count))
    return writer.table(head, lines)


def _later(skin: Skin, count: int) -> float:
    """Microseconds by which the zones of this many contacts come later from the board than from the host."""
    cells = _contacts(skin, count)
    return _frame(skin, cells)[0] - _frame(skin.replace(report="cells"), cells)[0] - host.label_us([cells], 8)


def _rival_line(skin: Skin, count: int) -> str:
    cells = _contacts(skin, count)
    board_us, board_bytes = _frame(skin, cells)
    cells_us, cells_bytes = _frame(skin.replace(report="cells"), cells)
    label_us = host.label_us([cells], 8)
    faster = "board" if board_us < cells_us + label_us else "host"
    times = (f"{board_us:.0f} us, {board_bytes} bytes", f"{cells_us:.0f} us, {cells_bytes} bytes", f"{label_us:.0f} us")
    return writer.line((f"{skin.rows}x{skin.columns}", str(count), *times, faster))


def _contacts(skin: Skin, count: int) -> np.ndarray:
    """(R, C) bool: switches that do not touch each other, spread over the sheet."""
    cells = np.zeros((skin.rows, skin.columns), bool)
    rows, columns = (skin.rows + 1) // 2, (skin.columns + 1) // 2
    chosen = np.linspace(0, rows * columns - 1, count).round().astype(int)
    cells[2 * (chosen // columns), 2 * (chosen % columns)] = True
    return cells


def _frame(skin: Skin, cells: np.ndarray) -> tuple[float, int]:
    """From a frame's first row time to its last byte in us, and its bytes."""
    _, size = speed.touch(skin, cells, 0.5)
    return speed.frame_clocks(skin, cells, size) * 1e6 / skin.clock_hz, size
