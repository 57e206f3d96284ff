"""Families of scenes at random places, each scene by seed and number.

A scene is wholly on the sheet if it fits, else in the middle, within a pitch. Sheets of the same extents get the same
scenes whatever their pitch, shifted with the sheet's corner.
"""

from __future__ import annotations

import dataclasses
import math
import zlib
from collections.abc import Callable
from typing import Any

import numpy as np

from contactfpga.design.cover import Cover
from contactfpga.skin import Skin
from contactfpga_sim.model.scenes import contacts
from contactfpga_sim.model.scenes.contacts import Contact, M, Shape, Swing
from contactfpga_sim.model.scenes.scene import Scene, sheet

FINGER_MM = 6.0
"""Radius of the fingers of a pair."""

HALF_MM, RATIO = (5.0, 10.0), (0.6, 1.0)
"""Range of half lengths of a finger's ellipse, and of its width over its length."""

FINGERS_N = (2.0, 20.0)
"""Range of a finger's force."""

TRIES = 200
"""Places tried for another finger."""

Random = np.random.Generator


def placements(family: str, count: int, seed: int, skin: Skin, first: int = 0, **options: Any) -> list[Scene]:
    """``count`` scenes of a family at random places, each on a sheet drawn for it, from number ``first`` on.

    ``family``: one of :data:`FAMILIES`; ``options``: those of its function, such as ``gap_mm``. Scene n depends only on
    family, options, seed, the sheet's pitch and size, and n. Raises ValueError for an unknown family or option.
    """
    if family not in FAMILIES:
        raise ValueError(f"family {family!r} is not known; take one of {', '.join(FAMILIES)}")
    if count < 0 or seed < 0 or first < 0:
        raise ValueError(f"count is {count}, seed is {seed}, first is {first}; each must be 0 or above")
    name = zlib.crc32(family.encode())
    found = []
    for number in range(first, first + count):
        scene = FAMILIES[family](np.random.default_rng([name, seed, number]), skin, **options)
        drawn = int(np.random.default_rng([name, seed, number, 2]).integers(2**63))
        found.append(dataclasses.replace(scene, drawn=drawn))
    return found


APPROACH_MM_S = (50.0, 250.0)
"""Speeds of approach, up to the reduced speed of ISO 10218-1: chosen."""


def touches(
    family: str, count: int, seed: int, skin: Skin, cover: Cover | None = None, first: int = 0, **options: Any
) -> list[Scene]:
    """:func:`placements` with rising forces on a cover: all contacts touch at 0 s and come at one speed, drawn from
    :data:`APPROACH_MM_S`, until ``settled_s``."""
    name = zlib.crc32(family.encode())
    scenes = placements(family, count, seed, skin, first, **options)
    speeds = (
        float(np.random.default_rng([name, seed, number, 1]).uniform(*APPROACH_MM_S))
        for number in range(first, first + count)
    )
    return [scene.approaching(speed).on_cover(skin, cover) for scene, speed in zip(scenes, speeds, strict=True)]


def bumper(rng: Random, skin: Skin) -> Scene:
    """An ellipse 16 to 50 mm long, at any angle, 5 to 50 N."""
    long = rng.uniform(8, 25)
    shape = contacts.ellipse(long, long * rng.uniform(0.4, 1))
    angle, force = rng.uniform(0, 180), rng.uniform(5, 50)
    return Scene((_anywhere(rng, skin, shape, angle, force_n=force, body="forearm"),))


def fingers(
    rng: Random, skin: Skin, gap_mm: float = 5.0, most: int = 5, force_n: tuple[float, float] = FINGERS_N
) -> Scene:
    """Two to ``most`` fingers, ellipses 10 to 20 mm long at any angle, at least ``gap_mm`` apart, each of a force in a
    range; fewer if the sheet lacks room."""
    if gap_mm < 0 or most < 2:
        raise ValueError(f"gap_mm is {gap_mm} and most is {most}; they must be at least 0 and 2")
    placed: list[tuple[float, float, float]] = []
    found = []
    for _ in range(int(rng.integers(2, most + 1))):
        long, shape, angle, force = _finger(rng, force_n=force_n)
        turned = tuple(part.placed(0.0, 0.0, math.radians(angle)) for part in shape)
        for _ in range(TRIES):
            x, y = place(rng, skin, turned)
            if all(math.hypot(x - other_x, y - other_y) >= long + reach + gap_mm for other_x, other_y, reach in placed):
                placed.append((x, y, long))
                found.append(Contact(shape=shape, x_mm=x, y_mm=y, angle_deg=angle, force_n=force))
                break
    return Scene(tuple(found))


def finger(
    rng: Random, skin: Skin, half_mm: tuple[float, float] = HALF_MM, ratio: tuple[float, float] = RATIO
) -> Scene:
    """One finger as in :func:`fingers`; ``half_mm``, ``ratio``: ranges of half length, and of width over length."""
    _, shape, angle, force = _finger(rng, half_mm, ratio)
    return Scene((_anywhere(rng, skin, shape, angle, force_n=force),))


def _finger(
    rng: Random,
    half_mm: tuple[float, float] = HALF_MM,
    ratio: tuple[float, float] = RATIO,
    force_n: tuple[float, float] = FINGERS_N,
) -> tuple[float, Shape, float, float]:
    """Half length in mm, shape, angle in degrees and force in N."""
    long = rng.uniform(*half_mm)
    return long, contacts.ellipse(long, long * rng.uniform(*ratio)), rng.uniform(0, 180), rng.uniform(*force_n)


def pair(rng: Random, skin: Skin, gap_mm: float = 10.0, radius_mm: float = FINGER_MM) -> Scene:
    """Two round fingers with ``gap_mm`` between their rims, at any angle; 5 to 20 N each."""
    angle = rng.uniform(0, 180)
    loads = (contact.load(0.0) for contact in contacts.pair(gap_mm, radius_mm, 0.0, 0.0, angle))
    x, y = place(rng, skin, tuple(part for load in loads if load for part in load.parts))
    return Scene(contacts.pair(gap_mm, radius_mm, x, y, angle, force_n=rng.uniform(5, 20)))


def palm(rng: Random, skin: Skin) -> Scene:
    """A hand laid flat at any angle, 0.8 to 1.1 times its usual size, 20 to 80 N."""
    shape = contacts.palm(rng.uniform(0.8, 1.1))
    angle, force = rng.uniform(0, 360), rng.uniform(20, 80)
    return Scene((_anywhere(rng, skin, shape, angle, force_n=force, body="palm"),))


def sole(rng: Random, skin: Skin) -> Scene:
    """A bare foot 220 to 280 mm long, within 30 degrees of the columns, 200 to 600 N."""
    shape = contacts.sole(rng.uniform(220, 280))
    angle, force = rng.uniform(-30, 30), rng.uniform(200, 600)
    return Scene((_anywhere(rng, skin, shape, angle, force_n=force, body="palm"),))


def edge(rng: Random, skin: Skin, width_mm: float = 12.0) -> Scene:
    """A bar 50 to 120 mm long and ``width_mm`` wide at any angle, 10 to 60 N."""
    shape = contacts.edge(rng.uniform(50, 120), width_mm)
    angle, force = rng.uniform(0, 180), rng.uniform(10, 60)
    return Scene((_anywhere(rng, skin, shape, angle, force_n=force, body="rigid"),))


def moving(rng: Random, skin: Skin, speed_mm_s: float | None = None) -> Scene:
    """A finger that circles at ``speed_mm_s``, by default 50 to 1000 mm/s; 5 to 20 N."""
    left, right, top, bottom = (end / M for end in sheet(skin))
    finger = rng.uniform(5, 10)
    most = max(1.0, min(right - left, bottom - top) / 2 - finger)
    radius = rng.uniform(min(10.0, most / 2), most)
    speed = math.exp(rng.uniform(math.log(50), math.log(1000)))
    hertz = (speed if speed_mm_s is None else speed_mm_s) / (2 * math.pi * radius)
    x, y = place(rng, skin, contacts.disc(radius + finger))
    phase = rng.uniform(0, 2 * math.pi)
    around_x, around_y = Swing(x, radius, hertz, phase), Swing(y, radius, hertz, phase - math.pi / 2)
    return Scene((Contact(shape=contacts.disc(finger), x_mm=around_x, y_mm=around_y, force_n=rng.uniform(5, 20)),))


FAMILIES: dict[str, Callable[..., Scene]] = {
    family.__name__: family for family in (bumper, fingers, pair, palm, sole, edge, moving, finger)
}


def _anywhere(rng: Random, skin: Skin, shape: Shape, angle_deg: float, **values: Any) -> Contact:
    x, y = place(rng, skin, tuple(part.placed(0.0, 0.0, math.radians(angle_deg)) for part in shape))
    return Contact(shape=shape, x_mm=x, y_mm=y, angle_deg=angle_deg, **values)


def place(rng: Random, skin: Skin, shape: Shape) -> tuple[float, float]:
    """Position in mm of a shape's origin for a random place on the sheet."""
    left, right, top, bottom = sheet(skin)
    boxes = [(part.x_m, part.y_m, *part.half_box_m) for part in shape]
    ends = [(0.0, 0.0)] if skin.closed else [(x - half, x + half) for x, _, half, _ in boxes]  # it may lie on the seam
    x = _along(rng, left, right, ends, skin.pitch_x_mm)
    y = _along(rng, top, bottom, [(y - half, y + half) for _, y, _, half in boxes], skin.pitch_y_mm)
    return x, y


def _along(rng: Random, low: float, high: float, ends: list[tuple[float, float]], pitch_mm: float) -> float:
    first, last = low - min(start for start, _ in ends), high - max(end for _, end in ends)
    if first > last:
        middle = (first + last) / 2
        first, last = middle - pitch_mm * M / 2, middle + pitch_mm * M / 2
    return rng.uniform(first, last) / M
