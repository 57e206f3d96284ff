"""The force on each switch of a sheet, and the closed ones: faces and caps under foam.

A switch takes the stress in the foam (:mod:`contactfpga.design.cover.medium`) on its face or on its *cap*, a rigid
square plate. The surroundings of *flush* caps carry their own share. *Proud* caps carry all foam, and each takes its
*tile*, one pitch wide. Foam that is *cut* between the caps does not spread stress from tile to tile.

A proud cap yields by the switch's travel, and the foam, strips that shear and bend (Timoshenko), loads the neighbors.
Forces Q on the caps follow from those on rigid caps, T, by (1 + L/k) Q = T: k is the switch's stiffness, L the strips'
stiffness as a discrete Laplacian. The pressure on top is independent of the yield; caps do not tilt; foam that sags
between proud caps is unsupported.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np

from contactfpga.design.cover import medium, point
from contactfpga.design.cover.answer import CoverError, finite, not_negative, positive
from contactfpga.design.cover.layers import Body
from contactfpga.design.cover.numerics import Floats
from contactfpga.design.cover.patch import Part
from contactfpga.design.cover.press import Cover, Indenter, Load

LEAST_PARTS, MOST_PARTS = 8, 24
"""Limits of grid steps per pitch; between them, two per foam thickness and six per face."""

MOST_PITCHES = 20
"""Largest foam thickness in pitches; forces are equal on all switches long before."""

BEYOND, MARGIN = 4.0, 2.0
"""Computed foam beyond a part, and beyond those switches, in thicknesses."""

NEIGHBORS = 4
"""Computed switches beyond that, as yielding caps pass force on."""


class Cells:
    """The switches of a sheet of ``rows`` by ``columns`` under a cover, the first one at (0, 0) m.

    ``seed`` draws closing forces with a ``spread``. Raises CoverError for the model ``patch``, which has no force, for
    caps wider than the pitch, and for foam of more than :data:`MOST_PITCHES`.
    """

    def __init__(self, cover: Cover, rows: int, columns: int, pitch_x_m: float, pitch_y_m: float, seed: int = 0):
        if cover.model == "patch":
            raise CoverError("model is 'patch', which knows no force; take one that goes by stress")
        pitch = min(positive("pitch_x_m", pitch_x_m, "m"), positive("pitch_y_m", pitch_y_m, "m"))
        side = cover.side_m
        if side > pitch and cover.model != "point":
            what = "a cap" if cover.cap else "a switch's face"
            raise CoverError(f"{what} is {side:g} m wide; the pitch is {pitch:g} m, take a smaller one")
        if cover.thickness_m > MOST_PITCHES * pitch:
            most = f"at most {MOST_PITCHES} pitches, {MOST_PITCHES * pitch:g} m"
            raise CoverError(f"thickness_m is {cover.thickness_m:g}; it must be {most}")
        self.cover = cover
        self.shape = (rows, columns)
        self._x, self._y = np.arange(columns) * pitch_x_m, np.arange(rows) * pitch_y_m
        self._pitches = pitch_y_m, pitch_x_m
        self.thresholds_n = self.drawn(seed)
        """(rows, columns) closing force of each switch less its preload."""

    @property
    def parts(self) -> int:
        """Steps per pitch of the pressure grid, along the columns."""
        return _axis(1, self._pitches[1], self.cover).parts

    def drawn(self, seed: int) -> Floats:
        """(rows, columns) closing force in N of each switch drawn with this seed, less its preload."""
        switch = self.cover.switch
        drawn = np.random.default_rng(seed).standard_normal(self.shape) if switch.spread else np.zeros(self.shape)
        return np.asarray(switch.force_n * (1 + switch.spread * np.clip(drawn, -3, 3)) - switch.preload_n)

    def indentation(self, parts: Sequence[Part], body: Body) -> Indenter:
        """A body's parts on these switches' cover."""
        pitch_y_m, pitch_x_m = self._pitches
        return self.cover.indentation(parts, body, pitch_x_m, pitch_y_m)

    def forces_n(self, loads: Sequence[Load]) -> Floats:
        """(rows, columns) force on each switch, summed over loads; below 0 where foam is pulled off."""
        if self.cover.model == "point":
            return self._of_points(loads)
        found = np.zeros(self.shape)
        for part, force in (share for load in loads for share in load.shares()):
            (top, rows), (left, columns) = (
                self._window(*place)
                for place in zip((part.y_m, part.x_m), part.half_box_m[::-1], self._pitches, self.shape)
            )
            if rows and columns:
                grid = _grid(self.cover, rows, columns, *self._pitches)
                found[top : top + rows, left : left + columns] += force * grid.shares(part, top, left)
        return found

    def _window(self, middle_m: float, reach_m: float, pitch_m: float, count: int) -> tuple[int, int]:
        """First of the switches that a part may press along one direction, and their number."""
        beyond = 0.0 if self.cover.cut else BEYOND * self.cover.thickness_m
        more = 1 + NEIGHBORS * self.cover.gives_way
        wanted = 2 * (math.ceil((reach_m + beyond) / pitch_m) + more) + 1
        first = min(max(round(middle_m / pitch_m) - wanted // 2, 0), max(0, count - wanted))
        near = abs(middle_m - (count - 1) / 2 * pitch_m) <= count / 2 * pitch_m + reach_m + beyond
        return first, min(wanted, count) if near else 0

    def closed(self, loads: Sequence[Load], before: np.ndarray | None = None) -> np.ndarray:
        """(rows, columns) bool: the closed switches. Those closed ``before`` open only below the closing force less
        hysteresis."""
        return self.closed_by(self.forces_n(loads), before)

    def closed_by(self, forces_n: Floats, before: np.ndarray | None = None) -> np.ndarray:
        """:meth:`closed` for (rows, columns) forces."""
        thresholds = self.thresholds_n
        if before is not None and self.cover.switch.hysteresis:
            thresholds = np.where(before, thresholds * (1 - self.cover.switch.hysteresis), thresholds)
        found: np.ndarray = forces_n >= thresholds
        return found

    def false_presses(self, acceleration_m_s2: float = 0.0, foam_kg_m3: float = 0.0) -> float:
        """Expected number of switches that close without a touch, by preload and by the inertia of cap and foam when
        the link accelerates toward the sheet's outside."""
        finite("acceleration_m_s2", acceleration_m_s2)
        not_negative("foam_kg_m3", foam_kg_m3, "kg/m3")
        cap = self.cover.cap
        tile = math.prod(self.cover.width_m(pitch) for pitch in self._pitches)
        mass = (cap.mass_kg if cap else 0.0) + foam_kg_m3 * tile * self.cover.thickness_m
        switch = self.cover.switch
        margin = switch.force_n - switch.preload_n - mass * acceleration_m_s2
        sigma = switch.spread * switch.force_n
        share = float(margin <= 0) if not sigma else math.erfc(margin / sigma / math.sqrt(2)) / 2
        return share * math.prod(self.shape)

    def _of_points(self, loads: Sequence[Load]) -> Floats:
        """The paper's (9): stress at the middle of each face, times its area."""
        forces = np.zeros(self.shape)
        for part, force in (share for load in loads for share in load.shares()):
            away = np.hypot(self._x - part.x_m, self._y[:, None] - part.y_m)
            forces += self.cover.area_m2 * point.stress_pa(force, away, self.cover.thickness_m)
        return forces


class _Grid:
    """The stress grid of a window of switches."""

    def __init__(self, cover: Cover, rows: int, columns: int, pitch_y_m: float, pitch_x_m: float):
        self._cover = cover
        self._down, self._across = _axis(rows, pitch_y_m, cover), _axis(columns, pitch_x_m, cover)

    def shares(self, part: Part, top: int, left: int) -> Floats:
        """(rows, columns) share of the part's force on each switch, the first one of which is number ``top``, ``left``
        of the sheet."""
        stress = self._spread(self._pressure(part, top * self._down.pitch_m, left * self._across.pitch_m))
        taken: Floats = self._across.take(self._down.take(stress).T).T
        return self._given_way(taken) if self._cover.gives_way else taken

    def _pressure(self, part: Part, top_m: float, left_m: float) -> Floats:
        down, across = self._down, self._across
        found = np.zeros((len(down.places_m), len(across.places_m)))
        (reach_x, reach_y), x_m, y_m = part.half_box_m, part.x_m - left_m, part.y_m - top_m
        rows, columns = down.near(y_m, reach_y), across.near(x_m, reach_x)
        if rows.start >= rows.stop or columns.start >= columns.stop:
            return found
        x, y = across.places_m[columns] + left_m, down.places_m[rows, None] + top_m
        here = part.density(x, y) * down.step_m * across.step_m
        if down.holds(y_m, reach_y) and across.holds(x_m, reach_x):
            total = here.sum()
            if not total:  # smaller than a part of the grid
                here = np.zeros(here.shape)
                here[np.abs(y[:, 0] - part.y_m).argmin(), np.abs(x - part.x_m).argmin()] = total = 1.0
            here = here / total
        found[rows, columns] = here
        return found

    def _spread(self, pressure: Floats) -> Floats:
        """Force on each grid part below the foam, periodic far beyond the edge."""
        if self._cover.cut:
            return pressure
        return np.fft.irfft2(np.fft.rfft2(pressure) * self._transfer, s=pressure.shape)

    @functools.cached_property
    def _transfer(self) -> Floats:
        down, across = self._down, self._across
        waves = (
            2 * np.pi * np.fft.fftfreq(len(down.places_m), down.step_m),
            2 * np.pi * np.fft.rfftfreq(len(across.places_m), across.step_m),
        )
        return medium.foam(np.hypot(waves[0][:, None], waves[1]) * self._cover.thickness_m)

    def _given_way(self, taken: Floats) -> Floats:
        down, across = self._down, self._across
        (values_y, modes_y), (values_x, modes_x) = down.modes, across.modes
        strip, switch = self._cover.strip_pa, self._cover.switch
        stiff_y, stiff_x = strip(down.pitch_m) * across.pitch_m, strip(across.pitch_m) * down.pitch_m
        share = (stiff_y * values_y[:, None] + stiff_x * values_x) * switch.travel_m / switch.force_n
        found: Floats = modes_y @ ((modes_y.T @ taken @ modes_x) / (1 + share)) @ modes_x.T
        return found


@functools.lru_cache(maxsize=256)
def _grid(cover: Cover, rows: int, columns: int, pitch_y_m: float, pitch_x_m: float) -> _Grid:
    return _Grid(cover, rows, columns, pitch_y_m, pitch_x_m)


class _Axis:
    """One direction of a sheet: its stress grid, and each switch's share of it."""

    def __init__(self, count: int, pitch_m: float, cover: Cover):
        self.count, self.pitch_m = count, pitch_m
        width = cover.width_m(pitch_m)
        finest = [pitch_m if width == pitch_m else width / 6, pitch_m if cover.cut else cover.thickness_m / 2]
        self.parts = min(MOST_PARTS, max(LEAST_PARTS, math.ceil(pitch_m / min(finest))))
        self.step_m = pitch_m / self.parts
        beyond = 1 if cover.cut else 1 + math.ceil(MARGIN * cover.thickness_m / pitch_m)
        self.places_m = (np.arange((count + 2 * beyond) * self.parts) + 0.5) * self.step_m - (beyond + 0.5) * pitch_m
        shares = self._taken(cover.width_m(pitch_m))
        self._near = (shares != 0).argmax(axis=1)[:, None] + np.arange(np.count_nonzero(shares, axis=1).max())
        self._shares = np.take_along_axis(shares, self._near, axis=1)

    def take(self, stress: Floats) -> Floats:
        """(count, n) force on each switch of (places, n) stress. No product of matrices: on a busy computer the threads
        of one wait ten times as long for each other as they compute."""
        return np.asarray(np.einsum("sp,spn->sn", self._shares, stress[self._near]))

    def near(self, middle_m: float, reach_m: float) -> slice:
        first, last = ((middle_m + end * reach_m - self.places_m[0]) / self.step_m for end in (-1, 1))
        return slice(max(0, math.floor(first)), max(0, min(len(self.places_m), math.ceil(last) + 1)))

    def holds(self, middle_m: float, reach_m: float) -> bool:
        return bool(self.places_m[0] <= middle_m - reach_m and middle_m + reach_m <= self.places_m[-1])

    @functools.cached_property
    def modes(self) -> tuple[Floats, Floats]:
        """Eigenvalues and eigenvectors of a chain with springs of 1 N/m."""
        joined = np.eye(self.count, k=1) + np.eye(self.count, k=-1)
        return np.linalg.eigh(np.diag(joined.sum(axis=0)) - joined)

    def _taken(self, width_m: float) -> Floats:
        away = self.places_m - np.arange(self.count)[:, None] * self.pitch_m
        upper, lower = (np.clip(away + side * self.step_m / 2, -width_m / 2, width_m / 2) for side in (1, -1))
        return np.asarray((upper - lower) / self.step_m)


@functools.lru_cache(maxsize=256)
def _axis(count: int, pitch_m: float, cover: Cover) -> _Axis:
    return _Axis(count, pitch_m, cover)


@functools.lru_cache(maxsize=32)
def cells_of(cover: Cover, rows: int, columns: int, pitch_x_m: float, pitch_y_m: float, seed: int = 0) -> Cells:
    """:class:`Cells`, cached."""
    return Cells(cover, rows, columns, pitch_x_m, pitch_y_m, seed)
