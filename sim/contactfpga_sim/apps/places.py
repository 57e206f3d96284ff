"""Touches cell by cell, and the table that places contacts by the times at which cells close."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from contactfpga.design.cover import Cells, Cover, cells_of
from contactfpga.design.cover.numerics import Floats
from contactfpga.skin import Skin
from contactfpga.skin.sheet import Sheet
from contactfpga.tracking.growth import Closing, Growth, Moments
from contactfpga.tracking.places import CHI2_95, SPREADS, TOO_FEW, Places, Row, Spread
from contactfpga_sim.model.scenes.contacts import M
from contactfpga_sim.model.scenes.families import touches
from contactfpga_sim.model.scenes.scene import Scene

STEPS = 40
"""Moments of a rise at which forces are computed. Between them each is linear in time."""

FITTED, FLAT = ("finger", "bumper"), "edge"
"""Families of touches that a table is fitted to, and one whose cells close as their forces are spread."""

CELLS = (1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 14, 18, 23, 30, 40, 55, 75, 100)
"""Least cells of a row."""

FEWEST, FEWEST_SETTLED = 100, 40
"""States from which a row is fitted, and a spread of settled ones. With fewer these have that of the others."""

FARTHEST = 0.99
"""Share of the states whose place lies within :attr:`Row.reach_mm` of the barycenter."""

ON_SHEET = 0.02
"""Pitches by which a contact's place may differ from that of its part on the sheet."""

FLATTEST = 0.95
"""Share of the states of flat bodies whose times say nothing."""

ENDLESS_US = 10**9
"""Rest of a settled touch."""

LEAST_MM2 = 1e-6
"""Added to squared errors, so that each has a logarithm."""

ROUNDS = 60
"""Weighted least squares that lead to a line of quantiles."""

NO_SPREADS = (Spread(0.0, 0.0),) * SPREADS

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
    cells close, and once more when it is settled. Cells with levels close once at each."""
    scans = np.ceil(closing_s * 1e6 / period_us - 1e-9)
    growth = Growth()
    for scan in np.unique(scans[np.isfinite(scans)]).tolist():
        *_, rows, columns = np.nonzero(scans == scan)
        closed = Moments(len(rows), int(columns.sum()), int(rows.sum()))
        growth.closings.append(Closing(round(scan * period_us), closed))
        yield growth
    if growth.closings:
        growth.rest_us = ENDLESS_US
        yield growth


class Touch(NamedTuple):
    """A simulated touch by a single contact."""

    closing_s: Floats
    """Closing times, see :func:`closings`."""
    place: Place
    """The place of the contact's part on the sheet."""
    whole: bool
    """Whether the contact's own place is the same."""


def fit(skin: Skin, cover: Cover, count: int = 1000, seed: int = 0, levels: tuple[float, ...] = (1.0,)) -> Places:
    """The table of a sheet, fitted to ``count`` simulated touches of each family.

    Raises CoverError for the model ``patch``. ``levels``: closing forces of each cell over the switch's.
    """
    skin = dataclasses.replace(skin, closed=False)
    seen = {family: touched(family, skin, cover, count, seed, levels) for family in (*FITTED, FLAT)}
    grew = [one for family in FITTED for touch in seen[family] if touch.whole for one in draws(touch, skin)]
    paces = [pace_us for touch in seen[FLAT] if touch.whole for cells, pace_us, _, _ in draws(touch, skin) if cells > 1]
    least_us = float(np.quantile(paces or [0.0], FLATTEST))
    rows = [row for first, end in zip(CELLS, (*CELLS[1:], 10**9)) if (row := _row(first, end, least_us, grew))]
    # The variances of this table number its spreads.
    numbers = tuple(Spread(float(number), 0.0) for number in range(SPREADS))
    table = Places(skin.pitch_x_mm, skin.pitch_y_mm, least_us, tuple(rows), numbers)
    return dataclasses.replace(table, spreads=_spreads([_states(table, found, skin) for found in seen.values()]))


def touched(
    family: str, skin: Skin, cover: Cover, count: int, seed: int, levels: tuple[float, ...] = (1.0,)
) -> list[Touch]:
    found = []
    for scene in touches(family, count, seed, skin, cover):
        (place,), (on_sheet, *_) = (whereabouts(scene, part)(math.inf) for part in (None, skin))
        whole = math.dist(place, on_sheet) <= ON_SHEET * skin.pitch_x_mm
        found.append(Touch(closings(scene, skin, cover, levels), on_sheet, whole))
    return found


Draw = tuple[int, float, list[Floats], Floats]
"""A state of a simulated touch: number of cells; mean time between closings in us; what the factors of a row multiply;
and the true place, both from the barycenter in mm."""


def draws(touch: Touch, skin: Skin) -> Iterator[Draw]:
    pitches = skin.pitch_x_mm, skin.pitch_y_mm
    # A table with a single factor moves a place by what that factor multiplies.
    units = [Places(*pitches, 0.0, (Row(1, *factors, 1e9),), NO_SPREADS) for factors in ((1.0, 0.0), (0.0, 1.0))]
    for growth in grown(touch.closing_s, frame_us(skin)):
        count, at = middle(growth, skin.sheet)
        moves = [np.subtract(unit.of(growth, *at, count)[:2], at) for unit in units]
        if not growth.settled:
            yield count, growth.span_us / max(1, count - 1), moves, np.subtract(touch.place, at)


def middle(growth: Growth, sheet: Sheet) -> tuple[int, Place]:
    """Number of cells of a record, and their barycenter in mm."""
    count, x, y = np.sum([one.closed for one in growth.closings], axis=0).tolist()
    return count, (x / count * sheet.pitch_x_mm, y / count * sheet.pitch_y_mm)


def frame_us(skin: Skin) -> float:
    """Time from one frame to the next in us, without waits for the line."""
    return skin.derived.frame_clocks / skin.clock_hz * 1e6


def _row(first: int, end: int, least_us: float, grew: list[Draw]) -> Row | None:
    here = [one for one in grew if first <= one[0] < end]
    if len(here) < FEWEST:
        return None
    _, paces_us, moves, off = (np.array(column) for column in zip(*here))
    told = paces_us > least_us
    if first <= TOO_FEW or not told.any():
        return Row(first, 0.0, 0.0, 0.0)
    flat = moves[told].transpose(0, 2, 1).reshape(-1, 2)
    linear, square = factors = np.linalg.lstsq(flat, off[told].ravel(), rcond=1e-6)[0]
    reach_mm = float(np.quantile(np.hypot(*(factors @ moves[told]).T), FARTHEST))
    return Row(first, float(linear), float(square), reach_mm)


def _states(table: Places, found: list[Touch], skin: Skin) -> Floats:
    """(n, 4) number of the spread, logarithms of the number of cells and of the squared error over mm2, and weight of
    all states of a family's touches: those that settled weigh as much as all others."""
    states = []
    for touch in found:
        for growth in grown(touch.closing_s, frame_us(skin)):
            count, at = middle(growth, skin.sheet)
            x_mm, y_mm, number, _ = table.of(growth, *at, count)
            off_mm2 = math.dist((x_mm, y_mm), touch.place) ** 2
            states.append((number, math.log(count), math.log(off_mm2 + LEAST_MM2), growth.settled))
    number, cells, off, settled = np.array(states).reshape(-1, 4).T
    settled = settled > 0
    weights = np.where(settled, 1 / max(1, settled.sum()), 1 / max(1, (~settled).sum()))
    return np.column_stack([number, cells, off, weights])


def _spreads(families: list[Floats]) -> tuple[Spread, ...]:
    number, cells, off, weight = np.concatenate(families).T
    found: list[Spread] = []
    for kind in range(SPREADS):
        here = number == kind
        if here.sum() < (FEWEST_SETTLED if kind >= SPREADS // 2 else TOO_FEW):
            found.append(found[kind - SPREADS // 2] if kind >= SPREADS // 2 else found[-1])
            continue
        level, power = quantile_line(cells[here], off[here], weight[here])
        found.append(Spread(math.exp(level) / CHI2_95, power))
    return tuple(found)


def quantile_line(x: Floats, y: Floats, weights: Floats, share: float = 0.95) -> tuple[float, float]:
    """Level and slope of the line that lies above a share of weighted points (x, y), at whatever x: the one of the
    least sum of distances, which count ``share`` for points above it and 1 - ``share`` below."""
    terms = np.column_stack([np.ones_like(x), x])
    line = np.array([np.quantile(y, share), 0.0])
    for _ in range(ROUNDS):
        off = y - terms @ line
        each = weights * np.where(off > 0, share, 1 - share) / np.maximum(np.abs(off), 1e-3)
        line = np.linalg.lstsq(terms * np.sqrt(each)[:, None], y * np.sqrt(each), rcond=1e-9)[0]
    return float(line[0]), float(line[1])
