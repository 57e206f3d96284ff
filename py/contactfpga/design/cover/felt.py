"""From which force on a finger is felt anywhere on a sheet.

A switch's share of the force falls as the patch grows. Around the force that closes the first switch it is taken as a
power of the force.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection

import numpy as np

from contactfpga.design.cover.answer import CoverError, NoSolution, positive
from contactfpga.design.cover.cells import Cells
from contactfpga.design.cover.layers import BODIES, Body
from contactfpga.design.cover.numerics import Floats
from contactfpga.design.cover.patch import Ellipse
from contactfpga.design.cover.press import Cover, Load

LENGTH_M, WIDTH_M = 12e-3, 10e-3
"""Length and width of a fingertip's contact at its body's depth."""

BODY = BODIES["finger"]

ROUNDS, APART, LEAST_RISE = 3, 1.25, 0.2
"""Estimates of the force from the shares at the estimate before; ratio of the forces that tell the power, and its
least."""

PLACES, MOST_PLACES = 2000, 100_000
SHEETS = 40
"""Drawn sheets, if closing forces have a spread; another sheet lies within their range with 39/41 (95 %)
probability."""

LEAST_SHARE = 1e-4
"""Force share that counts as unpressed; a layer's linear solution has ripples far away."""

_STEPS = 1 / 1.2207440846057596 ** np.arange(1, 4)
"""Steps of a sequence that fills a cube evenly (Roberts): powers of the root of x^4 = x + 1."""


@dataclasses.dataclass(frozen=True)
class Sheet:
    """The switches of a flat or a closed sheet."""

    rows: int
    columns: int
    pitch_x_m: float
    """Pitch along the columns."""
    pitch_y_m: float
    """Pitch along the rows."""
    mask: Collection[tuple[int, int]] = ()
    """(row, column) of absent switches, whose caps remain."""
    closed: bool = False
    """Whether the last column is a neighbor of the first."""


@dataclasses.dataclass(frozen=True)
class Force:
    """A force from which touches are felt."""

    value_n: float
    low_n: float
    high_n: float
    """Maximum over drawn sheets; 95 % of all sheets lie between."""


@dataclasses.dataclass(frozen=True)
class Felt:
    """Sensitivity of a sheet to light touches."""

    places: int
    """Places of the finger's middle, evenly spread, each with an angle."""
    sheets: int
    """Sheets with drawn closing forces; 1 without a spread."""
    half: Force | NoSolution
    """Force from which half of all touches are felt."""
    most: Force | NoSolution
    """Force from which 99 % of all touches are felt."""
    worst: Force | NoSolution
    """Force from which a touch at the worst place is felt."""
    worst_m: tuple[float, float]
    """x and y of the worst place from the first switch."""
    least_share: float
    """Share of the force on the switch that closes first, as it closes, at the place where that is least."""
    median_share: float
    """Median of these shares."""
    false_presses: float
    """Expected number of switches that close without a touch."""


def feel(
    cover: Cover,
    sheet: Sheet,
    length_m: float = LENGTH_M,
    width_m: float = WIDTH_M,
    places: int = PLACES,
    acceleration_m_s2: float = 0.0,
    foam_kg_m3: float = 0.0,
    seed: int = 0,
    body: Body = BODY,
) -> Felt:
    """Sensitivity of a sheet to a ``body`` whose patch is an ellipse, ``length_m`` long and ``width_m`` wide at its
    depth.

    ``seed`` is the first of :data:`SHEETS`; acceleration and density are for
    :meth:`~contactfpga.design.cover.cells.Cells.false_presses`. Raises CoverError for the model ``patch``.
    """
    half = positive("length_m", length_m, "m") / 2, positive("width_m", width_m, "m") / 2
    if not 1 <= places <= MOST_PLACES:
        raise CoverError(f"places is {places}; it must lie between 1 and {MOST_PLACES}")
    whole = _cells(cover, sheet, seed)
    closing = _closing(cover, sheet, whole, seed)
    touch = Touch(whole, Ellipse(*half), body, sheet.columns * sheet.pitch_x_m if sheet.closed else 0.0)
    at = spread_evenly(places, sheet)
    forces, shares = np.empty((len(closing), places)), np.empty(places)
    for number, place in enumerate(at):
        forces[:, number], shares[number] = touch.closing_n(closing, *place.tolist())
    worst = int(np.median(forces, axis=0).argmax())
    half_n, most_n, worst_n = (
        _force(np.quantile(forces, part, axis=1, method="inverted_cdf"), part) for part in (0.5, 0.99, 1.0)
    )
    return Felt(
        *(places, len(closing), half_n, most_n, worst_n),
        worst_m=(float(at[worst, 0]), float(at[worst, 1])),
        least_share=float(shares.min()),
        median_share=float(np.median(shares)),
        false_presses=whole.false_presses(acceleration_m_s2, foam_kg_m3),
    )


def spread_evenly(places: int, sheet: Sheet) -> Floats:
    """(places, 3): x and y in m up to half a pitch beyond the outermost switches, and angles in rad."""
    parts = (0.5 + np.arange(1, places + 1)[:, None] * _STEPS) % 1
    x, y, angle = parts.T
    return np.stack(
        [(sheet.columns * x - 0.5) * sheet.pitch_x_m, (sheet.rows * y - 0.5) * sheet.pitch_y_m, math.pi * angle], axis=1
    )


def _cells(cover: Cover, sheet: Sheet, seed: int) -> Cells:
    return Cells(cover, sheet.rows, sheet.columns, sheet.pitch_x_m, sheet.pitch_y_m, seed)


def _closing(cover: Cover, sheet: Sheet, first: Cells, seed: int) -> Floats:
    """(sheets, rows, columns) closing forces; inf for a switch that is absent or closed without a touch."""
    drawn = [first.thresholds_n]
    if cover.switch.spread:
        drawn += [_cells(cover, sheet, seed + number).thresholds_n for number in range(1, SHEETS)]
    found = np.where(np.array(drawn) > 0, drawn, np.inf)
    for row, column in sheet.mask:
        found[:, row, column] = np.inf
    return found


def _force(over_sheets: Floats, part: float) -> Force | NoSolution:
    value = float(np.quantile(over_sheets, 0.5, method="inverted_cdf"))
    if math.isinf(value):
        return NoSolution(f"{_touches(part)} close no switch, whatever their force")
    return Force(value, float(over_sheets.min()), float(over_sheets.max()))


def _touches(part: float) -> str:
    return f"more than {100 * (1 - part):.3g} % of touches" if part < 1 else "some touches"


class Touch:
    """A finger on a sheet. ``around_m``: length of a closed sheet along its columns, 0 of a flat one."""

    def __init__(self, cells: Cells, finger: Ellipse, body: Body, around_m: float = 0.0):
        self._cells, self._indentation, self._around_m = cells, cells.indentation([finger], body), around_m

    def closing_n(self, closing_n: Floats, x_m: float, y_m: float, angle_rad: float) -> tuple[Floats, float]:
        """(sheets,) force at this place that closes the first switch of each sheet with (sheets, rows, columns) closing
        forces, and that switch's share on the first sheet."""
        force, place = 1.0, (x_m, y_m, angle_rad)
        for _ in range(ROUNDS):
            shares = self._shares(force, *place)
            pressed = shares > LEAST_SHARE
            force = float((closing_n[0][pressed] / shares[pressed]).min(initial=math.inf))
            if not math.isfinite(force):
                return np.full(len(closing_n), math.inf), 0.0
        shares, more = (self._shares(part * force, *place) for part in (1.0, APART))
        pressed = (shares > LEAST_SHARE) & (more > LEAST_SHARE)
        if not pressed.any():
            return np.full(len(closing_n), math.inf), 0.0
        near, more, needed = shares[pressed], more[pressed], closing_n[:, pressed]
        rises = np.maximum(1 + np.log(more / near) / math.log(APART), LEAST_RISE)
        least = force * (needed / (force * near)) ** (1 / rises)
        return least.min(axis=1, initial=math.inf), float(near[least[0].argmin()])

    def _shares(self, force_n: float, x_m: float, y_m: float, angle_rad: float) -> Floats:
        parts = self._indentation.parts_at(self._indentation.depth_m(force_n))
        turns = (-1, 0, 1) if self._around_m else (0,)
        loads = [
            Load((part.placed(x_m + turn * self._around_m, y_m, angle_rad),), 1.0) for part in parts for turn in turns
        ]
        return self._cells.forces_n(loads)
