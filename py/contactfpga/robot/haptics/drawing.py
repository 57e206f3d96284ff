"""Pictures of arrangements of units; needs matplotlib. The same input gives the same file."""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from contactfpga import picture_style as style
from contactfpga.robot.haptics.rate import ALONG, AROUND, Rating, Requirements
from contactfpga.robot.haptics.wrench import Cylinder
from contactfpga.surfaces.shapes import Floats


def draw(path: Path, needs: Requirements, ratings: list[Rating]) -> Path:
    """The best arrangement, the smallest force it sees everywhere, and all others beside it."""
    with matplotlib.rc_context(style.SETTINGS):
        figure = style.new(5.6)
        grid = figure.add_gridspec(2, 2, width_ratios=(2, 3))
        _units(figure.add_subplot(grid[0, 0], projection="3d"), needs, ratings[0])
        _seen(figure, figure.add_subplot(grid[0, 1]), needs, ratings[0].seen)
        _map(figure, figure.add_subplot(grid[1, 1]), needs, 1e3 * ratings[0].errors_m, "error of the place, mm")
        others = figure.add_subplot(grid[1, 0])
        _all(others, ratings)
        figure.legend(*others.get_legend_handles_labels(), loc="outside lower center", ncols=4)
        return style.save(figure, path)


def _units(place: Axes, needs: Requirements, rating: Rating) -> None:
    """Where the units stand, and how each pushes."""
    length = 0.35 * max(float(np.ptp([unit.point_m for unit in rating.layout.cells.units], axis=0).max()), 0.02)
    points = np.array([point for point, _ in needs.places()])
    place.plot(*(1e3 * points.T), ".", ms=2, color=style.PRESSED)
    for unit in rating.layout.cells.units:
        start = 1e3 * np.array(unit.point_m)
        end = start + 1e3 * length * np.array(unit.axis)
        place.plot(*np.stack([start, end], axis=1), color=style.VERMILLION, linewidth=2)
        place.plot(*start[:, None], "o", ms=4, color=style.BLUE)
    place.set_title(rating.layout.name, loc="left", fontsize=style.NORMAL)
    place.set_box_aspect(np.ptp(points, axis=0) + 0.3 * float(np.ptp(points, axis=0).max()))
    place.set(xlabel="x, mm", ylabel="y, mm", zlabel="z, mm")
    place.locator_params(nbins=3)


def _map(figure: Figure, place: Axes, needs: Requirements, values: Floats, name: str) -> None:
    first, second = needs.size_m
    if isinstance(needs.surface, Cylinder):
        shown, extent = values.reshape(ALONG, AROUND), (0.0, 360.0, 1e3 * first, 1e3 * second)
        place.set(xlabel="around the link, degrees", ylabel="along it, mm")
    else:
        shown, extent = values.reshape(ALONG, ALONG), (-500 * first, 500 * first, -500 * second, 500 * second)
        place.set(xlabel="x, mm", ylabel="y, mm")
    image = place.imshow(shown, origin="lower", extent=extent, aspect="auto", cmap="cividis")
    figure.colorbar(image, ax=place)
    place.set_title(name, loc="left")


def _seen(figure: Figure, place: Axes, needs: Requirements, seen: Floats) -> None:
    """By place; around a cylinder that makes no difference, so there by direction instead."""
    first, second = needs.size_m
    if not isinstance(needs.surface, Cylinder) or seen.shape[1] == 1:
        _map(figure, place, needs, seen.max(axis=1), "smallest force seen, N")
        return
    shown = seen.reshape(ALONG, AROUND, -1).max(axis=1)[:, 1:]
    extent = (0.0, 360.0, 1e3 * first, 1e3 * second)
    image = place.imshow(shown, origin="lower", extent=extent, aspect="auto", cmap="cividis")
    figure.colorbar(image, ax=place)
    place.set(xlabel="drag, degrees: 0 around the link, 90 along it", ylabel="along it, mm")
    place.set_title("smallest force seen, N", loc="left")


def _all(place: Axes, ratings: list[Rating]) -> None:
    kinds = list(dict.fromkeys(rating.layout.name.rpartition(",")[0] or rating.layout.name for rating in ratings))
    for number, kind in enumerate(kinds):
        ones = [rating for rating in ratings if rating.layout.name.startswith(kind)]
        errors, forces = [1e3 * one.place_m for one in ones], [one.seen_n for one in ones]
        place.plot(errors, forces, "os^Dv"[number % 5], ms=4, color=style.PALETTE[number], label=kind)
    place.set(xlabel="error of the place, mm", ylabel="smallest force seen, N", xlim=(0, None), ylim=(0, None))
    place.set_title("all that were tried", loc="left")
