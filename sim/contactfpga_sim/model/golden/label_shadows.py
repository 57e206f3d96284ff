"""What the labellers `projection` and `single` take for zones, and when they emit them (docs/timing.md)."""

from __future__ import annotations

import numpy as np

from contactfpga_sim.model.golden.work import Departure, LabellerRule, Labelling


def projection(cells: np.ndarray, connectivity: int = 8) -> Labelling:
    """Zones of an (R, C) bool frame by their shadows: bands of rows, and runs of columns within a band.
    ``connectivity`` makes no difference."""
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
    """All pressed cells of an (R, C) bool frame as one zone. ``connectivity`` makes no difference."""
    rows, columns = cells.shape
    any_pressed = bool(cells.any())
    walks = [*np.any(cells[:-1], axis=1).tolist(), any_pressed]
    departures = [Departure(rows - 1, columns + 2, *_moments(cells))] if any_pressed else []
    return _work(walks, columns + 1, departures)


def _work(walks: list[bool], clocks: int, departures: list[Departure]) -> Labelling:
    """A row that is walked takes this many clocks more; the end mark comes three clocks after the last row's walk."""
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
