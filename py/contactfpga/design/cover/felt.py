"""Whether a light finger, an ellipse with Hertz's pressure, is felt anywhere on a sheet.

A touch is felt from the least ratio of closing force to force share on.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection

import numpy as np

from contactfpga.design.cover.answer import CoverError, NoSolution, positive
from contactfpga.design.cover.cells import BEYOND, Cells
from contactfpga.design.cover.numerics import Floats
from contactfpga.design.cover.patch import Ellipse
from contactfpga.design.cover.press import Cover, Load

LENGTH_M, WIDTH_M = 12e-3, 10e-3
"""Length and width of a light fingertip's contact."""

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
    """Force share of the most pressed switch, at the worst place."""
    median_share: float
    """Median force share of the most pressed switch."""
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
) -> Felt:
    """Sensitivity of a sheet to an elliptic finger, ``length_m`` long and ``width_m`` wide.

    ``seed`` is the first of :data:`SHEETS`; acceleration and density are for
    :meth:`~contactfpga.design.cover.cells.Cells.false_presses`. Raises CoverError for the model ``patch``.
    """
    half = positive("length_m", length_m, "m") / 2, positive("width_m", width_m, "m") / 2
    if not 1 <= places <= MOST_PLACES:
        raise CoverError(f"places is {places}; it must lie between 1 and {MOST_PLACES}")
    whole = _cells(cover, sheet, seed)
    closing = _closing(cover, sheet, whole, seed)
    window = _Window(cover, sheet, max(half))
    at = spread_evenly(places, sheet)
    forces, shares = np.empty((len(closing), places)), np.empty(places)
    for number, (x, y, angle) in enumerate(at):
        taken, there = window.taken(Ellipse(*half, x, y, angle))
        present = np.isfinite(closing[0][there])
        shares[number] = taken[present].max(initial=0.0)
        with np.errstate(divide="ignore"):
            forces[:, number] = np.where(taken > LEAST_SHARE, closing[:, *there] / taken, np.inf).min(axis=(1, 2))
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
    def __init__(self, cover: Cover, sheet: Sheet, reach_m: float):
        self.sheet = sheet
        beyond = 0.0 if cover.cut else BEYOND * cover.thickness_m
        more = NEIGHBORS + 2 if cover.gives_way else 1
        sides = [(sheet.rows, sheet.pitch_y_m), (sheet.columns, sheet.pitch_x_m)]
        wanted = [2 * (math.ceil((reach_m + beyond) / positive("pitch", pitch, "m")) + more) + 1 for _, pitch in sides]
        rows, columns = (min(count, most) for (count, _), most in zip(sides, wanted, strict=True))
        self.cells = Cells(cover, rows, columns, sheet.pitch_x_m, sheet.pitch_y_m)

    def taken(self, finger: Ellipse) -> tuple[Floats, tuple[np.ndarray, np.ndarray]]:
        sheet, (high, wide) = self.sheet, self.cells.shape
        top = self._start(finger.y_m / sheet.pitch_y_m, high, sheet.rows, closed=False)
        left = self._start(finger.x_m / sheet.pitch_x_m, wide, sheet.columns, sheet.closed)
        moved = dataclasses.replace(
            finger, x_m=finger.x_m - left * sheet.pitch_x_m, y_m=finger.y_m - top * sheet.pitch_y_m
        )
        found = self.cells.forces_n([Load((moved,), 1.0)])
        return found, (top + np.arange(high)[:, None], (left + np.arange(wide)) % sheet.columns)

    @staticmethod
    def _start(middle: float, width: int, count: int, closed: bool) -> int:
        first = round(middle) - width // 2
        return first if closed else min(max(first, 0), count - width)
