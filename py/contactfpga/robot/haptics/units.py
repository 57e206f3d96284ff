"""The pressure units under the bumper: readings to a wrench, unseen components, and the file units.toml."""

from __future__ import annotations

import dataclasses
import functools
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from contactfpga.inputs import tomlfile
from contactfpga.inputs.values import shown, suggestion
from contactfpga.robot.haptics.values import (
    HapticsError,
    array,
    direction,
    matrix,
    number,
    positive,
    skew,
    vector,
    within,
)
from contactfpga.robot.haptics.wrench import SURFACES, Bumper, Motion, Noise, Surface, Wrench, read_surface
from contactfpga.surfaces.shapes import Floats, Vector


@dataclasses.dataclass(frozen=True)
class Unit:
    """A unit, which pushes the bumper along its axis and measures the force."""

    point_m: Vector
    axis: Vector
    """Unit vector of the axis."""
    gain_n: float = 1.0
    """Newtons per step of the reading."""
    zero: float = 0.0
    """Reading without touch."""
    sigma_n: float = 0.05
    """Standard deviation of the noise."""
    range: tuple[float, float] | None = None
    """Saturated readings at both ends; None: none."""
    preload_n: float | None = None
    """Spring force without touch; None: unknown, and lifting is not reported."""

    def __post_init__(self) -> None:
        within("point_m", self.point_m, "m")
        within("axis", self.axis, "")
        within("zero", (self.zero,), "")
        positive("gain_n without its sign", abs(self.gain_n), "N")
        positive("sigma_n", self.sigma_n, "N")
        if self.preload_n is not None:
            number("preload_n", self.preload_n, 0, unit="N")


COMPONENTS = ("force along x", "force along y", "force along z", "moment about x", "moment about y", "moment about z")


class LoadCells:
    """All units of a bumper, in the link's frame."""

    def __init__(
        self,
        units: Sequence[Unit],
        *,
        frame: str = "",
        bumper: Bumper | None = None,
        zero_gravity_m_s2: Vector = (0.0, 0.0, 0.0),
        matrix: Floats | None = None,
        surface: Surface | None = None,
        sheet_m: tuple[float, float] = (0.0, 0.0),
        noise_n2: Floats | None = None,
    ):
        """Raises :class:`HapticsError` without a unit, or if ``noise_n2`` is no covariance.

        Args:
         frame: name of the link's frame.
         bumper: the mass on the units; None: it weighs nothing.
         zero_gravity_m_s2: gravity when the zeros were read, in the link's frame; 0: without bumper.
         matrix: (6, n): the wrench of a step of each reading, from a calibration; None: from places and axes.
         surface: the bumper's outside.
         sheet_m: position of column 0 and row 0 of the sheet on the surface laid flat.
         noise_n2: (n, n) covariance of the units' noise, in place of each ``sigma_n``; None: independent.
        """
        if not units:
            raise HapticsError("there is no unit; give at least one")
        self.units = tuple(units)
        self.frame = frame
        self.surface = surface
        self.sheet_m = sheet_m
        self.bumper = bumper
        self.zero_gravity_m_s2 = zero_gravity_m_s2
        self.calibrated = matrix is not None
        axes = np.array([unit.axis for unit in self.units], float)
        places = np.array([unit.point_m for unit in self.units], float)
        self.geometry: Floats = np.concatenate([axes.T, np.cross(places, axes).T])
        """(6, n): wrench of each unit on the bumper per newton, about the link's origin."""
        self._gains = np.array([unit.gain_n for unit in self.units])
        self.noise_n2 = None if noise_n2 is None else covariance("noise_n2", noise_n2, len(self.units))
        if self.noise_n2 is not None:
            sigmas = np.sqrt(np.diag(self.noise_n2)).tolist()
            self.units = tuple(dataclasses.replace(unit, sigma_n=sigma) for unit, sigma in zip(self.units, sigmas))
        # Units act on the bumper and contacts oppose them: this is the one place of that sign.
        self.matrix: Floats = -self.geometry * self._gains if matrix is None else np.asarray(matrix, float)
        """(6, n): wrench of the contacts on the link per step of each reading."""
        self.zeros: Floats = np.array([unit.zero for unit in self.units])
        self.noise = Noise(self._spread())
        self._weight = None if bumper is None else bumper.wrench(Motion(zero_gravity_m_s2))
        ranges = [unit.range or (-np.inf, np.inf) for unit in self.units]
        self._low, self._high = (np.array(ends) for ends in zip(*ranges))
        self._ends = any(unit.range for unit in self.units)
        self._springs = any(unit.preload_n is not None for unit in self.units)
        self._preload = np.array([np.inf if unit.preload_n is None else unit.preload_n for unit in self.units])

    def _spread(self) -> Floats:
        per_newton = self.matrix / self._gains
        if self.noise_n2 is not None:
            return np.asarray(per_newton @ self.noise_n2 @ per_newton.T)
        scaled = per_newton * np.array([unit.sigma_n for unit in self.units])
        return np.asarray(scaled @ scaled.T)

    @classmethod
    def load(cls, path: str | Path) -> LoadCells:
        """The units in a TOML file. Raises :class:`HapticsError`, OSError."""
        return cls(**load(path))

    def wrench(self, readings: Sequence[float] | Floats, motion: Motion | None = None) -> Wrench:
        """The contacts' wrench on the link, from one reading per unit. With ``motion`` the bumper's weight and inertia
        are subtracted; without, the bumper must be at rest as when its zeros were read."""
        read = array("readings", readings)
        if read.shape != self.zeros.shape:
            raise HapticsError(
                f"readings have the shape {read.shape}; there are {len(self.units)} units, one reading each"
            )
        deviations = read - self.zeros
        values = self.matrix @ deviations
        if motion is not None and self.bumper is not None and self._weight is not None:
            values = values + (self.bumper.wrench(motion) - self._weight)
        fx, fy, fz, mx, my, mz = values.tolist()
        saturated, lifted = self._saturated(read), self._lifted(deviations)
        return Wrench((fx, fy, fz), (mx, my, mz), self.noise, self.frame, saturated, lifted)

    def _saturated(self, read: Floats) -> tuple[int, ...]:
        if not self._ends:
            return ()
        return tuple(((read <= self._low) | (read >= self._high)).nonzero()[0].tolist())

    def _lifted(self, deviations: Floats) -> tuple[int, ...]:
        if not self._springs:
            return ()
        return tuple((deviations * self._gains + self._preload <= 0).nonzero()[0].tolist())

    def wrenches(self, readings: Floats) -> Floats:
        """(m, 6) wrenches of (m, n) readings, with the bumper at rest as when its zeros were read."""
        return np.asarray((np.atleast_2d(self._read(readings)) - self.zeros) @ self.matrix.T)

    def _read(self, readings: Sequence[float] | Floats) -> Floats:
        read = array("readings", readings)
        if read.ndim == 0 or read.shape[-1] != len(self.units):
            raise HapticsError(
                f"readings have the shape {read.shape}; there are {len(self.units)} units, one reading each"
            )
        return read

    @functools.cached_property
    def singular_values(self) -> Floats:
        """Singular values of the (6, n) matrix in N and Nm, largest first."""
        return np.asarray(np.linalg.svd(self.geometry, compute_uv=False), float)

    @functools.cached_property
    def _seen(self) -> tuple[Floats, int, Vector, float]:
        x, y, z = np.mean([unit.point_m for unit in self.units], axis=0).tolist()
        moved = np.array(self.matrix)
        moved[3:] -= skew((x, y, z)) @ moved[:3]
        spread = np.array([unit.point_m for unit in self.units]) - (x, y, z)
        length = float(np.sqrt((spread**2).sum() / len(spread))) or 1.0
        moved[3:] /= length
        vectors, values, _ = np.linalg.svd(moved)
        return vectors, int((values > 1e-9 * values[0]).sum()), (x, y, z), length

    @property
    def rank(self) -> int:
        """Independent components of a wrench that the units see; 6 are complete."""
        return self._seen[1]

    @property
    def unseen(self) -> Floats:
        """(6 - rank, 6): unseen components, by the inner product of each row with a wrench about the link's origin."""
        vectors, rank, place, length = self._seen
        lost = np.array(vectors[:, rank:])
        lost[3:] /= length
        lost[:3] += skew(place) @ lost[3:]
        lost[np.abs(lost) < 1e-12] = 0.0
        return np.asarray((lost / np.linalg.norm(lost, axis=0)).T)

    @property
    def cannot_see(self) -> list[str]:
        """:attr:`unseen` in words, by components."""
        return [_in_words(one) for one in reduced(self.unseen)]

    def noise_at(self, point_m: Vector) -> Floats:
        """(3,) standard deviations of the force of a single contact at a known point."""
        if self.rank < 6:
            raise HapticsError(f"the units see {self.rank} of 6 components; not all of a force is known at any point")
        exerts = np.concatenate([np.eye(3), skew(point_m)])
        return np.asarray(np.sqrt(np.diag(np.linalg.inv(exerts.T @ self.noise.information @ exerts))))

    def lifting_n(self, point_m: Vector, along: Vector) -> float:
        """Force along the unit vector ``along`` at this point that lifts a unit; infinite if none. Needs every unit's
        ``preload_n``."""
        if not np.isfinite(self._preload).all():
            raise HapticsError("preload_n is missing; give the preload of every unit")
        exerted = np.concatenate([along, np.cross(point_m, along)])
        per_newton = np.linalg.lstsq(self.matrix / self._gains, exerted, rcond=None)[0]
        falls = per_newton < 0
        return float((self._preload[falls] / -per_newton[falls]).min(initial=np.inf))

    def rezeroed(self, readings: Floats, zones: int, gravity_m_s2: Vector | None = None) -> LoadCells:
        """A copy with new zeros, from (m, n) readings without touch.

        Raises :class:`HapticsError` if ``zones`` are pressed, or readings vary by more than three times their noise.
        ``gravity_m_s2`` is in the link's frame; None: as when the last zeros were read.
        """
        if zones:
            raise HapticsError(f"{zones} zones are pressed; zeros are read while nothing touches")
        read = np.atleast_2d(self._read(readings))
        if len(read) < 10:
            raise HapticsError(f"{len(read)} readings are too few for a zero; give at least 10")
        varies = read.std(axis=0, ddof=1) * np.abs(self._gains)
        for index, unit in enumerate(self.units):
            if varies[index] > 3 * unit.sigma_n:
                raise HapticsError(
                    f"unit {index} varies by {varies[index]:.3g} N, its noise is {unit.sigma_n:g} N; something moves"
                )
        matrix = self.matrix if self.calibrated else None
        return self.changed(read.mean(axis=0), matrix, self.noise_n2, gravity_m_s2)

    def changed(
        self, zeros: Floats, matrix: Floats | None, noise_n2: Floats | None, gravity_m_s2: Vector | None = None
    ) -> LoadCells:
        """A copy with zeros (n,) in steps, matrix (6, n) in N and Nm per step or None, and noise covariance (n, n) in
        N2 or None."""
        return LoadCells(
            [dataclasses.replace(unit, zero=float(zero)) for unit, zero in zip(self.units, zeros)],
            frame=self.frame,
            bumper=self.bumper,
            zero_gravity_m_s2=self.zero_gravity_m_s2 if gravity_m_s2 is None else gravity_m_s2,
            matrix=matrix,
            surface=self.surface,
            sheet_m=self.sheet_m,
            noise_n2=noise_n2,
        )


def covariance(name: str, values: Any, count: int) -> Floats:
    """(count, count) covariance without zero variances. Raises :class:`HapticsError` for other values."""
    given = matrix(name, values, count, count)
    if not (np.diag(given) > 0).all():
        raise HapticsError(f"{name} has a variance of {np.diag(given).min():g}; each unit has some noise, above 0 N2")
    found = Noise.checked(given)
    assert found is not None
    return found.covariance


def reduced(rows: Floats) -> Floats:
    """Rows with the same span, reduced so that each involves few components."""
    found = np.array(rows)
    done = 0
    for column in range(found.shape[1]):
        if done == len(found):
            break
        largest = done + int(np.abs(found[done:, column]).argmax())
        if abs(found[largest, column]) < 1e-9:
            continue
        found[[done, largest]] = found[[largest, done]]
        found[done] /= found[done, column]
        others = np.arange(len(found)) != done
        found[others] -= found[others, column : column + 1] * found[done]
        done += 1
    return found


def _in_words(wrench: Floats) -> str:
    parts = [name for name, value in zip(COMPONENTS, wrench) if abs(value) > 1e-6]
    return " with ".join(parts)


MAX_UNITS = 64
KEYS = ("frame", "zero_gravity_m_s2", "matrix", "noise_n2", "surface", "bumper", "unit")
UNIT_KEYS = ("point_m", "axis", "gain_n", "zero", "sigma_n", "range", "preload_n")
BUMPER_KEYS = ("mass_kg", "center_m", "inertia_kg_m2")


def load(path: str | Path) -> dict[str, Any]:
    """The arguments of :class:`LoadCells`, from a units.toml. Raises :class:`HapticsError`, OSError."""
    values = tomlfile.load(path, HapticsError)
    try:
        return read(values)
    except HapticsError as error:
        raise HapticsError(f"{path}: {error}") from None


def read(values: dict[str, Any]) -> dict[str, Any]:
    """The arguments of :class:`LoadCells`, from the tables of a units.toml."""
    _known(values, KEYS, "the file")
    given = values.get("unit")
    if not isinstance(given, list) or not given:
        raise HapticsError("there is no unit; give a table [[unit]] with point_m and axis for each")
    if len(given) > MAX_UNITS:
        raise HapticsError(f"there are {len(given)} units; at most {MAX_UNITS} are read")
    units = [_unit(one, f"unit[{index}]") for index, one in enumerate(given)]
    frame = values.get("frame", "")
    if not isinstance(frame, str):
        raise HapticsError(f"frame is {shown(frame)}; it must be the name of the link's frame")
    gravity = vector("zero_gravity_m_s2", values.get("zero_gravity_m_s2", (0, 0, 0)), "m/s2")
    found = matrix("matrix", values["matrix"], 6, len(units)) if "matrix" in values else None
    bumper = _bumper(values["bumper"]) if "bumper" in values else None
    noise = covariance("noise_n2", values["noise_n2"], len(units)) if "noise_n2" in values else None
    made = {"units": units, "frame": frame, "bumper": bumper, "zero_gravity_m_s2": gravity, "matrix": found}
    made["noise_n2"] = noise
    return made | (_surface(values["surface"]) if "surface" in values else {})


def _surface(values: Any) -> dict[str, Any]:
    kind = dict(values) if isinstance(values, dict) else values
    place = kind.pop("sheet_m", (0.0, 0.0)) if isinstance(kind, dict) else None
    found = read_surface(kind)
    if not isinstance(place, (list, tuple)) or len(place) != 2:
        raise HapticsError(f"surface.sheet_m is {shown(place)}; it must be two numbers, x and y in m")
    x, y = (number(f"surface.sheet_m[{index}]", one, unit="m") for index, one in enumerate(place))
    return {"surface": found, "sheet_m": (x, y)}


def _unit(values: Any, name: str) -> Unit:
    _known(values, UNIT_KEYS, name)
    for key in ("point_m", "axis"):
        if key not in values:
            raise HapticsError(f"{key} is missing in {name}")
    gain = number(f"{name}.gain_n", values.get("gain_n", 1.0), unit="N")
    if gain == 0:
        raise HapticsError(f"{name}.gain_n is 0; it must be the newtons of a step of the reading")
    preload = values.get("preload_n")
    return Unit(
        vector(f"{name}.point_m", values["point_m"], "in m"),
        direction(f"{name}.axis", values["axis"]),
        gain,
        number(f"{name}.zero", values.get("zero", 0.0)),
        positive(f"{name}.sigma_n", values.get("sigma_n", 0.05), "N"),
        _range(f"{name}.range", values.get("range")),
        None if preload is None else number(f"{name}.preload_n", preload, 0, unit="N"),
    )


def _range(name: str, value: Any) -> tuple[float, float] | None:
    if value is None:
        return None
    if not isinstance(value, (list, tuple)) or len(value) != 2:
        raise HapticsError(f"{name} is {shown(value)}; it must be the two readings at the ends")
    low, high = (number(f"{name}[{index}]", one) for index, one in enumerate(value))
    if not low < high:
        raise HapticsError(f"{name} is {shown(value)}; the first reading must be below the second")
    return low, high


def _bumper(values: Any) -> Bumper:
    _known(values, BUMPER_KEYS, "bumper")
    if "mass_kg" not in values:
        raise HapticsError("mass_kg is missing in bumper")
    x, y, z = matrix("bumper.inertia_kg_m2", values.get("inertia_kg_m2", [[0] * 3] * 3), 3, 3).tolist()
    center = vector("bumper.center_m", values.get("center_m", (0, 0, 0)), "in m")
    return Bumper(positive("bumper.mass_kg", values["mass_kg"], "kg"), center, (tuple(x), tuple(y), tuple(z)))


def _known(values: Any, keys: tuple[str, ...], name: str) -> None:
    if not isinstance(values, dict):
        raise HapticsError(f"{name} is {shown(values)}; it must be a table with {', '.join(keys)}")
    for key in values:
        if key not in keys:
            raise HapticsError(f"unknown key {shown(key)} in {name}; {suggestion(key, keys)}")


def write(cells: LoadCells) -> str:
    """The text of a units.toml."""
    lines = [f"frame = {json.dumps(cells.frame)}"] if cells.frame else []
    if any(cells.zero_gravity_m_s2):
        lines.append(f"zero_gravity_m_s2 = {json.dumps(list(cells.zero_gravity_m_s2))}")
    if cells.calibrated:
        lines.append(f"matrix = {json.dumps(np.asarray(cells.matrix).tolist())}")
    if cells.noise_n2 is not None:
        lines.append(f"noise_n2 = {json.dumps(cells.noise_n2.tolist())}")
    if cells.surface:
        lines += ["", "[surface]", *_written(cells.surface), f"sheet_m = {json.dumps(list(cells.sheet_m))}"]
    if cells.bumper:
        lines += ["", "[bumper]", f"mass_kg = {cells.bumper.mass_kg!r}"]
        lines.append(f"center_m = {json.dumps(list(cells.bumper.center_m))}")
        lines.append(f"inertia_kg_m2 = {json.dumps([list(row) for row in cells.bumper.inertia_kg_m2])}")
    for unit in cells.units:
        lines += ["", "[[unit]]"]
        for key in UNIT_KEYS:
            value = getattr(unit, key)
            if value is not None:
                lines.append(f"{key} = {json.dumps(list(value) if isinstance(value, tuple) else value)}")
    return "\n".join(lines) + "\n"


def _written(outside: Surface) -> list[str]:
    kind = next(name for name, (made, _) in SURFACES.items() if isinstance(outside, made))
    length = SURFACES[kind][1]
    return [f'kind = "{kind}"', f"{length} = {getattr(outside, length)!r}"]
