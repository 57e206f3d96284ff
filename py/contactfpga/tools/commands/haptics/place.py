"""The command `contactfpga haptics place`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from contactfpga.robot.haptics import Cylinder, LoadCells, Plane
from contactfpga.robot.haptics.rate import Rating, Requirements, UnitLayout, compared, draw, rate
from contactfpga.robot.haptics.values import HapticsError
from contactfpga.robot.haptics.wrench import Surface
from contactfpga.tools.console import flags, numbers, outputs, results

EXTRA = "haptics"

SHOWN = 3


def add_flags(flag: flags.Flags) -> None:
    length = numbers.length(10.0)
    link = flag.group("link: a cylinder about z, or a plane")
    link("--radius M", "Outer radius of a cylinder, with its foam.", length)
    link("--length M", "Length of the cylinder that may be touched.", length)
    link("--width M", "Size of a plane along x.", length)
    link("--depth M", "Size of a plane along y.", length)
    link("--height M", "Height of the plane above the units.", numbers.length(10.0, 0.0), 0.0)
    units = flag.group("units")
    ring = "Radius of the rings that units stand on (default: 0.8 of the cylinder's, 0.4 of the plane's smaller side)."
    units("--ring M", ring, length)
    units("--noise SHARE", "Noise of a unit, as a share of what it must bear.", numbers.number(1e-9, 1), 0.001)
    units("--units FILE", "Also rate the units in this TOML file.")
    loads = flag.group("loads")
    newton = numbers.number(1e-3, 1e6, "N")
    loads("--force N", "Largest push.", newton, 30.0)
    loads("--friction MU", "Friction coefficient.", numbers.number(0, 10), 0.5)
    loads("--at N", "Push at which errors are stated.", newton, 12.0)
    mass = "Mass of the bumper, whose weight is taken out in every pose."
    loads("--mass KG", mass, numbers.number(0, 1000, "kg"), 0.0)
    sigma = "With --mass: how accurately gravity and motion are known."
    loads("--acceleration-sigma M/S2", sigma, numbers.number(0, 100, "m/s2"), 0.1)
    flag("--all", "Print every arrangement, not only the best of each kind.")
    flag("--picture FILE", "Draw the best one into this .svg or .png (extra sim).")
    flags.json(flag, flags.SI)


def run(args: argparse.Namespace) -> int:
    surface, size, ring = _link(args)
    picture = _picture(args.picture)
    loads = (args.force, args.friction, args.noise, args.at, args.mass, args.acceleration_sigma)
    needs = Requirements(surface, size, *loads)
    ratings = compared(needs, args.ring or ring)
    if args.units:
        ratings = sorted([*ratings, _own(needs, args.units)], key=lambda rating: rating.place_m)
    answer = {"layouts": [_answer(rating) for rating in ratings]}
    results.show(args, answer, lambda: _show(needs, ratings if args.all else _best(ratings)))
    if picture is not None:
        draw(picture, needs, ratings)
    return 0


def _link(args: argparse.Namespace) -> tuple[Surface, tuple[float, float], float]:
    round_link = args.radius is not None or args.length is not None
    if round_link == (args.width is not None or args.depth is not None):
        raise HapticsError(
            "the link is missing; give --radius and --length of a cylinder, or --width and --depth of a plane"
        )
    if round_link:
        if args.radius is None or args.length is None:
            raise HapticsError(f"{'--radius' if args.radius is None else '--length'} is missing; a cylinder has both")
        return Cylinder(args.radius), (-args.length / 2, args.length / 2), 0.8 * args.radius
    if args.width is None or args.depth is None:
        raise HapticsError(f"{'--width' if args.width is None else '--depth'} is missing; a plane has both")
    return Plane(args.height), (args.width, args.depth), 0.4 * min(args.width, args.depth)


def _picture(path: str | None) -> Path | None:
    if path is None:
        return None
    if Path(path).suffix.lower() not in (".svg", ".png"):
        raise HapticsError(f"--picture is {path!r}; its name must end in .svg or .png")
    return outputs.file(path, "--picture")


def _own(needs: Requirements, path: str) -> Rating:
    rating = rate(needs, UnitLayout(Path(path).name, LoadCells.load(path)))
    if rating is None:
        raise HapticsError(f"{path}: these units cannot hold the loads; they see too few components of a wrench")
    return rating


def _best(ratings: list[Rating]) -> list[Rating]:
    kinds: dict[str, list[Rating]] = {}
    for rating in ratings:
        name = rating.layout.name
        kinds.setdefault(name.rpartition(",")[0] or name, []).append(rating)
    return [one for one in ratings if any(one in kind[:SHOWN] for kind in kinds.values())]


def _answer(rating: Rating) -> dict[str, Any]:
    units = [{"point_m": list(unit.point_m), "axis": list(unit.axis)} for unit in rating.layout.cells.units]
    numbers_of = {name: getattr(rating, name) for name in ("bears_n", "sigma_n", "place_m", "force_n", "seen_n")}
    return {"name": rating.layout.name, **numbers_of, "rank": rating.layout.cells.rank, "units": units}


def _show(needs: Requirements, ratings: list[Rating]) -> None:
    from contactfpga.tools.console import tables

    head = [
        "units",
        "a unit bears, N",
        f"error of the place at {needs.at_n:g} N, mm",
        "of the force, N",
        "smallest force seen, N",
    ]
    rows = [head]
    for one in ratings:
        figures = (f"{one.bears_n:.1f}", f"{1e3 * one.place_m:.3f}", f"{one.force_n:.3f}", f"{one.seen_n:.3f}")
        rows.append([one.layout.name, *figures])
    tables.show(rows)
