"""When the labeller lets its zones out: the cluster and step rule of docs/timing.md, on geometry alone."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from contactfpga_sim.golden.zones import flood, moments


@dataclasses.dataclass(frozen=True)
class Departure:
    """A zone that leaves: while row ``row`` is worked, in its step ``step`` (from 1)."""

    row: int
    step: int
    area: int
    sum_x: int
    sum_y: int


@dataclasses.dataclass(frozen=True)
class Labelling:
    """The labeller's work on one frame."""

    steps: tuple[int, ...]
    """Steps of every row."""
    departures: tuple[Departure, ...]
    """Zones in the order they leave."""


def labelling(cells: np.ndarray, connectivity: int) -> Labelling:
    """Steps and departures for an (R, C) bool frame."""
    cells = np.ascontiguousarray(cells, bool)
    return _labelling(cells.tobytes(), cells.shape, connectivity)


@functools.lru_cache(maxsize=4096)
def _labelling(packed: bytes, shape: tuple[int, int], connectivity: int) -> Labelling:
    cells = np.frombuffer(packed, bool).reshape(shape)
    above = np.vstack([np.zeros((1, shape[1]), bool), cells])
    strips = [cluster_steps(above[y : y + 2], connectivity) for y in range(shape[0])]
    labels, count = flood(cells, connectivity)
    above_labels = np.vstack([np.zeros((1, shape[1]), int), labels])
    departures = []
    for zone in range(1, count + 1):
        row = min(int(np.nonzero(labels == zone)[0].max()) + 1, shape[0] - 1)
        last_step = strips[row][0][above_labels[row : row + 2] == zone].max()
        departures.append(Departure(row, int(last_step), *moments(labels, zone)))
    departures.sort(key=lambda zone: (zone.row, zone.step))
    places = [(zone.row, zone.step) for zone in departures]
    assert len(set(places)) == len(places), "two zones would leave in one step"
    return Labelling(tuple(steps for _, steps in strips), tuple(departures))


def cluster_steps(strip: np.ndarray, connectivity: int) -> tuple[np.ndarray, int]:
    """For the (2, C) cells of two adjacent rows: the last step of each cell's cluster, and all steps.

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
