"""Knobs of touch, on a bare sheet and on the starter kit's covered one."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Iterable

import numpy as np

from contactfpga.choices.labellers import LABELLERS
from contactfpga.design.cover import Cover, load_cover
from contactfpga.design.kits import kit
from contactfpga.skin import Skin
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab.failures.rig import (
    REFERENCE,
    Rig,
    faults,
    hello_clocks,
    moments,
    places,
    plural,
    reported,
    seen,
)
from contactfpga_sim.lab.knobs import Knob, Outcome, RateTest
from contactfpga_sim.model.scenes import contacts
from contactfpga_sim.model.scenes.contacts import Contact, Track
from contactfpga_sim.model.scenes.scene import FINGER_MM, Scene

STARTER = kit("starter")
COVER = load_cover(STARTER.skin_path)


def _scene(pitch_mm: float, rng: np.random.Generator, touch: Callable[[float, float], Iterable[Contact]]) -> Scene:
    """Contacts around a place in the inner quarter of 16x16 switches, on a sheet drawn for them."""
    return Scene(tuple(touch(*pitch_mm * rng.uniform(4, 11, 2))), int(rng.integers(2**63)))


def _pair(
    gap_mm: float, radius_mm: float, pitch_mm: float, rng: np.random.Generator, force_n: float | None = None
) -> Scene:
    forces = {} if force_n is None else {"force_n": force_n}
    angle = rng.uniform(0, 180)
    return _scene(pitch_mm, rng, lambda x, y: contacts.pair(gap_mm, radius_mm, x, y, angle, **forces))


def _closing(skin: Skin, pitch_mm: float, gap_mm: float, rng: np.random.Generator, count: int) -> list[Outcome]:
    """The gateware does not depend on the pitch."""
    sheet = skin.replace(pitch_x_mm=pitch_mm, pitch_y_mm=pitch_mm)
    cells = np.array([_pair(gap_mm, 8.0, pitch_mm, rng).pressed(0.0, sheet) for _ in range(count)])
    return [_counted(zones, each, 2) for zones, each in zip(seen(skin, cells), cells)]


def _closing_covered(force_n: float, gap_mm: float, rng: np.random.Generator, count: int) -> list[Outcome]:
    skin = STARTER.skin
    scenes = (_pair(gap_mm, 8.0, skin.pitch_x_mm, rng, force_n) for _ in range(count))
    cells = np.array([scene.pressed(0.0, skin, COVER) for scene in scenes])
    return [_counted(zones, each, 2) for zones, each in zip(seen(skin, cells), cells)]


def _counted(zones: Zones, cells: np.ndarray, there: int) -> Outcome:
    what = f"{plural(len(zones), 'zone')} of {plural(there, 'contact')}"
    return Outcome(len(zones) == there, faults(zones), what, cells=cells, zones=places(zones))


CLOSING = Knob(
    name="closing",
    title="Two fingers of 16 mm that come close",
    axis="gap between their rims, mm",
    values=tuple(np.arange(16, -0.25, -0.5).round(2).tolist()),
    runs={
        f"{connectivity}-connectivity, {pitch} mm": RateTest(
            functools.partial(_closing, REFERENCE.replace(connectivity=connectivity), float(pitch))
        )
        for pitch in (10, 5)
        for connectivity in (8, 4)
    }
    | {f"starter kit, {force} N each": RateTest(functools.partial(_closing_covered, force)) for force in (2, 5, 10)},
    helps="a finer pitch; 4-connectivity; a light touch",
    unnoticed="the same switches are pressed as by one contact of that shape",
    # Wherever the pair lies, a row or column between the fingers is free: by 8-connectivity from sqrt(2) pitches on, by
    # 4-connectivity from one on.
    closed={
        f"{connectivity}-connectivity, {pitch} mm": round(pitch * (math.sqrt(2) if connectivity == 8 else 1), 2)
        for pitch in (10, 5)
        for connectivity in (8, 4)
    },
)


def _light(radius_mm: float, force_n: float, rng: np.random.Generator, count: int) -> list[Outcome]:
    skin = STARTER.skin

    def finger(x: float, y: float) -> tuple[Contact]:
        return (Contact(shape=contacts.disc(radius_mm), x_mm=x, y_mm=y, force_n=force_n),)

    scenes = (_scene(skin.pitch_x_mm, rng, finger) for _ in range(count))
    cells = np.array([scene.pressed(0.0, skin, COVER) for scene in scenes])
    return [_counted(zones, each, 1) for zones, each in zip(seen(skin, cells), cells)]


LIGHT = Knob(
    name="light",
    title="A finger that presses lightly on the starter kit",
    axis="force, N",
    values=(20, 15, 10, 8, 6, 5, 4, 3.5, 3, 2.5, 2, 1.5, 1.25, 1, 0.75, 0.5),
    runs={f"{2 * radius} mm": RateTest(functools.partial(_light, float(radius))) for radius in (4, 8, 12)},
    helps="switches of less force; `contactfpga cover felt` says from which force on a finger is felt",
    unnoticed="a switch that is pressed too lightly to close is one that nobody touches",
)

WAYS = ((1, 0), (-1, 0), (0, 1), (0, -1))
"""Directions along columns and rows, both ways."""

FIRST, LAST = 2.0, 13.0
"""Start and end of a moving finger, in pitches."""


def _slide(skin: Skin, cover: Cover | None, speed: float, rng: np.random.Generator) -> Outcome:
    """The frame with the largest error, for a finger of 10 N from any phase; infinite without exactly one zone."""
    derived, pitch = skin.derived, skin.pitch_x_mm
    way = WAYS[rng.integers(len(WAYS))]
    start = (hello_clocks(skin) + rng.uniform(0, derived.frame_clocks)) / skin.clock_hz
    end = start + (LAST - FIRST) / speed * derived.frame_clocks / skin.clock_hz
    ends = (FIRST * pitch, LAST * pitch)
    moving = Track((start, end), ends if sum(way) > 0 else ends[::-1])
    middle = rng.uniform(7, 8) * pitch
    x, y = (moving, middle) if way[0] else (middle, moving)
    scene = Scene((Contact(shape=contacts.disc(FINGER_MM), x_mm=x, y_mm=y),), int(rng.integers(2**63)))
    pressed = scene.on(skin, cover)
    with Rig(skin) as rig:
        while rig.board.cycle < end * skin.clock_hz:
            rig.board.press(pressed(rig.board.cycle / skin.clock_hz))
            rig.board.run(derived.row_clocks)
        rig.board.run(2 * rig.scan)
        frames = [zones for zones in rig.frames() if start * 1e6 <= zones.time_us <= end * 1e6]
    return max((_off(skin, cover, scene, zones) for zones in frames), key=lambda one: one.amount)


def _off(skin: Skin, cover: Cover | None, scene: Scene, zones: Zones) -> Outcome:
    seconds, far, what = zones.time_us / 1e6, math.inf, f"{plural(len(zones), 'zone')} of 1 contact"
    truth = scene.truth(seconds).contacts[0]
    if len(zones) == 1 and zones[0].x_mm is not None and zones[0].y_mm is not None:
        far = math.hypot(zones[0].x_mm - truth.x_mm, zones[0].y_mm - truth.y_mm) / skin.pitch_x_mm
        what = f"zone {far:.1f} pitches off"
    return Outcome(far <= 1, faults(zones), what, far, scene.pressed(seconds, skin, cover), places(zones))


def _moving(skin: Skin, cover: Cover | None, speed: float, rng: np.random.Generator, count: int) -> list[Outcome]:
    return [_slide(skin, cover, speed, rng) for _ in range(count)]


MOVING = Knob(
    name="moving",
    title="A finger of 24 mm that moves during the scan",
    axis="pitches per raster scan",
    values=(0.4, 0.6, 0.8, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0),
    runs={
        "`raster`": RateTest(functools.partial(_moving, REFERENCE, None), most=480),
        "starter kit, 10 N": RateTest(functools.partial(_moving, STARTER.skin, COVER), most=480),
    },
    helps="1 pitch a scan is 104 m/s on the reference sheet; a shorter row time",
    unnoticed="a zone one pitch from its finger looks like one in its place; only where faster motion tears a frame is "
    "it flagged",
)

DEBOUNCE_SCANS = 4
BOUNCING = Skin(rows=4, columns=4, baud=6_000_000)
"""A Skin with a scan of 24 us."""


def debounced(method: str) -> Skin:
    scan_us = BOUNCING.derived.frame_clocks / BOUNCING.derived.clocks_per_us
    times = {"debounce_press_us": DEBOUNCE_SCANS * scan_us, "debounce_release_us": DEBOUNCE_SCANS * scan_us}
    return BOUNCING.replace(debounce=method, **times)


def _touches(skin: Skin, closed_us: float, open_us: float, phase: int) -> int:
    rest, touch = np.zeros((2, 1, skin.rows, skin.columns), bool)
    touch[0, 2, 1] = True
    clocks = skin.derived.clocks_per_us
    with Rig(skin) as rig:
        rig.board.hold(rest, hello_clocks(skin) + phase)
        rig.board.hold(touch, round(closed_us * clocks))
        if open_us:
            rig.board.hold(rest, round(open_us * clocks))
        rig.board.hold(touch, (2 * DEBOUNCE_SCANS + 8) * rig.scan)
        states = [zones.pressed > 0 for zones in rig.frames()]
    return sum(now and not before for before, now in zip([False, *states], states))


def _bounce(skin: Skin, open_us: float, rng: np.random.Generator, count: int) -> list[Outcome]:
    closed_us, phases = np.geomspace(30, 300, 100), rng.integers(0, skin.derived.frame_clocks, count)
    counts = [
        _touches(skin, closed, open_us, int(phase)) for closed, phase in zip(rng.choice(closed_us, count), phases)
    ]
    return [Outcome(touches == 1, (), f"{touches} touches of 1", touches) for touches in counts]


BOUNCE = Knob(
    name="bounce",
    title=f"A switch that bounces; debounce of {24 * DEBOUNCE_SCANS} us",
    axis="time for which it opens once more, us",
    values=tuple(range(0, 193, 12)),
    runs={
        f"`{method}`": RateTest(functools.partial(_bounce, BOUNCING if method == "none" else debounced(method)))
        for method in ("none", "sym_defer_pk", "asym_eager_defer_pk")
    },
    helps="longer debounce times than the switch bounces; nobody can tell a long bounce from a second touch",
    unnoticed="a switch that opens and closes once more is what a second touch is",
    # A switch that is open for the release time counts as released.
    closed={f"`{method}`": 24.0 * DEBOUNCE_SCANS for method in ("sym_defer_pk", "asym_eager_defer_pk")},
)


CAPACITY = 8

SKINS = {name: REFERENCE.replace(labeller=name) for name in LABELLERS}


def arm(size: int, quarters: int) -> np.ndarray:
    """(size, size) bool: an arm one cell wide that winds inward with a free cell between turns."""
    cells = np.zeros((size, size), bool)
    y, x, (dy, dx) = 0, 0, (0, 1)
    cells[y, x] = True
    for quarter in range(quarters):
        for _ in range(size - 1 - 2 * max(0, (quarter - 1) // 2)):
            y, x = y + dy, x + dx
            cells[y, x] = True
        dy, dx = dx, -dy
    return cells


def _winding(skin: Skin, quarters: float, rng: np.random.Generator, count: int) -> list[Outcome]:
    around = arm(skin.rows, int(quarters))
    finger = np.zeros_like(around)
    middle = slice(skin.rows // 2 - 1, skin.rows // 2 + 1)
    finger[middle, middle] = True
    ways = [
        (int(turns), bool(mirrored)) for turns, mirrored in zip(rng.integers(4, size=count), rng.random(count) < 0.5)
    ]
    pairs = [[_turned(one, *way) for one in (around, finger)] for way in ways]
    frames = seen(skin, np.array([np.logical_or(*pair) for pair in pairs]))
    return [_both(zones, pair) for zones, pair in zip(frames, pairs)]


def _turned(cells: np.ndarray, turns: int, mirrored: int) -> np.ndarray:
    turned = np.rot90(cells, turns)
    return turned.T if mirrored else turned


def _both(zones: Zones, pair: list[np.ndarray]) -> Outcome:
    right = reported(zones) == sorted(map(moments, pair))
    return dataclasses.replace(_counted(zones, np.logical_or(*pair), 2), right=right)


WINDING = Knob(
    name="winding",
    title="An arm that winds around a finger",
    axis="quarters of a turn",
    values=tuple(range(12)),
    runs={f"`{name}`": RateTest(functools.partial(_winding, skin)) for name, skin in SKINS.items()},
    helps="an exact labeller: `run` or `serial`",
    unnoticed="`projection` and `single` keep the shadows of what is pressed, and both shapes have the same ones",
)


def _crossing(skin: Skin, distance_mm: float, rng: np.random.Generator, count: int) -> list[Outcome]:
    gap, pitch = distance_mm - 2 * FINGER_MM, skin.pitch_x_mm
    scenes = [_pair(gap, FINGER_MM, pitch, rng) for _ in range(count)]
    cells = np.array([scene.pressed(0.0, skin) for scene in scenes])
    counts = [scene.truth(0.0).count for scene in scenes]
    return [_counted(zones, each, there) for zones, each, there in zip(seen(skin, cells), cells, counts)]


CROSSING = Knob(
    name="crossing",
    title="Two fingers of 24 mm, side by side at any angle",
    axis="distance of their middles, mm",
    values=tuple(range(70, 24, -1)),
    runs={f"`{name}`": RateTest(functools.partial(_crossing, SKINS[name])) for name in ("run", "projection", "single")},
    helps="an exact labeller; a sheet turned so that shadows part",
    unnoticed="pressed cells that touch are one zone by definition; `projection` and `single` see shadows only",
    # As for two fingers that close in: 24 mm and sqrt(2) pitches.
    closed={"`run`": 38.14},
)


def _many(skin: Skin, count: float, rng: np.random.Generator, draws: int) -> list[Outcome]:
    cells = np.zeros((draws, skin.rows // 2, skin.columns // 2), bool)
    for each in cells:
        each.flat[rng.choice(each.size, int(count), replace=False)] = True
    frames = np.zeros((draws, skin.rows, skin.columns), bool)
    frames[:, ::2, ::2] = cells
    return [_each(zones, frame) for zones, frame in zip(seen(skin, frames), frames)]


def _each(zones: Zones, cells: np.ndarray) -> Outcome:
    right = reported(zones) == sorted((1, int(column), int(row)) for row, column in zip(*np.nonzero(cells)))
    what = f"{len(zones)} of {int(cells.sum())} zones; `total_zones` says {zones.total_zones}"
    return Outcome(right and not zones.flags, faults(zones), what, cells=cells, zones=places(zones))


MANY = Knob(
    name="capacity",
    title=f"More zones than `zone_capacity = {CAPACITY}`",
    axis="zones on the sheet",
    values=(*range(1, 13), 16, 32, 64),
    runs={"any labeller": RateTest(functools.partial(_many, REFERENCE.replace(zone_capacity=CAPACITY)))},
    helps='a larger `zone_capacity`; `report = "cells"`',
)
