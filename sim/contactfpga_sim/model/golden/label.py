"""When a labeller emits its zones: the end of a zone is geometry; the clocks are the labeller's rule in docs/timing.md:
clusters and steps of ``run``, columns of ``serial``. The inexact labellers ``projection`` and ``single`` define zones
their own way."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np

from contactfpga.choices import labellers
from contactfpga.choices.labellers import Labeller, LabellerName
from contactfpga_sim.model.golden import volume
from contactfpga_sim.model.golden.zones import Departure, LabellerRule, Labelling, closed_flood, flood, moments

StripClocks = Callable[[np.ndarray, int], tuple[np.ndarray, int, int]]


def labelling(
    cells: np.ndarray, connectivity: int, labeller: LabellerName | Labeller = "run", closed: bool = False
) -> Labelling:
    """Clocks and departures for an (R, C) bool frame."""
    cells = np.ascontiguousarray(cells, bool)
    return _labelling(cells.tobytes(), cells.shape, connectivity, labellers.find(labeller), closed)


@functools.lru_cache(maxsize=4096)
def _labelling(packed: bytes, shape: tuple[int, int], connectivity: int, labeller: Labeller, closed: bool) -> Labelling:
    cells = np.frombuffer(packed, bool).reshape(shape)
    rule: LabellerRule | None = labeller.load_golden()
    rule = rule.closed if rule is not None and closed else rule
    assert rule is not None, f"{labeller.name} has no rule for a sheet whose ends meet"
    return rule.frame(cells, connectivity)


def exact(cells: np.ndarray, connectivity: int, strip_clocks: StripClocks, closed: bool = False) -> Labelling:
    """An exact labeller's work on an (R, C) bool frame; ``strip_clocks``: its rule for two adjacent rows."""
    shape = cells.shape
    above = np.vstack([np.zeros((1, shape[1]), bool), cells])
    strips = [strip_clocks(above[y : y + 2], connectivity) for y in range(shape[0])]
    labels, turned = closed_flood(cells, connectivity) if closed else _on_a_plane(cells, connectivity)
    above_labels = np.vstack([np.zeros((1, shape[1]), int), labels])
    departures = []
    for zone in range(1, len(turned) + 1):
        row = min(int(np.nonzero(labels == zone)[0].max()) + 1, shape[0] - 1)
        clock = strips[row][0][above_labels[row : row + 2] == zone].max()
        departures.append(Departure(row, int(clock), *moments(labels, zone), turned[zone - 1]))
    departures.sort(key=lambda zone: (zone.row, zone.clock))
    places = [(zone.row, zone.clock) for zone in departures]
    assert len(set(places)) == len(places), "two zones would leave in one clock"
    return Labelling(tuple(busy for _, busy, _ in strips), strips[-1][2], tuple(departures))


def _on_a_plane(cells: np.ndarray, connectivity: int) -> tuple[np.ndarray, list[int]]:
    labels, count = flood(cells, connectivity)
    return labels, [0] * count


def run_clocks(strip: np.ndarray, connectivity: int) -> tuple[np.ndarray, int, int]:
    """Clocks of the (2, C) cells of two adjacent rows, counted after the one in which the lower was handed over: (C,)
    departure of a zone by its last cluster's cells, the next row, and an end mark."""
    last_step, steps = cluster_steps(strip, connectivity)
    return last_step + 2, steps + 1, steps + 3


def closed_run_clocks(strip: np.ndarray, connectivity: int) -> tuple[np.ndarray, int, int]:
    """:func:`run_clocks` for a sheet whose ends meet: if cells are joined over the seam, one more step joins the last
    cluster with the first."""
    last_step, steps = cluster_steps(strip, connectivity)
    first, last = strip[:, 0], strip[:, -1]
    if first.any() and last.any() if connectivity == 8 else (first & last).any():
        steps += 1
        last_step[:, -1][last] = steps
    return last_step + 2, steps + 1, steps + 3


def cluster_steps(strip: np.ndarray, connectivity: int) -> tuple[np.ndarray, int]:
    """The last step of each cell's cluster in the (2, C) cells of two adjacent rows, and all steps.

    The first is a (2, C) int array, 0 where nothing is pressed.
    """
    labels, count = flood(strip, connectivity)
    clusters = sorted(range(1, count + 1), key=lambda cluster: np.nonzero(labels == cluster)[1].min())
    last_step = np.zeros(strip.shape, int)
    done = 0
    for cluster in clusters:
        done += max(runs(labels[0] == cluster), runs(labels[1] == cluster))
        last_step[labels == cluster] = done
    return last_step, done


def runs(row: np.ndarray) -> int:
    """Runs of adjacent pressed cells in a (C,) bool row."""
    return int(row[0]) + int(np.sum(row[1:] & ~row[:-1]))


def serial_clocks(strip: np.ndarray, connectivity: int) -> tuple[np.ndarray, int, int]:
    """Clocks of the (2, C) cells of two adjacent rows, counted after the one in which the lower was handed over:
    departure of a zone by its last cluster's cells, the next row, and an end mark.

    The first is a (2, C) int array, 0 where nothing is pressed.
    """
    labels, count = flood(strip, connectivity)
    columns = [np.nonzero(labels == cluster)[1] for cluster in range(1, count + 1)]
    first, last = [column.min() for column in columns], [column.max() for column in columns]
    clocks = np.ones(strip.shape[1], int)
    for x in range(strip.shape[1]):
        begins = strip[:, x] & ~(strip[:, x - 1] if x else np.zeros(2, bool))
        right_behind = x in first and x - 1 in last
        clocks[x] += begins[0] or (begins[1] and right_behind)
    done = np.cumsum(clocks)  # the clock of a column's last cell or run
    leaves = np.zeros(strip.shape, int)
    for cluster in range(count):
        leaves[labels == cluster + 1] = done[last[cluster]] + 1
    over = int(done[-1]) + 2
    return leaves, over, over


def closed_serial_clocks(strip: np.ndarray, connectivity: int) -> tuple[np.ndarray, int, int]:
    """:func:`serial_clocks` for a sheet whose ends meet: two clocks more after the last column if cells are joined over
    the seam."""
    leaves, busy, end = serial_clocks(strip, connectivity)
    first, last = strip[:, 0], strip[:, -1]
    seam = 2 if (first.any() and last.any() if connectivity == 8 else (first & last).any()) else 0
    leaves[:, -1][last] += seam
    return leaves, busy + seam, end + seam


def projection(cells: np.ndarray, connectivity: int = 8) -> Labelling:
    """Zones of an (R, C) bool frame by their shadows: bands of rows, and runs of columns within a band, regardless of
    ``connectivity``."""
    rows, columns = cells.shape
    pressed = np.any(cells, axis=1)
    walks = [bool(pressed[y] or (y and pressed[y - 1])) for y in range(rows)]
    departures = []
    for first, past in _runs(pressed):
        closing = min(past, rows - 1)
        for left, right in _runs(np.any(cells[first:past], axis=0)):
            box = np.zeros_like(cells)
            box[first:past, left:right] = cells[first:past, left:right]
            departures.append(Departure(closing, right + 2, *_moments(box)))
    return _work(walks, columns, departures)


def single(cells: np.ndarray, connectivity: int = 8) -> Labelling:
    """All pressed cells of an (R, C) bool frame as one zone, regardless of ``connectivity``."""
    rows, columns = cells.shape
    any_pressed = bool(cells.any())
    walks = [*np.any(cells[:-1], axis=1).tolist(), any_pressed]
    departures = [Departure(rows - 1, columns + 2, *_moments(cells))] if any_pressed else []
    return _work(walks, columns + 1, departures)


def _work(walks: list[bool], clocks: int, departures: list[Departure]) -> Labelling:
    """A frame's work: a walked row needs this many extra clocks; the end mark is three clocks after the last row's
    walk."""
    steps = [clocks if walk else 0 for walk in walks]
    return Labelling(tuple(step + 1 for step in steps), steps[-1] + 3, tuple(departures))


def _runs(line: np.ndarray) -> list[tuple[int, int]]:
    """(first, past the last) of the runs of ones."""
    edges = np.flatnonzero(np.diff(np.pad(line.astype(int), 1)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _moments(cells: np.ndarray) -> tuple[int, int, int]:
    y, x = np.nonzero(cells)
    return len(x), int(x.sum()), int(y.sum())


PROJECTION = LabellerRule(projection)
SINGLE = LabellerRule(single)


RUN = LabellerRule(
    functools.partial(exact, strip_clocks=run_clocks),
    volume.run_clocks,
    LabellerRule(functools.partial(exact, strip_clocks=closed_run_clocks, closed=True), volume.closed_run_clocks),
)
SERIAL = LabellerRule(
    functools.partial(exact, strip_clocks=serial_clocks),
    volume.serial_clocks,
    LabellerRule(
        functools.partial(exact, strip_clocks=closed_serial_clocks, closed=True),
        volume.closed_serial_clocks,
    ),
)
