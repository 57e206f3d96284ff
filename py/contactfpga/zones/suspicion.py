"""What a history of frames gives reason to suspect of the switches."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable
from typing import Literal

import numpy as np

from contactfpga.skin.sheet import Sheet

Cell = tuple[int, int]
"""(row, column)"""

FEW_CELLS = 3
"""As many side by side that do not change are stuck switches; more of them are rather something that lies there."""


@dataclasses.dataclass(frozen=True)
class Suspicion:
    """One thing that is wrong with the sheet, or looks so."""

    kind: Literal["stuck", "held", "flutter"]
    """``stuck``: one to three switches side by side read pressed without a change, while others came and went;
    ``held``: the same for more switches, so more likely something lies there; ``flutter``: a switch that changes faster
    than a hand can."""
    sentence: str
    cells: tuple[Cell, ...]
    """(row, column) of the switches; () if the frames do not show which."""
    time_us: int
    """Device time at which it was noticed, in us."""


@dataclasses.dataclass(frozen=True)
class Limits:
    """From when on something is suspected, in us of device time."""

    stuck_us: int
    others: int
    flutter_hz: float

    def needed(self, elsewhere: np.ndarray) -> int:
        """How many others must have come and gone, of the cells marked in ``elsewhere``: half of them on a sheet that
        is small."""
        return min(self.others, max(1, int(elsewhere.sum()) // 2))


def away_from(cells: Iterable[Cell], reach: int, sheet: Sheet) -> np.ndarray:
    """(rows, columns) bool: the cells farther than ``reach`` from all of these, so that no contact joins them."""
    away = np.ones((sheet.rows, sheet.columns), bool)
    for row, column in cells:
        columns = np.arange(column - reach, column + reach + 1)
        columns = columns % sheet.columns if sheet.closed else columns.clip(0, sheet.columns - 1)
        away[max(0, row - reach) : row + reach + 1, columns] = False
    return away


def unchanged(what: str, many: bool, seconds: float, others: str, from_the_start: bool) -> str:
    """The sentence about cells that do not change."""
    start = ", since the first frame," if from_the_start else ""
    cause = "something lies there, or they are stuck" if many else "stuck, or something small lies there"
    lasted = f"{seconds:.0f}" if seconds >= 10 else f"{seconds:.1f}"
    return f"{what} for {lasted} s{start} while {others}: {cause}"


def named(cells: Iterable[Cell], most: int = 12) -> str:
    """``cell (3, 4)``, ``cells (3, 4), (3, 5) and 7 more``."""
    places = [f"({row}, {column})" for row, column in cells]
    more = f" and {len(places) - most} more" if len(places) > most else ""
    return f"cell{'' if len(places) == 1 else 's'} {', '.join(places[:most])}{more}"


def reach_of(area: int) -> int:
    """How far from its barycenter a round zone of this area reaches, and one cell more."""
    return math.ceil(math.sqrt(area / math.pi)) + 1


def places(cells: np.ndarray) -> tuple[Cell, ...]:
    """The (row, column) of each True of (rows, columns) bool."""
    return tuple((row, column) for row, column in np.argwhere(cells).tolist())
