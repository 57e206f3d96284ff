"""Arrangements of units under a bumper, rated for a link by the contacts they must find; and a picture.

The matrix's condition number is no rating, as it depends on the origin and on the unit of length.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from contactfpga import picture_style as style
from contactfpga.robot.haptics.units import LoadCells, Unit
from contactfpga.robot.haptics.values import HapticsError, cross, number, positive, skew
from contactfpga.robot.haptics.wrench import ALARM, Cylinder, Noise, Surface, Wrench
from contactfpga.surfaces.shapes import Floats, Vector

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclasses.dataclass(frozen=True)
class UnitLayout:
    """Units with a name."""

    name: str
    cells: LoadCells


def _unit(radius_m: float, degrees: float, z_m: float, tilt: float, sign: float) -> Unit:
    angle = math.radians(degrees)
    x, y = math.cos(angle), math.sin(angle)
    across = sign * math.cos(tilt)
    axis: Vector = (-across * y, across * x, math.sin(tilt))
    return Unit((radius_m * x, radius_m * y, z_m), axis)


def hexapod(radius_m: float, tilt: float, z_m: float = 0.0) -> LoadCells:
    """Six units on a ring about z, 60 degrees apart, tilted by ``tilt`` rad from the ring toward z, alternately to
    either side."""
    return LoadCells([_unit(radius_m, 60 * i, z_m, tilt, (-1) ** i) for i in range(6)])


def two_rings(radius_m: float, tilt: float, low_m: float, high_m: float) -> LoadCells:
    """The units of :func:`hexapod`, those tilted to one side on a ring at ``low_m``, the others at ``high_m``."""
    return LoadCells([_unit(radius_m, 60 * i, high_m if i % 2 else low_m, tilt, (-1) ** i) for i in range(6)])


def tripod(radius_m: float, z_m: float = 0.0) -> LoadCells:
    """Three units along z at 90, 210 and 330 degrees, which see force and place on a plane but no friction."""
    return LoadCells([_unit(radius_m, 90 + 120 * i, z_m, math.pi / 2, 1) for i in range(3)])


TILTS = tuple(range(30, 80, 5))
"""Degrees that :func:`on_cylinder` scans."""


def on_cylinder(radius_m: float, low_m: float, high_m: float) -> list[UnitLayout]:
    """Arrangements on rings of this radius, in a cylinder touched from z = ``low_m`` to ``high_m``."""
    middle, quarter = (low_m + high_m) / 2, (high_m - low_m) / 4
    found = []
    for degrees in TILTS:
        tilt = math.radians(degrees)
        found += [
            UnitLayout(f"hexapod at mid-length, {degrees} degrees", hexapod(radius_m, tilt, middle)),
            UnitLayout(f"hexapod at one end, {degrees} degrees", hexapod(radius_m, tilt, low_m)),
            UnitLayout(
                f"two rings at the quarters, {degrees} degrees",
                two_rings(radius_m, tilt, middle - quarter, middle + quarter),
            ),
            UnitLayout(f"two rings at the ends, {degrees} degrees", two_rings(radius_m, tilt, low_m, high_m)),
        ]
    return found


def on_plane(radius_m: float, height_m: float) -> list[UnitLayout]:
    """Arrangements on a ring of this radius, under a flat bumper whose outside is at z = ``height_m``."""
    tilts = [UnitLayout(f"hexapod, {degrees} degrees", hexapod(radius_m, math.radians(degrees))) for degrees in TILTS]
    return [UnitLayout("3 on a plane", tripod(radius_m)), *tilts]


AROUND = 24
"""Places around a cylinder."""
ALONG = 9
"""Places along a cylinder, and along each side of a plane."""
SLANTS = 12
"""Directions of friction."""


@dataclasses.dataclass(frozen=True)
class Requirements:
    """A link's surface and its required loads."""

    surface: Surface
    size_m: tuple[float, float]
    """Touched part: z range of a cylinder; width and depth of a plane about z."""
    force_n: float = 30.0
    """Largest push, with friction, anywhere; units are chosen to bear it."""
    friction: float = 0.5
    noise: float = 0.001
    """Standard deviation of a unit, as a share of its required load."""
    at_n: float = 12.0
    """Push for the stated errors."""
    mass_kg: float = 0.0
    """Mass of the bumper."""
    acceleration_sigma_m_s2: float = 0.1
    """Uncertainty of gravity and motion when the bumper's weight is subtracted."""

    def __post_init__(self) -> None:
        positive("force_n", self.force_n, "N")
        positive("at_n", self.at_n, "N")
        number("friction", self.friction, 0, 10)
        positive("noise", self.noise, "")
        number("mass_kg", self.mass_kg, 0, 1e3, "kg")
        number("acceleration_sigma_m_s2", self.acceleration_sigma_m_s2, 0, 1e3, "m/s2")
        first, second = (number("size_m", one, unit="m") for one in self.size_m)
        if isinstance(self.surface, Cylinder):
            if not first < second:
                raise HapticsError(f"the cylinder runs from {first:g} to {second:g} m; the first must be less")
        else:
            positive("width", first, "m")
            positive("depth", second, "m")

    def places(self) -> list[tuple[Vector, Vector]]:
        """Points and unit normals of the tried contacts."""
        first, second = self.size_m
        if isinstance(self.surface, Cylinder):
            round_m = 2 * math.pi * self.surface.radius_m
            flat = [(round_m * step / AROUND, z) for z in np.linspace(first, second, ALONG) for step in range(AROUND)]
        else:
            across = np.linspace(-0.5, 0.5, ALONG)
            flat = [(first * x, second * y) for y in across for x in across]
        return [self.surface.place(float(x), float(y)) for x, y in flat]

    @functools.cached_property
    def slopes(self) -> Floats:
        """(n, 2, 6): derivative of the center of pressure by the wrench at the stated push, by place."""
        found = []
        for point, normal in self.places():
            fx, fy, fz = (-self.at_n * one for one in normal)
            if isinstance(self.surface, Cylinder):
                wrench = Wrench((fx, fy, fz), cross(point, (fx, fy, fz)))
                found.append(self.surface.slopes(wrench, -self.at_n, normal, point[2]))
            else:
                found.append(self.surface.slopes(fz, point[0], point[1]))
        return np.array(found)

    @property
    def middle_m(self) -> Vector:
        """Assumed center of mass of the bumper."""
        if isinstance(self.surface, Cylinder):
            return (0.0, 0.0, sum(self.size_m) / 2)
        return (0.0, 0.0, self.surface.height_m)


@dataclasses.dataclass(frozen=True)
class Rating:
    """Figures of an arrangement, for the worst place unless stated otherwise."""

    layout: UnitLayout
    bears_n: float
    """Required load of a single unit."""
    sigma_n: float
    """Noise of such a unit."""
    place_m: float
    """Standard deviation of the center of pressure's distance from the contact."""
    force_n: float
    """Standard deviation of the force at a known place."""
    seen_n: float
    """Smallest detectable force in any direction that friction allows."""
    seen: Floats
    """(places, directions): smallest detectable force, straight, then with friction all around."""
    errors_m: Floats
    """``place_m`` by place."""


def compared(needs: Requirements, radius_m: float) -> list[Rating]:
    """All arrangements on rings of this radius that bear the loads, best place first."""
    positive("the ring's radius", radius_m, "m")
    if isinstance(needs.surface, Cylinder):
        layouts = on_cylinder(radius_m, *needs.size_m)
    else:
        layouts = on_plane(radius_m, needs.surface.height_m)
    found = [rating for rating in (rate(needs, layout) for layout in layouts) if rating is not None]
    return sorted(found, key=lambda rating: rating.place_m)


def rate(needs: Requirements, layout: UnitLayout) -> Rating | None:
    """The rating of an arrangement; None if the units cannot hold the loads."""
    cells = layout.cells
    sees_friction = cells.rank == 6
    places = needs.places()
    pushes = _wrenches(places, 0.0 if not sees_friction else needs.friction)
    borne = needs.force_n * np.linalg.pinv(cells.geometry, rcond=1e-9) @ pushes.T
    if not np.allclose(cells.geometry @ borne, needs.force_n * pushes.T, atol=1e-6 * needs.force_n):
        return None
    bears = float(np.abs(borne).max())
    sigma = needs.noise * bears
    noise = Noise(sigma**2 * cells.geometry @ cells.geometry.T + _weight(needs, sees_friction))
    errors = np.sqrt(((needs.slopes @ noise.covariance) * needs.slopes).sum(axis=(1, 2)))
    seen = _seen(pushes, noise).reshape(len(places), -1)
    force = _force_n(noise, places, sees_friction)
    return Rating(layout, bears, sigma, float(errors.max()), force, float(seen.max()), seen, errors)


def _weight(needs: Requirements, sees_friction: bool) -> Floats:
    carried = np.concatenate([np.eye(3), skew(needs.middle_m)])
    spread = (needs.mass_kg * needs.acceleration_sigma_m_s2) ** 2 * carried @ carried.T
    if not sees_friction:  # guides take what units along z do not
        kept = np.zeros(6)
        kept[2:5] = 1.0
        spread = spread * np.outer(kept, kept)
    return np.asarray(spread)


def _wrenches(places: list[tuple[Vector, Vector]], friction: float) -> Floats:
    """(m, 6): pushes of 1 N at each place, straight and with friction in every direction."""
    points, normals = (np.array(each) for each in zip(*places))
    # Around a cylinder, and then along it.
    first = np.cross(np.where(np.abs(normals[:, 2:]) > 0.5, [[1.0, 0, 0]], [[0, 0, 1.0]]), normals)
    second = np.cross(normals, first)
    angles = [2 * math.pi * step / SLANTS for step in range(SLANTS)] if friction else []
    forces = [-normals] + [
        -normals + friction * (math.cos(angle) * first + math.sin(angle) * second) for angle in angles
    ]
    stacked = np.stack([np.concatenate([force, np.cross(points, force)], axis=1) for force in forces], axis=1)
    return np.asarray(stacked.reshape(-1, 6))


def _seen(pushes: Floats, noise: Noise) -> Floats:
    """(m,): newtons at which each push raises the alarm of a wrench without a zone."""
    felt = ((pushes @ noise.information) * pushes).sum(axis=1)
    slanted = np.linalg.norm(pushes[:, :3], axis=1)
    return np.asarray(slanted * np.sqrt(ALARM[noise.rank - 1] / np.maximum(felt, 1e-30)))


def _force_n(noise: Noise, places: list[tuple[Vector, Vector]], sees_friction: bool) -> float:
    exerts = np.array([np.concatenate([np.eye(3), skew(point)]) for point, _ in places])
    if not sees_friction:
        exerts = exerts @ np.array([normal for _, normal in places])[:, :, None]
    spread = np.linalg.inv(exerts.transpose(0, 2, 1) @ noise.information @ exerts)
    return float(np.sqrt(np.trace(spread, axis1=1, axis2=2).max()))


def draw(path: Path, needs: Requirements, ratings: list[Rating]) -> Path:
    """Draw the best arrangement, its smallest detectable force, and all others. The same input gives the same file."""
    import matplotlib

    with matplotlib.rc_context(style.SETTINGS):
        figure = style.new(6.6)
        grid = figure.add_gridspec(2, 2, width_ratios=(1, 1), height_ratios=(6, 5))
        _draw_units(figure.add_subplot(grid[0, 0], projection="3d"), needs, ratings[0])
        _draw_seen(figure, figure.add_subplot(grid[0, 1]), needs, ratings[0].seen)
        _draw_map(
            figure, figure.add_subplot(grid[1, 1]), needs, 1e3 * ratings[0].errors_m, "the best: error of the place, mm"
        )
        others = figure.add_subplot(grid[1, 0])
        _draw_all(others, ratings)
        figure.legend(
            *others.get_legend_handles_labels(), loc="outside lower left", ncols=4, title="All that were tried"
        )
        return style.save(figure, path)


def _draw_units(place: Axes, needs: Requirements, rating: Rating) -> None:
    length = 0.35 * max(float(np.ptp([unit.point_m for unit in rating.layout.cells.units], axis=0).max()), 0.02)
    points = np.array([point for point, _ in needs.places()])
    place.plot(*(1e3 * points.T), ".", ms=2, color=style.PRESSED)
    for unit in rating.layout.cells.units:
        start = 1e3 * np.array(unit.point_m)
        end = start + 1e3 * length * np.array(unit.axis)
        place.plot(*np.stack([start, end], axis=1), color=style.VERMILLION, linewidth=2)
        place.plot(*start[:, None], "o", ms=4, color=style.BLUE)
    place.set_title(f"the best: {rating.layout.name}", loc="left", fontsize=style.NORMAL)
    place.set_box_aspect(np.ptp(points, axis=0) + 0.3 * float(np.ptp(points, axis=0).max()))
    place.set(xlabel="x, mm", ylabel="y, mm", zlabel="z, mm")
    place.locator_params(nbins=3)


def _draw_map(figure: Figure, place: Axes, needs: Requirements, values: Floats, name: str) -> None:
    first, second = needs.size_m
    if isinstance(needs.surface, Cylinder):
        shown, extent = values.reshape(ALONG, AROUND), (0.0, 360.0, 1e3 * first, 1e3 * second)
        place.set(xlabel="place around the link, degrees", ylabel="place along the link, mm")
    else:
        shown, extent = values.reshape(ALONG, ALONG), (-500 * first, 500 * first, -500 * second, 500 * second)
        place.set(xlabel="x, mm", ylabel="y, mm")
    image = place.imshow(shown, origin="lower", extent=extent, aspect="auto", cmap="cividis")
    figure.colorbar(image, ax=place)
    place.set_title(name, loc="left", fontsize=style.NORMAL)


def _draw_seen(figure: Figure, place: Axes, needs: Requirements, seen: Floats) -> None:
    first, second = needs.size_m
    if not isinstance(needs.surface, Cylinder) or seen.shape[1] == 1:
        _draw_map(figure, place, needs, seen.max(axis=1), "the best: smallest force seen, N")
        return
    shown = seen.reshape(ALONG, AROUND, -1).max(axis=1)[:, 1:]
    extent = (0.0, 360.0, 1e3 * first, 1e3 * second)
    image = place.imshow(shown, origin="lower", extent=extent, aspect="auto", cmap="cividis")
    figure.colorbar(image, ax=place)
    place.set(
        xlabel="direction of the drag, degrees\n(0 is around the link, 90 along it)", ylabel="place along the link, mm"
    )
    place.set_title("the best: smallest force seen, N", loc="left", fontsize=style.NORMAL)


def _draw_all(place: Axes, ratings: list[Rating]) -> None:
    kinds = list(dict.fromkeys(rating.layout.name.rpartition(",")[0] or rating.layout.name for rating in ratings))
    for index, kind in enumerate(kinds):
        ones = [rating for rating in ratings if rating.layout.name.startswith(kind)]
        errors, forces = [1e3 * one.place_m for one in ones], [one.seen_n for one in ones]
        look: dict[str, Any] = {"ms": 9 - 1.5 * index, "mfc": "none", "mew": 1.4, "color": style.PALETTE[index]}
        place.plot(errors, forces, "os^Dv"[index % 5], label=kind, **look)
    place.set(xlabel="error of the place, mm", ylabel="smallest force seen, N", xlim=(0, None), ylim=(0, None))
    place.grid()
