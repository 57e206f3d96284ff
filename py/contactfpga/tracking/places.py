"""Places of contacts by the times at which their cells closed.

A body that is pressed in at its middle closes the cells there first. Of n cells, the one that closed at the share s of
the time between the first closing and the last has the weight

    1/n (1 + f(s) - mean of f),    f(s) = linear s + square s^2,

in the place, where the barycenter gives each 1/n. The factors are fitted for each n to touches with a known place
(``contactfpga cover places``). Cells that closed together have one weight, so their sums are enough. Where the times
say nothing, the place is the barycenter: the contact moved, or its cells closed so fast one after another that only the
spread of their forces told which was first, as under a flat and hard body.
"""

from __future__ import annotations

import bisect
import dataclasses
import math
from pathlib import Path
from typing import NamedTuple

from contactfpga.errors import ContactFPGAError
from contactfpga.inputs import tomlfile
from contactfpga.inputs.values import is_finite, shown
from contactfpga.skin.sheet import Sheet
from contactfpga.tracking.growth import Growth

MOST_ROWS, SPREADS = 100, 6


class PlacesError(ContactFPGAError, ValueError):
    """A table of places that cannot be used."""


class PlaceEstimate(NamedTuple):
    """A contact's place in mm, and the variance along each axis in mm2, of which 5.99 times the whole is the square of
    the radius that holds 95 % of the errors."""

    x_mm: float
    y_mm: float
    variance_mm2: float
    moved: bool = False
    """Whether the contact did more than grow in place."""


@dataclasses.dataclass(frozen=True)
class Row:
    """Factors for zones of a number of cells, up to the next row's number."""

    cells: int
    """Least number of cells."""
    linear: float
    square: float
    reach_mm: float
    """Largest distance of the place from the barycenter. Farther, and the contact moved as it grew."""


@dataclasses.dataclass(frozen=True)
class Spread:
    """The variance along each axis of the places of zones of n cells: one_mm2 n^power."""

    one_mm2: float
    power: float


LIMITS = {"linear": (-1e9, 1e9), "square": (-1e9, 1e9), "power": (-9.0, 9.0)}
"""Least and largest value; 0 to 1e9 of the others."""

TOO_FEW = 2
"""Cells of which a place is the barycenter: where no third one closes soon, the middle of two is the better place."""


@dataclasses.dataclass(frozen=True)
class Places:
    """A table that places contacts by the order in which their cells close, fitted to a sheet and its cover
    (docs/tracking.md).

    >>> zones = contactfpga.read_zones("sim://?scene=two_fingers")
    >>> from contactfpga.tracking.places import Row, Spread
    >>> row, spread = Row(cells=1, linear=-2.0, square=0.5, reach_mm=3.0), Spread(one_mm2=2.0, power=-1.0)
    >>> places = contactfpga.Places(10.0, 10.0, least_us=200.0, rows=(row,), spreads=(spread,) * 6)
    >>> contactfpga.Tracker(places=places).update(zones).active[0].place_mm
    (55.0, 75.0)
    """

    pitch_x_mm: float
    pitch_y_mm: float
    least_us: float
    """Mean time between closings below which the times say nothing."""
    rows: tuple[Row, ...]
    """By rising number of cells, from 1 on."""
    spreads: tuple[Spread, ...]
    """Three of zones whose cells still close, then three of settled ones: of :data:`TOO_FEW` cells, of barycenters, and
    of places by the times."""

    def __post_init__(self) -> None:
        numbers = [(name, getattr(self, name)) for name in ("pitch_x_mm", "pitch_y_mm", "least_us")]
        parts = self.rows[: MOST_ROWS + 1] + self.spreads[: SPREADS + 1]
        numbers += [item for part in parts for item in vars(part).items()]
        for name, value in numbers:
            low, high = LIMITS.get(name, (0.0, 1e9))
            if not is_finite(value) or not low <= value <= high:
                raise PlacesError(f"{name} is {shown(value)}; it must be a number from {low:,.0f} to {high:,.0f}")
        counts = [row.cells for row in self.rows[: MOST_ROWS + 1]]
        if not 1 <= len(counts) <= MOST_ROWS or counts[0] != 1 or sorted(set(counts)) != counts:
            raise PlacesError(f"the rows are for {shown(counts)} cells; there must be 1 to {MOST_ROWS}, rising from 1")
        if len(self.spreads) != SPREADS:
            raise PlacesError(f"there are {len(self.spreads)} spreads; there must be {SPREADS}")

    @classmethod
    def load(cls, path: str | Path) -> Places:
        """The table that ``contactfpga cover places`` wrote. Raises :class:`PlacesError`, OSError."""
        values = tomlfile.fields_of(cls, "places", tomlfile.load(path, PlacesError), PlacesError)
        try:
            for name, kind in (("rows", Row), ("spreads", Spread)):
                items = (tomlfile.fields_of(kind, name, item, PlacesError) for item in values[name])
                values[name] = tuple(kind(**item) for item in items)
            return cls(**values)
        except (KeyError, TypeError):
            raise PlacesError(f"{path} lacks a value; write it again with contactfpga cover places") from None
        except PlacesError as error:
            raise PlacesError(f"{path}: {error}") from None

    def toml(self) -> str:
        """The text that :meth:`load` reads."""
        heads = "".join(f"{name} = {getattr(self, name):g}\n" for name in ("pitch_x_mm", "pitch_y_mm", "least_us"))
        items = [("rows", row) for row in self.rows] + [("spreads", spread) for spread in self.spreads]
        lines = ("".join(f"{name} = {value:.6g}\n" for name, value in vars(item).items()) for _, item in items)
        return heads + "".join(f"\n[[{kind}]]\n{text}" for (kind, _), text in zip(items, lines))

    def check(self, sheet: Sheet) -> None:
        """Raises :class:`PlacesError` for a sheet whose contacts the table cannot place."""
        if sheet.report == "barycenter":
            raise PlacesError("report is 'barycenter', which loses the sums of a zone's cells; take report = 'moments'")
        own, there = ((one.pitch_x_mm, one.pitch_y_mm) for one in (self, sheet))
        if not all(math.isclose(one, other, rel_tol=1e-3) for one, other in zip(own, there)):
            pitches = "{:g} x {:g} mm; the sheet has {:g} x {:g} mm".format(*own, *there)
            raise PlacesError(f"the table of places is for {pitches}; fit one with contactfpga cover places")

    def of(self, growth: Growth, x_mm: float, y_mm: float, cells: int) -> PlaceEstimate:
        """Place of a contact whose zone now has ``cells`` cells and the barycenter (``x_mm``, ``y_mm``)."""
        closings = growth.closings
        recorded = sum(one.closed.cells for one in closings)
        barycenter = PlaceEstimate(x_mm, y_mm, self._variance_mm2(growth, cells, False), growth.moved)
        if growth.moved or growth.shrinks or growth.span_us <= self.least_us * (recorded - 1):
            return barycenter
        row = self._row(recorded)
        shares = [(one.time_us - closings[0].time_us) / growth.span_us for one in closings]
        factors = [share * (row.linear + row.square * share) for share in shares]
        mean = sum(one.closed.cells * factor for one, factor in zip(closings, factors)) / recorded
        weights = [(factor - mean) / recorded for factor in factors]
        dx_mm = self.pitch_x_mm * sum(one.closed.sum_x * weight for one, weight in zip(closings, weights))
        dy_mm = self.pitch_y_mm * sum(one.closed.sum_y * weight for one, weight in zip(closings, weights))
        if math.hypot(dx_mm, dy_mm) > row.reach_mm:
            return barycenter._replace(moved=True)
        x = sum(one.closed.sum_x for one in closings) / recorded
        y = sum(one.closed.sum_y for one in closings) / recorded
        variance_mm2 = self._variance_mm2(growth, recorded, True)
        return PlaceEstimate(self.pitch_x_mm * x + dx_mm, self.pitch_y_mm * y + dy_mm, variance_mm2)

    def _variance_mm2(self, growth: Growth, cells: int, told: bool) -> float:
        apart_mm2 = self.pitch_x_mm**2 * growth.apart[0] + self.pitch_y_mm**2 * growth.apart[1]
        spread = self.spreads[3 * growth.settled + (0 if cells <= TOO_FEW else 1 + told)]
        return spread.one_mm2 * math.pow(cells, spread.power) + apart_mm2 / 2

    def _row(self, cells: int) -> Row:
        return self.rows[max(0, bisect.bisect_right(self.rows, cells, key=lambda one: one.cells) - 1)]
