"""Touches cell by cell, and the table that places contacts by the times at which cells close."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import numpy as np

from contactfpga.design.cover import Cells, Cover, cells_of
from contactfpga.design.cover.numerics import Floats
from contactfpga.skin import Skin
from contactfpga.skin.sheet import Sheet
from contactfpga.tracking.growth import Closing, Growth, Moments
from contactfpga.tracking.places import SPREADS, TOO_FEW, Places, Row, Spread
from contactfpga_sim.model.scenes.contacts import M
from contactfpga_sim.model.scenes.families import touches
from contactfpga_sim.model.scenes.scene import Scene

STEPS = 20
"""Moments of a rise at which forces are computed. Between them each is linear in time."""

FITTED, FLAT = ("finger", "bumper"), "edge"
"""Families of touches that a table is fitted to, and one whose cells close as their forces are spread."""

CELLS = (1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 14, 18, 23, 30, 40, 55, 75, 100)
"""Least cells of a row."""

FEWEST, FEWEST_SETTLED = 100, 40
"""States from which a row is fitted, and a spread of settled ones. With fewer these have that of the others."""

CHI2_95 = -2 * math.log(0.05)
"""Squared distance, over the variance along each axis, that 95 % of places in a plane keep."""

FARTHEST = 0.99
"""Share of the states whose place lies within :attr:`Row.reach_mm` of the barycenter."""

ON_SHEET = 0.02
"""Pitches by which a contact's place may differ from that of its part on the sheet."""

FLATTEST = 0.95
"""Share of the states of flat bodies whose times say nothing."""

LEAST_MM2 = 1e-6
"""Added to squared errors, so that each has a logarithm."""

NO_SPREADS = (Spread(0.0, 0.0),) * SPREADS

ROUNDS = 60
"""Weighted least squares that lead to a line of quantiles."""

Place = tuple[float, float]


def closings(scene: Scene, skin: Skin, cover: Cover, levels: tuple[float, ...] = (1.0,)) -> Floats:
    """(levels, rows, columns) closing times in s, inf for cells that stay open, under a scene of
    :func:`~contactfpga_sim.model.scenes.families.touches` on a cover that goes by stress. ``levels``: closing forces
    over the switch's."""
    times, sheet = np.linspace(0, scene.settled_s, STEPS + 1), cells(scene, skin, cover)
    forces = np.array([sheet.forces_n(scene.loads(seconds)) for seconds in times])
    return np.array([crossings(times, forces, level * sheet.thresholds_n) for level in levels])


def cells(scene: Scene, skin: Skin, cover: Cover) -> Cells:
    """The sheet that is drawn for a scene."""
    return cells_of(cover, skin.rows, skin.columns, skin.pitch_x_mm * M, skin.pitch_y_mm * M, scene.drawn)


def whereabouts(scene: Scene, skin: Skin | None) -> Callable[[float], list[Place]]:
    """Places in mm of the contacts, or of their parts on the sheet, as a function of time in s."""
    return lambda seconds: [(one.x_mm, one.y_mm) for one in scene.truth(min(seconds, scene.settled_s), skin).contacts]


def crossings(times: Floats, forces: Floats, thresholds: Floats) -> Floats:
    """Times at which (times, rows, columns) forces first reach thresholds; inf where they do not."""
    reached = np.maximum.accumulate(forces)
    after = (reached >= thresholds).argmax(axis=0)
    before = np.maximum(after - 1, 0)
    low, high = (np.take_along_axis(reached, at[None], 0)[0] for at in (before, after))
    share = np.clip((thresholds - low) / np.maximum(high - low, 1e-12), 0, 1)
    found = times[before] + share * (times[after] - times[before])
    return np.where(reached[-1] >= thresholds, found, np.inf)


def grown(closing_s: Floats, period_us: float) -> Iterator[Growth]:
    """The record of a single contact after each scan, one every ``period_us``, in which some of (..., rows, columns)
    cells close. Cells with levels close once at each."""
    scans = np.ceil(closing_s * 1e6 / period_us - 1e-9)
    growth = Growth()
    for scan in np.unique(scans[np.isfinite(scans)]).tolist():
        *_, rows, columns = np.nonzero(scans == scan)
        closed = Moments(len(rows), int(columns.sum()), int(rows.sum()))
        growth.closings.append(Closing(round(scan * period_us), closed))
        yield growth


class Draw(NamedTuple):
    """A state of a simulated touch by a single contact."""

    cells: int
    pace_us: float
    """Mean time between closings."""
    moves: Floats
    """(2, 2) what the factors of a row multiply, in mm along x and y."""
    off: Floats
    """(2,) the true place, from the barycenter in mm, of the contact's part on the sheet."""
    whole: bool
    """Whether all of the contact is on the sheet."""
    settled: bool = False


def fit(skin: Skin, cover: Cover, count: int = 1000, seed: int = 0, levels: tuple[float, ...] = (1.0,)) -> Places:
    """The table of a sheet, fitted to ``count`` simulated touches of each family.

    Raises CoverError for the model ``patch``. ``levels``: closing forces of each cell over the switch's.
    """
    skin = dataclasses.replace(skin, closed=False)
    families = {family: list(draws(family, skin, cover, count, seed, levels)) for family in (*FITTED, FLAT)}
    grew, flat = (
        [one for each in kind for one in families[each] if one.whole and not one.settled] for kind in (FITTED, [FLAT])
    )
    least_us = float(np.quantile([one.pace_us for one in flat if one.cells > 1] or [0.0], FLATTEST))
    rows = tuple(row for first, end in zip(CELLS, (*CELLS[1:], 10**9)) if (row := _row(first, end, least_us, grew)))
    table = Places(skin.pitch_x_mm, skin.pitch_y_mm, least_us, rows, NO_SPREADS)
    return dataclasses.replace(table, spreads=_spreads(families.values(), table))


def draws(
    family: str, skin: Skin, cover: Cover, count: int, seed: int, levels: tuple[float, ...] = (1.0,)
) -> Iterator[Draw]:
    """The states of touches of a family by a single contact as its cells close, and each last one once more, settled.

    Raises CoverError for the model ``patch``.
    """
    pitches = skin.pitch_x_mm, skin.pitch_y_mm
    # A table with a single factor moves a place by what that factor multiplies.
    units = [Places(*pitches, 0.0, (Row(1, *factors, 1e9),), NO_SPREADS) for factors in ((1.0, 0.0), (0.0, 1.0))]
    for scene in touches(family, count, seed, skin, cover):
        (place,), (on_sheet, *_) = (whereabouts(scene, part)(math.inf) for part in (None, skin))
        whole, states = math.dist(place, on_sheet) <= ON_SHEET * pitches[0], []
        for growth in grown(closings(scene, skin, cover, levels), frame_us(skin)):
            cells, at = middle(growth, skin.sheet)
            moves = np.array([np.subtract(unit.of(growth, *at, cells)[:2], at) for unit in units])
            pace_us = growth.span_us / max(1, cells - 1)
            states.append(Draw(cells, pace_us, moves, np.subtract(on_sheet, at), whole))
        yield from (*states, *(one._replace(settled=True) for one in states[-1:]))


def middle(growth: Growth, sheet: Sheet) -> tuple[int, Place]:
    """Number of cells of a record, and their barycenter in mm."""
    count, x, y = np.sum([one.closed for one in growth.closings], axis=0).tolist()
    return count, (x / count * sheet.pitch_x_mm, y / count * sheet.pitch_y_mm)


def frame_us(skin: Skin) -> float:
    """Time from one frame to the next in us, without waits for the line."""
    return skin.derived.frame_clocks / skin.clock_hz * 1e6


def _row(first: int, end: int, least_us: float, grew: list[Draw]) -> Row | None:
    here = [one for one in grew if first <= one.cells < end]
    if len(here) < FEWEST:
        return None
    told = [one for one in here if one.pace_us > least_us]
    if first <= TOO_FEW or not told:
        return Row(first, 0.0, 0.0, 0.0)
    moves, off = np.array([one.moves for one in told]), np.array([one.off for one in told])
    flat = moves.transpose(0, 2, 1).reshape(-1, 2)
    linear, square = factors = np.linalg.lstsq(flat, off.ravel(), rcond=1e-6)[0]
    reach_mm = float(np.quantile(np.hypot(*(factors @ moves).T), FARTHEST))
    return Row(first, float(linear), float(square), reach_mm)


def _spreads(families: Iterable[list[Draw]], table: Places) -> tuple[Spread, ...]:
    """The spreads of a table's places. Each family weighs as much as another, while its cells close and settled."""
    weights = []
    for family in families:
        ends = sum(one.settled for one in family)
        weights += [1 / (ends if one.settled else len(family) - ends) for one in family]
    cells, paces_us, moves, off, _, settled = (np.array(column) for column in zip(*itertools.chain(*families)))
    least, linear, square, reach_mm = np.array([dataclasses.astuple(row) for row in table.rows]).T
    row = np.searchsorted(least, cells, side="right") - 1
    moved = linear[row, None] * moves[:, 0] + square[row, None] * moves[:, 1]
    told = (paces_us > table.least_us) & (np.hypot(*moved.T) <= reach_mm[row])
    errors = np.log(((off - told[:, None] * moved) ** 2).sum(axis=1) + LEAST_MM2)
    kinds = np.where(cells <= TOO_FEW, 0, 1 + told) + SPREADS // 2 * settled
    found: list[Spread] = []
    for kind in range(SPREADS):
        here = kinds == kind
        if kind >= SPREADS // 2 and here.sum() < FEWEST_SETTLED:
            found.append(found[kind - SPREADS // 2])
        else:
            level, power = quantile_line(np.log(cells[here]), errors[here], np.array(weights)[here])
            found.append(Spread(math.exp(level) / CHI2_95, power))
    return tuple(found)


def quantile_line(x: Floats, y: Floats, weights: Floats, share: float = 0.95) -> tuple[float, float]:
    """Level and slope of the line that has a share of the weighted points (x, y) below it, at whatever x: the one of
    the least sum of distances, which count ``share`` for points above it and 1 - ``share`` for those below."""
    line, terms = np.zeros(2), np.column_stack([np.ones_like(x), x])
    for _ in range(ROUNDS):
        off = y - terms @ line
        root = np.sqrt(weights * np.where(off > 0, share, 1 - share) / np.maximum(np.abs(off), 1e-3))
        line = np.linalg.lstsq(terms * root[:, None], y * root, rcond=1e-9)[0]
    return float(line[0]), float(line[1])
