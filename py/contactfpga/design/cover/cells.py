"""Which force comes to each switch of a sheet, and which switches close: faces and caps under foam.

Foam presses the sheet with the normal stress that spreads through it (:mod:`contactfpga.design.cover.medium`). A switch
takes the part of it that lies on its face or on its *cap*, a rigid square plate on the switch. Caps are *flush* with
what lies between them, which carries its own share, or they stand *proud* of it: then the foam rests on the caps alone,
and each takes what lies on its *tile*, one pitch wide. Foam that is *cut* between the caps does not spread stress from
tile to tile.

A proud cap gives way by the switch's travel and takes the foam down with it, which the foam between the caps passes on
to the neighbors. The foam there is a strip as long as the gap plus the foam's thickness, as wide as the pitch across,
that shears and bends (Timoshenko). The forces Q on the caps are those on rigid caps, T, spread by
(1 + L/k) Q = T: k the switch's stiffness, L the strips' stiffness as a discrete Laplacian.

What this leaves out: what presses keeps its pressure whatever gives way; caps do not tilt; nothing carries the foam
that sags between proud caps. Boundary elements say by how much that is off, on
the page on the cover.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np

from contactfpga.design.cover import medium, point
from contactfpga.design.cover.answer import CoverError, finite, not_negative, positive
from contactfpga.design.cover.numerics import Floats
from contactfpga.design.cover.press import Cover, Load

LEAST_PARTS, MOST_PARTS = 8, 24
"""Least and most grid steps per pitch; between them, two steps per foam thickness and six per face."""

MOST_PITCHES = 20
"""Thickness of the foam in pitches up to which forces are computed; they are the same for all switches long before."""

BEYOND = 4.0
"""Thicknesses of foam beyond the sheet that are looked at."""


class Cells:
    """The switches of a sheet of ``rows`` by ``columns`` under a cover, the first one at (0, 0) m.

    ``seed`` draws the closing force of each switch where the cover's switch has a ``spread``. Raises CoverError for the
    model ``patch``, which knows no force, for caps wider than the pitch, and for foam of more than
    :data:`MOST_PITCHES`.
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
        self._axes = [_Axis(count, pitch, cover) for count, pitch in ((rows, pitch_y_m), (columns, pitch_x_m))]
        self.thresholds_n = self.drawn(seed)
        """(rows, columns) closing force of each switch in N, its preload taken off."""

    @property
    def parts(self) -> int:
        """Steps per pitch of the grid on which pressure is resolved, along the columns."""
        return self._axes[1].parts

    def drawn(self, seed: int) -> Floats:
        """(rows, columns) closing force in N of each switch of a sheet whose switches are drawn with this seed, its
        preload taken off."""
        switch = self.cover.switch
        drawn = np.random.default_rng(seed).standard_normal(self.shape) if switch.spread else np.zeros(self.shape)
        return np.asarray(switch.force_n * (1 + switch.spread * np.clip(drawn, -3, 3)) - switch.preload_n)

    def forces_n(self, loads: Sequence[Load]) -> Floats:
        """(rows, columns) force on each switch in N, the loads' forces added up; below 0 where foam is pulled off."""
        if self.cover.model == "point":
            return self._of_points(loads)
        down, across = self._axes
        stress = self._spread(self._pressure(loads))
        taken: Floats = down.taken @ stress @ across.taken.T
        return self._given_way(taken) if self.cover.gives_way else taken

    def closed(self, loads: Sequence[Load], before: np.ndarray | None = None) -> np.ndarray:
        """(rows, columns) bool: the switches that are closed; ``before``: those that were until now, which open only
        when the force falls below the closing force by the switch's hysteresis."""
        return self.closed_by(self.forces_n(loads), before)

    def closed_by(self, forces_n: Floats, before: np.ndarray | None = None) -> np.ndarray:
        """Closed switches, (rows, columns) bool, under (rows, columns) forces in N; ``before``: see :meth:`closed`."""
        thresholds = self.thresholds_n
        if before is not None and self.cover.switch.hysteresis:
            thresholds = np.where(before, thresholds * (1 - self.cover.switch.hysteresis), thresholds)
        found: np.ndarray = forces_n >= thresholds
        return found

    def false_presses(self, acceleration_m_s2: float = 0.0, foam_kg_m3: float = 0.0) -> float:
        """Expected number of switches that close though nothing touches: preload and the weight of cap and foam, while
        the link is accelerated toward the sheet's outside, reach a closing force drawn from the normal distribution."""
        finite("acceleration_m_s2", acceleration_m_s2)
        not_negative("foam_kg_m3", foam_kg_m3, "kg/m3")
        cap = self.cover.cap
        tile = math.prod(self.cover.width_m(axis.pitch_m) for axis in self._axes)
        mass = (cap.mass_kg if cap else 0.0) + foam_kg_m3 * tile * self.cover.thickness_m
        switch = self.cover.switch
        margin = switch.force_n - switch.preload_n - mass * acceleration_m_s2
        sigma = switch.spread * switch.force_n
        share = float(margin <= 0) if not sigma else math.erfc(margin / sigma / math.sqrt(2)) / 2
        return share * math.prod(self.shape)

    def _of_points(self, loads: Sequence[Load]) -> Floats:
        """The paper's (9): the stress in the middle of each face, times its area."""
        forces = np.zeros(self.shape)
        for part, force in (share for load in loads for share in load.shares()):
            away = np.hypot(self._x - part.x_m, self._y[:, None] - part.y_m)
            forces += self.cover.area_m2 * point.stress_pa(force, away, self.cover.thickness_m)
        return forces

    def _pressure(self, loads: Sequence[Load]) -> Floats:
        """Force in N on each part of the grid."""
        down, across = self._axes
        found = np.zeros((len(down.places_m), len(across.places_m)))
        for part, force in (share for load in loads for share in load.shares()):
            reach_x, reach_y = part.half_box_m
            rows, columns = down.near(part.y_m, reach_y), across.near(part.x_m, reach_x)
            if rows.start >= rows.stop or columns.start >= columns.stop:
                continue
            x, y = across.places_m[columns], down.places_m[rows, None]
            here = part.density(x, y) * down.step_m * across.step_m
            if down.holds(part.y_m, reach_y) and across.holds(part.x_m, reach_x):
                total = here.sum()
                if not total:  # smaller than a part of the grid
                    here = np.zeros(here.shape)
                    here[np.abs(y[:, 0] - part.y_m).argmin(), np.abs(x - part.x_m).argmin()] = total = 1.0
                here = here / total
            found[rows, columns] += force * here
        return found

    def _spread(self, pressure: Floats) -> Floats:
        """The force on each part of the grid below the foam. The sheet repeats itself beyond its edge there, far enough
        away."""
        if self.cover.cut:
            return pressure
        return np.fft.irfft2(np.fft.rfft2(pressure) * self._transfer, s=pressure.shape)

    @functools.cached_property
    def _transfer(self) -> Floats:
        down, across = self._axes
        waves = (
            2 * np.pi * np.fft.fftfreq(len(down.places_m), down.step_m),
            2 * np.pi * np.fft.rfftfreq(len(across.places_m), across.step_m),
        )
        number = np.hypot(waves[0][:, None], waves[1])
        return medium.transfer(self.cover.within, number * self.cover.thickness_m)

    def _given_way(self, taken: Floats) -> Floats:
        down, across = self._axes
        (values_y, modes_y), (values_x, modes_x) = down.modes, across.modes
        strip, switch = self.cover.strip_pa, self.cover.switch
        stiff_y, stiff_x = strip(down.pitch_m) * across.pitch_m, strip(across.pitch_m) * down.pitch_m
        share = (stiff_y * values_y[:, None] + stiff_x * values_x) * switch.travel_m / switch.force_n
        found: Floats = modes_y @ ((modes_y.T @ taken @ modes_x) / (1 + share)) @ modes_x.T
        return found


class _Axis:
    """One direction of a sheet: the grid on which stress is resolved, and how much of it each switch takes."""

    def __init__(self, count: int, pitch_m: float, cover: Cover):
        self.count, self.pitch_m = count, pitch_m
        width = cover.width_m(pitch_m)
        finest = [pitch_m if width == pitch_m else width / 6, pitch_m if cover.cut else cover.thickness_m / 2]
        self.parts = min(MOST_PARTS, max(LEAST_PARTS, math.ceil(pitch_m / min(finest))))
        self.step_m = pitch_m / self.parts
        beyond = 1 if cover.cut else 1 + math.ceil(BEYOND * cover.thickness_m / pitch_m)
        self.places_m = (np.arange((count + 2 * beyond) * self.parts) + 0.5) * self.step_m - (beyond + 0.5) * pitch_m
        self.taken = self._taken(cover.width_m(pitch_m))

    def near(self, middle_m: float, reach_m: float) -> slice:
        """The places that something of this middle and reach covers."""
        first, last = ((middle_m + end * reach_m - self.places_m[0]) / self.step_m for end in (-1, 1))
        return slice(max(0, math.floor(first)), max(0, min(len(self.places_m), math.ceil(last) + 1)))

    def holds(self, middle_m: float, reach_m: float) -> bool:
        """Whether all of it lies on the grid."""
        return bool(self.places_m[0] <= middle_m - reach_m and middle_m + reach_m <= self.places_m[-1])

    @functools.cached_property
    def modes(self) -> tuple[Floats, Floats]:
        """Eigenvalues and eigenvectors of a chain whose neighbors are joined by springs of 1 N/m."""
        joined = np.eye(self.count, k=1) + np.eye(self.count, k=-1)
        return np.linalg.eigh(np.diag(joined.sum(axis=0)) - joined)

    def _taken(self, width_m: float) -> Floats:
        """(switches, places): the share of each place that lies on a switch's width."""
        away = self.places_m - np.arange(self.count)[:, None] * self.pitch_m
        upper, lower = (np.clip(away + side * self.step_m / 2, -width_m / 2, width_m / 2) for side in (1, -1))
        return np.asarray((upper - lower) / self.step_m)


@functools.lru_cache(maxsize=32)
def cells_of(cover: Cover, rows: int, columns: int, pitch_x_m: float, pitch_y_m: float, seed: int = 0) -> Cells:
    """:class:`Cells`, kept for the next call."""
    return Cells(cover, rows, columns, pitch_x_m, pitch_y_m, seed)
