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
from contactfpga.design.cover.cells import BEYOND, Cells
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

GROWN = 1.5
"""Half axes at the largest force that is looked at, over those at the body's depth."""

PLACES, MOST_PLACES = 2000, 100_000
SHEETS = 40
"""Drawn sheets, if closing forces have a spread; another sheet lies within their range with 39/41 (95 %)
probability."""

LEAST_SHARE = 1e-4
"""Force share that counts as unpressed; a layer's linear solution has ripples far away."""

NEIGHBORS = 2
"""Computed switches beyond finger and foam, as yielding caps pass force on."""

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
    window = _Window(cover, sheet, Ellipse(*half), body)
    at = spread_evenly(places, sheet)
    forces, shares = np.empty((len(closing), places)), np.empty(places)
    for number, place in enumerate(at):
        forces[:, number], shares[number] = window.closing_n(closing, *place.tolist())
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


class _Window:
    """The switches around a finger, of which more do not matter."""

    def __init__(self, cover: Cover, sheet: Sheet, finger: Ellipse, body: Body):
        self.sheet = sheet
        beyond = 0.0 if cover.cut else BEYOND * cover.thickness_m
        more = NEIGHBORS + 2 if cover.gives_way else 1
        reach_m = GROWN * max(finger.half_x_m, finger.half_y_m) + beyond
        sides = [(sheet.rows, sheet.pitch_y_m), (sheet.columns, sheet.pitch_x_m)]
        wanted = [2 * (math.ceil(reach_m / positive("pitch", pitch, "m")) + more) + 1 for _, pitch in sides]
        rows, columns = (min(count, most) for (count, _), most in zip(sides, wanted, strict=True))
        self._cells = Cells(cover, rows, columns, sheet.pitch_x_m, sheet.pitch_y_m)
        self._indentation = self._cells.indentation([finger], body)

    def closing_n(self, closing_n: Floats, x_m: float, y_m: float, angle_rad: float) -> tuple[Floats, float]:
        """(sheets,) force at this place that closes the first switch of each sheet with (sheets, rows, columns) closing
        forces, and that switch's share on the first sheet."""
        sheet, (high, wide) = self.sheet, self._cells.shape
        top = self._start(y_m / sheet.pitch_y_m, high, sheet.rows, closed=False)
        left = self._start(x_m / sheet.pitch_x_m, wide, sheet.columns, sheet.closed)
        needed = closing_n[:, top + np.arange(high)[:, None], (left + np.arange(wide)) % sheet.columns]
        place = x_m - left * sheet.pitch_x_m, y_m - top * sheet.pitch_y_m, angle_rad
        force = 1.0
        for _ in range(ROUNDS):
            shares = self._shares(force, *place)
            pressed = shares > LEAST_SHARE
            force = float((needed[0] / np.where(pressed, shares, np.nan)).min(initial=math.inf, where=pressed))
            if not math.isfinite(force):
                return np.full(len(needed), math.inf), 0.0
        shares, more = (self._shares(part * force, *place) for part in (1.0, APART))
        pressed = (shares > LEAST_SHARE) & (more > LEAST_SHARE)
        rises = 1 + np.log(np.where(pressed, more / np.where(pressed, shares, 1.0), 1.0)) / math.log(APART)
        least = force * (needed / (force * np.where(pressed, shares, np.nan))) ** (1 / np.maximum(rises, LEAST_RISE))
        first = int(np.where(pressed, least[0], math.inf).argmin())
        return least.min(axis=(1, 2), initial=math.inf, where=pressed), float(shares.flat[first])

    def _shares(self, force_n: float, x_m: float, y_m: float, angle_rad: float) -> Floats:
        parts = self._indentation.parts_at(self._indentation.depth_m(force_n))
        return self._cells.forces_n([Load(tuple(part.placed(x_m, y_m, angle_rad) for part in parts), 1.0)])

    @staticmethod
    def _start(middle: float, width: int, count: int, closed: bool) -> int:
        first = round(middle) - width // 2
        return first if closed else min(max(first, 0), count - width)
