"""Assignment of contacts to zones with the least total cost."""

from __future__ import annotations

import math
from collections.abc import Sequence

Costs = Sequence[Sequence[float]]
"""A row per contact, a column per zone; infinite for impossible pairs."""


def assign(costs: Costs, alone: float) -> list[int | None]:
    """Column of each row, or None, with the least sum of pair costs plus ``alone`` for each row without a column."""
    found: list[int | None] = [None] * len(costs)
    for rows, columns in _groups(costs):
        if len(rows) == 1:
            column = min(columns, key=costs[rows[0]].__getitem__)
            if costs[rows[0]][column] < alone:
                found[rows[0]] = column
        else:
            chosen = _optimal([[costs[row][column] for column in columns] for row in rows], alone)
            for row, place in zip(rows, chosen):
                found[row] = None if place is None else columns[place]
    return found


def _groups(costs: Costs) -> list[tuple[list[int], list[int]]]:
    groups: list[tuple[list[int], set[int]]] = []
    for row, line in enumerate(costs):
        rows, columns = [row], {column for column, cost in enumerate(line) if cost < math.inf}
        apart = []
        for group in groups:
            if columns.isdisjoint(group[1]):
                apart.append(group)
            else:
                rows, columns = group[0] + rows, columns | group[1]
        groups = [*apart, (rows, columns)]
    return [(rows, sorted(columns)) for rows, columns in groups if columns]


def _optimal(costs: Costs, alone: float) -> list[int | None]:
    """The Hungarian method by shortest augmenting paths, with an additional column per row of cost ``alone``."""
    size, real = len(costs), len(costs[0])
    padded = [
        [*line, *(alone if other == row else math.inf for other in range(size))] for row, line in enumerate(costs)
    ]
    width = real + size
    of_row, of_column = [0.0] * size, [0.0] * width  # the dual prices
    taken: list[int | None] = [None] * width
    for start in range(size):
        least, before, done = [math.inf] * width, [-1] * width, [False] * width
        row: int | None = start
        column = -1
        while row is not None:
            nearest, step = -1, math.inf
            for other in range(width):
                if done[other]:
                    continue
                reduced = padded[row][other] - of_row[row] - of_column[other]
                if reduced < least[other]:
                    least[other], before[other] = reduced, column
                if least[other] < step:
                    nearest, step = other, least[other]
            of_row[start] += step
            for other in range(width):
                if done[other]:
                    of_row[taken[other]] += step  # type: ignore[index]
                    of_column[other] -= step
                else:
                    least[other] -= step
            column = nearest
            done[column] = True
            row = taken[column]
        while column >= 0:
            earlier = before[column]
            taken[column] = start if earlier < 0 else taken[earlier]
            column = earlier
    found: list[int | None] = [None] * size
    for column, row in enumerate(taken[:real]):
        if row is not None:
            found[row] = column
    return found
