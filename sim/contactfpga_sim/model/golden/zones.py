"""Zones by flood fill on a frame or a cylinder, and a labeller's golden rule."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

EDGES = ((-1, 0), (1, 0), (0, -1), (0, 1))
CORNERS = ((-1, -1), (-1, 1), (1, -1), (1, 1))


def flood(cells: np.ndarray, connectivity: int) -> tuple[np.ndarray, int]:
    """Label the connected pieces of an (R, C) bool array.

    Returns an (R, C) int array, 0 where nothing is pressed, else 1 to n in order of the pieces' first cells, and n.
    """
    rows, columns = cells.shape
    steps = EDGES + (CORNERS if connectivity == 8 else ())
    labels = np.zeros((rows, columns), int)
    count = 0
    for seed in zip(*map(np.ndarray.tolist, np.nonzero(cells)), strict=True):
        if labels[seed]:
            continue
        count += 1
        labels[seed] = count
        todo = [seed]
        while todo:
            y, x = todo.pop()
            for dy, dx in steps:
                place = (y + dy, x + dx)
                if 0 <= place[0] < rows and 0 <= place[1] < columns and cells[place] and not labels[place]:
                    labels[place] = count
                    todo.append(place)
    return labels, count


def moments(labels: np.ndarray, zone: int) -> tuple[int, int, int]:
    """Area, sum x and sum y, in cells, of a label's cells."""
    y, x = np.nonzero(labels == zone)
    return len(x), int(x.sum()), int(y.sum())


def extent(labels: np.ndarray, zone: int) -> tuple[int, int, int, int]:
    """Smallest and largest column, smallest and largest row, of a label's cells."""
    y, x = np.nonzero(labels == zone)
    return int(x.min()), int(x.max()), int(y.min()), int(y.max())


def zones(cells: np.ndarray, connectivity: int) -> list[tuple[int, int, int]]:
    """Area, sum x, sum y of every zone of an (R, C) bool frame, sorted."""
    labels, count = flood(np.asarray(cells, bool), connectivity)
    return sorted(moments(labels, zone) for zone in range(1, count + 1))


def closed_flood(cells: np.ndarray, connectivity: int) -> tuple[np.ndarray, list[int]]:
    """Label the connected pieces where the last column is a neighbor of the first.

    Returns an (R, C) int array as :func:`flood`, and :func:`turned` of each piece.
    """
    labels, pieces = closed_pieces(cells, connectivity)
    return labels, [past for past, _ in pieces]


def closed_pieces(cells: np.ndarray, connectivity: int) -> tuple[np.ndarray, list[tuple[int, tuple[int, int]]]]:
    """As :func:`closed_flood`, and beside each :func:`turned` the first and last column of the piece, counted from left
    to right over the seam: all columns if the piece goes all the way around."""
    columns = cells.shape[1]
    labels = np.zeros(cells.shape, int)
    pieces: list[tuple[int, tuple[int, int]]] = []
    for y, x in zip(*map(np.ndarray.tolist, np.nonzero(cells)), strict=True):
        if not labels[y, x]:
            unrolled, ring = _unroll(cells, connectivity, (y, x))
            for row, column in unrolled:
                labels[row, column] = len(pieces) + 1
            first, last = min(unrolled.values()), max(unrolled.values())
            whole = ring or last - first >= columns
            span = (0, columns - 1) if whole else (first % columns, last % columns)
            pieces.append((turned([place // columns for place in unrolled.values()], ring, cells.size), span))
    return labels, pieces


def turned(turns: list[int], ring: bool, most: int) -> int:
    """Number of a piece's cells on the upper of its two turns; for a ring its area; for more than two turns all ones,
    in the bits of the sheet's cell count."""
    lowest = min(turns)
    if ring:
        return len(turns)
    if max(turns) - lowest > 1:
        return int("1" * len(f"{most:b}"), 2)
    return sum(turn - lowest for turn in turns)


def _unroll(cells: np.ndarray, connectivity: int, seed: tuple[int, int]) -> tuple[dict[tuple[int, int], int], bool]:
    """A piece's cells, with columns counted on past the seam, and whether the piece closes around."""
    rows, columns = cells.shape
    unrolled = {seed: seed[1]}
    todo = [(seed[0], seed[1])]
    ring = False
    while todo:
        y, place = todo.pop()
        for dy, dx in EDGES + (CORNERS if connectivity == 8 else ()):
            cell = (y + dy, (place + dx) % columns)
            if not (0 <= y + dy < rows and cells[cell]):
                continue
            if cell not in unrolled:
                unrolled[cell] = place + dx
                todo.append((y + dy, place + dx))
            ring |= unrolled[cell] != place + dx
    return unrolled, ring


@dataclasses.dataclass(frozen=True)
class Departure:
    """Zone that leaves this many clocks after the handover of row ``row``."""

    row: int
    clock: int
    area: int
    sum_x: int
    sum_y: int
    turned: int = 0
    """:func:`turned` of the zone on a closed sheet."""
    extent: tuple[int, int, int, int] = (0, 0, 0, 0)
    """:func:`extent` of the zone; on a closed sheet with the columns of :func:`closed_pieces`."""


@dataclasses.dataclass(frozen=True)
class Labelling:
    """Work of a labeller on one frame."""

    busy: tuple[int, ...]
    """Clocks from each row to the next handover."""
    end: int
    """Clocks from the last row to the end mark."""
    departures: tuple[Departure, ...]


Strips = Callable[[np.ndarray, int], tuple[np.ndarray, np.ndarray, np.ndarray]]


@dataclasses.dataclass(frozen=True)
class LabellerRule:
    """The golden rule of a labeller."""

    frame: Callable[[np.ndarray, int], Labelling]
    """Function from (R, C) bool cells and connectivity to the work."""
    strips: Strips | None = None
    """Function from (N, R, C) bool frames and connectivity to the clocks of every row, for volume tests: departure of a
    zone by its last cluster's cells, next row, and end mark; (N, R, C), (N, R) and (N, R) int64. Exact labellers
    only."""
    closed: LabellerRule | None = None
    """The rule for closed sheets; None: unsupported."""
