"""Zones by flood fill over the whole frame."""

from __future__ import annotations

import numpy as np

EDGES = ((-1, 0), (1, 0), (0, -1), (0, 1))
CORNERS = ((-1, -1), (-1, 1), (1, -1), (1, 1))


def flood(cells: np.ndarray, connectivity: int) -> tuple[np.ndarray, int]:
    """Label the connected pieces of an (R, C) bool array.

    Returns an (R, C) int array, 0 where nothing is pressed and 1 to n elsewhere, and n. Pieces are numbered
    in the order of their first cell.
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
    """Area, sum x and sum y, in cells, of the cells that carry the label ``zone``."""
    y, x = np.nonzero(labels == zone)
    return len(x), int(x.sum()), int(y.sum())


def zones(cells: np.ndarray, connectivity: int) -> list[tuple[int, int, int]]:
    """Area, sum x, sum y of every zone of an (R, C) bool frame, sorted."""
    labels, count = flood(np.asarray(cells, bool), connectivity)
    return sorted(moments(labels, zone) for zone in range(1, count + 1))
