"""Zones of a bitmap, found on the host: with ``report = "cells"`` the board sends none."""

from __future__ import annotations

import numpy as np


def label(cells: np.ndarray, connectivity: int) -> np.ndarray:
    """(rows, columns) int64: zone of each pressed cell, from 1 in the order of first cells; otherwise 0.

    ``connectivity``: 8 joins cells that share a corner, 4 only those that share an edge.
    """
    reach = 1 if connectivity == 8 else 0
    runs: list[tuple[int, int, int]] = []  # row, first column, column after the last one
    parents: list[int] = []
    above: list[int] = []
    for row, line in enumerate(np.asarray(cells, bool)):
        edges = np.flatnonzero(np.diff(line, prepend=False, append=False)).tolist()
        current = []
        for start, end in zip(edges[::2], edges[1::2]):
            run = len(runs)
            runs.append((row, start, end))
            parents.append(run)
            current.append(run)
            for other in above:
                if runs[other][1] < end + reach and start < runs[other][2] + reach:
                    _join(parents, other, run)
        above = current
    labels = np.zeros(np.shape(cells), np.int64)
    numbers: dict[int, int] = {}
    for run, (row, start, end) in enumerate(runs):
        root = _root(parents, run)
        labels[row, start:end] = numbers.setdefault(root, len(numbers) + 1)
    return labels


def moments(labels: np.ndarray) -> np.ndarray:
    """(n, 3) int64 area, sum x and sum y of each zone of :func:`label`."""
    y, x = np.nonzero(labels)
    number = labels[y, x] - 1
    sums = np.zeros((int(labels.max(initial=0)), 3), np.int64)
    np.add.at(sums, number, np.column_stack([np.ones_like(x), x, y]))
    return sums


def _root(parents: list[int], run: int) -> int:
    while parents[run] != run:
        parents[run] = parents[parents[run]]
        run = parents[run]
    return run


def _join(parents: list[int], one: int, other: int) -> None:
    first, second = sorted((_root(parents, one), _root(parents, other)))
    parents[second] = first
