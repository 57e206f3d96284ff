"""When labellers emit zones (docs/timing.md). ``projection`` and ``single`` define zones of their own."""

from __future__ import annotations

import functools

import numpy as np

from contactfpga.choices import labellers
from contactfpga.choices.labellers import Labeller, LabellerName
from contactfpga_sim.model.golden.zones import (
    Departure,
    LabellerRule,
    Labelling,
    Strips,
    closed_pieces,
    extent,
    flood,
    moments,
)


def labelling(
    cells: np.ndarray, connectivity: int, labeller: LabellerName | Labeller = "run", closed: bool = False
) -> Labelling:
    """A labeller's clocks and departures for an (R, C) bool frame."""
    cells = np.ascontiguousarray(cells, bool)
    return _labelling(cells.tobytes(), cells.shape, connectivity, labellers.find(labeller), closed)


@functools.lru_cache(maxsize=4096)
def _labelling(packed: bytes, shape: tuple[int, int], connectivity: int, labeller: Labeller, closed: bool) -> Labelling:
    cells = np.frombuffer(packed, bool).reshape(shape)
    rule: LabellerRule | None = labeller.load_golden()
    rule = rule.closed if rule is not None and closed else rule
    assert rule is not None, f"{labeller.name} has no rule for a sheet whose ends meet"
    return rule.frame(cells, connectivity)


def exact(cells: np.ndarray, connectivity: int, strips: Strips, closed: bool = False) -> Labelling:
    """Work of an exact labeller on an (R, C) bool frame; ``strips``: its clocks, as ``LabellerRule.strips``."""
    last_clock, busy, end = (clocks[0] for clocks in strips(cells[None], connectivity))
    labels, pieces = closed_pieces(cells, connectivity) if closed else _on_a_plane(cells, connectivity)
    departures = []
    for zone, (turned, span) in enumerate(pieces, 1):
        row = min(int(np.nonzero(labels == zone)[0].max()) + 1, len(cells) - 1)
        columns = (labels[max(row - 1, 0) : row + 1] == zone).any(axis=0)
        clock = int(last_clock[row, columns].max())
        box = (*span, *extent(labels, zone)[2:])
        departures.append(Departure(row, clock, *moments(labels, zone), turned, box))
    departures.sort(key=lambda zone: (zone.row, zone.clock))
    places = [(zone.row, zone.clock) for zone in departures]
    assert len(set(places)) == len(places), "two zones would leave in one clock"
    return Labelling(tuple(busy.tolist()), int(end[-1]), tuple(departures))


def _on_a_plane(cells: np.ndarray, connectivity: int) -> tuple[np.ndarray, list[tuple[int, tuple[int, int]]]]:
    labels, count = flood(cells, connectivity)
    return labels, [(0, extent(labels, zone)[:2]) for zone in range(1, count + 1)]


def run_clocks(frames: np.ndarray, connectivity: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """``LabellerRule.strips`` of ``run``."""
    return _run_clocks(*_strips(frames, connectivity))


def closed_run_clocks(frames: np.ndarray, connectivity: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """``LabellerRule.strips`` of ``run`` on a closed sheet, where one more step joins the last cluster with the
    first."""
    last_step, steps = _strips(frames, connectivity)
    joined = _over_the_seam(frames, connectivity)
    steps = steps + joined
    last_step[..., -1] = np.where(joined, steps, last_step[..., -1])
    return _run_clocks(last_step, steps)


def _run_clocks(last_step: np.ndarray, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Clocks from a row to its last record, to the next row, and to the end mark. The first step is two clocks after
    the row; an empty row below an empty one has no step."""
    busy = steps + 1 + (steps > 0)
    return last_step + 3, busy, busy + 2


def _strips(frames: np.ndarray, connectivity: int) -> tuple[np.ndarray, np.ndarray]:
    """(N, R, C): last step of each column's cluster; (N, R): steps of each row."""
    before = _before(frames)
    taken = frames | before
    none = np.zeros(taken.shape[:2], bool)
    steps, begun = np.zeros(none.shape, int), np.zeros(none.shape, int)
    above, new = begun.copy(), begun.copy()
    reached = np.zeros(frames.shape, int)
    joins = []
    for column in range(frames.shape[2]):
        a, b, here = before[..., column], frames[..., column], taken[..., column]
        a_left, b_left, here_left = (array[..., column - 1] if column else none for array in (before, frames, taken))
        joined = here & here_left if connectivity == 8 else (a & a_left) | (b & b_left)
        joins.append(joined)
        begun = np.where(joined, begun, steps)
        above = np.where(joined, above, 0) + (a & ~a_left)
        new = np.where(joined, new, 0) + (b & ~b_left)
        steps = np.where(here, begun + np.maximum(above, new), steps)
        reached[..., column] = steps
    for column in range(frames.shape[2] - 2, -1, -1):
        reached[..., column] = np.where(joins[column + 1], reached[..., column + 1], reached[..., column])
    return reached, steps


def serial_clocks(frames: np.ndarray, connectivity: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """``LabellerRule.strips`` of ``serial``."""
    above = _before(frames)
    above_left, left = (np.pad(cells, ((0, 0), (0, 0), (1, 0)))[..., :-1] for cells in (above, frames))
    more = above & ~above_left
    if connectivity == 4:
        more |= frames & ~left & above_left & ~above
        joined = frames & left | above & above_left
    else:
        joined = (frames | above) & (left | above_left)
    leaves = np.cumsum(1 + more, axis=2) + 1
    busy = leaves[..., -1] + 1
    for column in range(frames.shape[2] - 2, -1, -1):
        leaves[..., column] = np.where(joined[..., column + 1], leaves[..., column + 1], leaves[..., column])
    return leaves * (frames | above), busy, busy


def closed_serial_clocks(frames: np.ndarray, connectivity: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """``LabellerRule.strips`` of ``serial`` on a closed sheet."""
    leaves, busy, end = serial_clocks(frames, connectivity)
    seam = 2 * _over_the_seam(frames, connectivity)
    leaves[..., -1] += seam * (_before(frames) | frames)[..., -1]
    return leaves, busy + seam, end + seam


def _before(frames: np.ndarray) -> np.ndarray:
    return np.concatenate([np.zeros_like(frames[:, :1]), frames[:, :-1]], axis=1)


def _over_the_seam(frames: np.ndarray, connectivity: int) -> np.ndarray:
    """(N, R) bool: whether a row and the row before are joined over the seam."""
    ends = np.stack([_before(frames)[..., [0, -1]], frames[..., [0, -1]]])  # which row, N, R, first or last column
    return np.asarray(ends.any(axis=0).all(axis=-1) if connectivity == 8 else ends.all(axis=-1).any(axis=0))


def projection(cells: np.ndarray, connectivity: int = 8) -> Labelling:
    """Zones of an (R, C) bool frame by their shadows: bands of rows, and runs of columns within a band.
    ``connectivity`` is ignored."""
    rows, columns = cells.shape
    pressed = np.any(cells, axis=1)
    walks = [bool(pressed[y] or (y and pressed[y - 1])) for y in range(rows)]
    departures = []
    for first, past in _runs(pressed):
        closing = min(past, rows - 1)
        for left, right in _runs(np.any(cells[first:past], axis=0)):
            box = np.zeros_like(cells)
            box[first:past, left:right] = cells[first:past, left:right]
            departures.append(Departure(closing, right + 2, *moments(box, 1)))
    return _work(walks, columns, departures)


def single(cells: np.ndarray, connectivity: int = 8) -> Labelling:
    """All pressed cells of an (R, C) bool frame as one zone. ``connectivity`` is ignored."""
    rows, columns = cells.shape
    any_pressed = bool(cells.any())
    walks = [*np.any(cells[:-1], axis=1).tolist(), any_pressed]
    departures = [Departure(rows - 1, columns + 2, *moments(cells, 1))] if any_pressed else []
    return _work(walks, columns + 1, departures)


def _work(walks: list[bool], clocks: int, departures: list[Departure]) -> Labelling:
    steps = [clocks if walk else 0 for walk in walks]
    return Labelling(tuple(step + 1 for step in steps), steps[-1] + 3, tuple(departures))


def _runs(line: np.ndarray) -> list[tuple[int, int]]:
    """(first, past the last) of each run of ones."""
    edges = np.flatnonzero(np.diff(np.pad(line.astype(int), 1)))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


PROJECTION = LabellerRule(projection)
SINGLE = LabellerRule(single)


def _exact_rule(strips: Strips, closed: Strips) -> LabellerRule:
    around = LabellerRule(functools.partial(exact, strips=closed, closed=True), closed)
    return LabellerRule(functools.partial(exact, strips=strips), strips, around)


RUN = _exact_rule(run_clocks, closed_run_clocks)
SERIAL = _exact_rule(serial_clocks, closed_serial_clocks)
