"""Zones of a sheet whose ends meet: columns counted on past the seam, and zones without an x.

Records have a fourth number, the zone's cells past the seam relative to the others. If this is the area, the zone is a
``ring``: a path of its cells closes around the cylinder. If it is more, the zone is ``wound``: its cells are on more
than two turns. Such a zone has a y but no x.
"""

from __future__ import annotations

import numpy as np

WINDINGS = ("", "ring", "wound")
"""Names of the values of :func:`windings`; "" is an ordinary zone."""

Run = tuple[int, int, int]
"""Row, first column, and column after the last one."""


def windings(records: np.ndarray) -> np.ndarray:
    """(n,) int64 indexes in :data:`WINDINGS` of (n, 4) records."""
    area, turned = records[:, 0], records[:, 3]
    found: np.ndarray = np.where(area == 0, 0, (turned >= area).astype(np.int64) + (turned > area))
    return found


def flat(records: np.ndarray, columns: int) -> np.ndarray:
    """(n, 3) int64 area and sums of (n, 4) records, with columns counted on past the seam, so that x is from 0 to
    ``columns``."""
    area, sum_x, sum_y, turned = records.T
    around = columns * np.maximum(area, 1)
    unwrapped = (sum_x + columns * turned) % around
    return np.stack([area, np.where(windings(records) > 0, sum_x, unwrapped), sum_y], axis=1)


def across(distance: float, around: float | None) -> float:
    """A distance along x, the shorter way around; ``around``: circumference, or None for an open sheet."""
    return distance if around is None else (distance + around / 2) % around - around / 2


def label(cells: np.ndarray, connectivity: int) -> tuple[np.ndarray, np.ndarray]:
    """The result of :func:`contactfpga.zones.labels.label`, and (n, 4) records of the zones."""
    runs = _runs(cells)
    neighbors = _neighbors(runs, cells.shape[1], connectivity)
    turns: dict[int, int] = {}
    numbers = np.zeros(cells.shape, np.int64)
    records: list[tuple[int, int, int, int]] = []
    for seed in range(len(runs)):
        if seed in turns:
            continue
        found, ring = _spread(seed, neighbors, turns)
        for run in found:
            row, start, end = runs[run]
            numbers[row, start:end] = len(records) + 1
        records.append(_record([runs[run] for run in found], [turns[run] for run in found], ring))
    return numbers, np.array(records, np.int64).reshape(-1, 4)


def _runs(cells: np.ndarray) -> list[Run]:
    runs = []
    for row, line in enumerate(np.asarray(cells, bool)):
        edges = np.flatnonzero(np.diff(line, prepend=False, append=False)).tolist()
        runs += [(row, start, end) for start, end in zip(edges[::2], edges[1::2])]
    return runs


def _neighbors(runs: list[Run], columns: int, connectivity: int) -> list[list[tuple[int, int]]]:
    reach = 1 if connectivity == 8 else 0
    found: list[list[tuple[int, int]]] = [[] for _ in runs]
    of_row: dict[int, list[int]] = {}
    for index, (row, start, end) in enumerate(runs):
        of_row.setdefault(row, []).append(index)
        near = [(other, turn, reach) for other in of_row.get(row - 1, []) for turn in (-1, 0, 1)]
        near += [(other, turn, 1) for other in of_row[row] for turn in (-1, 1)]  # in its own row over the seam
        for other, turn, gap in near:
            _, first, past = runs[other]
            if first + turn * columns < end + gap and start < past + turn * columns + gap:
                found[index].append((other, turn))
                found[other].append((index, -turn))
    return found


def _spread(seed: int, neighbors: list[list[tuple[int, int]]], turns: dict[int, int]) -> tuple[list[int], bool]:
    """The runs of a zone, and whether they close around; adds their turns."""
    turns[seed] = 0
    found, ring = [seed], False
    for run in found:
        for other, turn in neighbors[run]:
            if other not in turns:
                turns[other] = turns[run] + turn
                found.append(other)
            ring |= turns[other] != turns[run] + turn
    return found, ring


def _record(runs: list[Run], turns: list[int], ring: bool) -> tuple[int, int, int, int]:
    lengths = [end - start for _, start, end in runs]
    area, lowest = sum(lengths), min(turns)
    turned = sum(length for length, turn in zip(lengths, turns) if turn > lowest)
    if ring or max(turns) - lowest > 1:
        turned = area if ring else area + 1
    sum_x = sum((start + end - 1) * (end - start) // 2 for _, start, end in runs)
    return area, sum_x, sum(row * length for (row, _, _), length in zip(runs, lengths)), turned
