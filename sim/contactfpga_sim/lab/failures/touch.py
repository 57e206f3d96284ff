"""Knobs of touch: two contacts that come close, one that moves during a scan, switches that bounce; an arm that winds,
shadows that cross, more zones than a frame carries."""

from __future__ import annotations

import functools
import math

import numpy as np

from contactfpga.choices.labellers import LABELLERS
from contactfpga.skin import Skin
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab.failures.knob import Knob, Outcome
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
    still,
)
from contactfpga_sim.lab.sheets import adaptive_skin
from contactfpga_sim.model.scenes import contacts
from contactfpga_sim.model.scenes.contacts import Contact, Track
from contactfpga_sim.model.scenes.scene import FINGER_MM, Scene

PLACES = 24
"""Places of a pair within a pitch, and angles; the worst one counts."""


def _pairs(gap_mm: float, pitch_mm: float) -> list[Scene]:
    """Two fingers of 8 mm radius, which cover a switch wherever they are, spread over places and angles."""
    found = []
    for number in range(PLACES):
        x, y, turn = ((number * step) % 1 for step in (0.618034, 0.754878, 0.569840))
        middle = 7.0 * pitch_mm
        found.append(Scene(contacts.pair(gap_mm, 8.0, middle + x * pitch_mm, middle + y * pitch_mm, 180.0 * turn)))
    return found


def _closing(skin: Skin, pitch_mm: float, gap_mm: float) -> Outcome:
    """The pitch is in no wire of the gateware: the same one serves sheets of any pitch."""
    sheet = skin.replace(pitch_x_mm=pitch_mm, pitch_y_mm=pitch_mm)
    cells = np.array([scene.pressed(0.0, sheet) for scene in _pairs(gap_mm, pitch_mm)])
    frames = seen(skin, cells)
    wrong = [index for index, zones in enumerate(frames) if len(zones) != 2]
    shown = wrong[0] if wrong else 0
    return Outcome(
        right=not wrong,
        told=tuple({fault for index in wrong for fault in faults(frames[index])}),
        what=f"1 zone of 2 contacts at {len(wrong)} of {PLACES} places",
        amount=1 - len(wrong) / PLACES,
        cells=cells[shown],
        zones=places(frames[shown]),
    )


CLOSING = Knob(
    name="closing",
    title="Two fingers of 16 mm that come close",
    axis="gap between their rims, mm",
    amount="share of places counted right",
    values=tuple(np.arange(20, -0.25, -0.5).round(2).tolist()),
    runs={
        "8-connectivity, 10 mm": functools.partial(_closing, REFERENCE, 10.0),
        "4-connectivity, 10 mm": functools.partial(_closing, REFERENCE.replace(connectivity=4), 10.0),
        "8-connectivity, 5 mm": functools.partial(_closing, REFERENCE, 5.0),
        "4-connectivity, 5 mm": functools.partial(_closing, REFERENCE.replace(connectivity=4), 5.0),
    },
    helps="a finer pitch; 4-connectivity",
    unnoticed="the same switches are pressed as by one contact of that shape",
)

WAYS = ((1, 0), (-1, 0), (0, 1), (0, -1))
"""Directions of motion: along the columns and along the rows, both ways."""

FIRST, LAST = 2.0, 13.0
"""Where a moving finger starts and ends, in pitches."""


def _slide(skin: Skin, speed: float, way: tuple[int, int]) -> tuple[float, Zones, np.ndarray]:
    """The frame whose zones are farthest from the finger at the frame's time: distance in pitches, frame, pressed cells
    at that time. A frame without exactly one zone is infinitely far."""
    derived, pitch = skin.derived, skin.pitch_x_mm
    start = hello_clocks(skin) / skin.clock_hz
    end = start + (LAST - FIRST) / speed * derived.frame_clocks / skin.clock_hz
    ends = (FIRST * pitch, LAST * pitch)
    moving = Track((start, end), ends if sum(way) > 0 else ends[::-1])
    middle = 7.3 * pitch
    x, y = (moving, middle) if way[0] else (middle, moving)
    scene = Scene((Contact(shape=contacts.disc(FINGER_MM), x_mm=x, y_mm=y),))
    with Rig(skin) as rig:
        while rig.board.cycle < end * skin.clock_hz:
            rig.board.press(scene.pressed(rig.board.cycle / skin.clock_hz, skin))
            rig.board.run(derived.row_clocks)
        rig.board.run(2 * rig.scan)
        frames = [zones for zones in rig.frames() if start * 1e6 <= zones.time_us <= end * 1e6]
    found = []
    for zones in frames:
        seconds = zones.time_us / 1e6
        truth = scene.truth(seconds).contacts[0]
        far = math.inf
        if len(zones) == 1 and zones[0].x_mm is not None and zones[0].y_mm is not None:
            far = math.hypot(zones[0].x_mm - truth.x_mm, zones[0].y_mm - truth.y_mm) / pitch
        found.append((far, zones, scene.pressed(seconds, skin)))
    return max(found, key=lambda one: one[0])


def _moving(skin: Skin, speed: float) -> Outcome:
    far, zones, cells = max((_slide(skin, speed, way) for way in WAYS), key=lambda one: one[0])
    what = f"zone {far:.1f} pitches off" if math.isfinite(far) else f"{plural(len(zones), 'zone')} of 1 contact"
    return Outcome(far <= 1, faults(zones), what, min(far, 5.0), cells, places(zones))


MOVING = Knob(
    name="moving",
    title="A finger of 24 mm that moves during the scan",
    axis="pitches per raster scan",
    amount="pitches off at the frame's time",
    values=(0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0),
    runs={
        "`raster`": functools.partial(_moving, REFERENCE),
        "`adaptive`": functools.partial(_moving, adaptive_skin(16, 16)),
    },
    helps="1 pitch a scan is 104 m/s on the reference sheet; a shorter row time, `adaptive`",
)

DEBOUNCE_SCANS = 4
BOUNCING = Skin(rows=4, columns=4, baud=6_000_000)
"""Its scan takes 24 us."""


def debounced(method: str) -> Skin:
    """A sheet whose debounce times are :data:`DEBOUNCE_SCANS` scans."""
    scan_us = BOUNCING.derived.frame_clocks / BOUNCING.derived.clocks_per_us
    times = {"debounce_press_us": DEBOUNCE_SCANS * scan_us, "debounce_release_us": DEBOUNCE_SCANS * scan_us}
    return BOUNCING.replace(debounce=method, **times)


def _touches(skin: Skin, closed_us: float, open_us: float, phase: int) -> int:
    """How often the host sees the sheet touched when a switch closes for a time, opens for a time and closes again."""
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


def _bounce(skin: Skin, open_us: float) -> Outcome:
    scan = skin.derived.frame_clocks
    shortly, for_good = 30.0, 300.0
    counts = [
        _touches(skin, closed_us, open_us, phase * scan // 4) for closed_us in (shortly, for_good) for phase in range(4)
    ]
    most = max(counts)
    return Outcome(set(counts) == {1}, (), f"{most} touches of 1", most)


BOUNCE = Knob(
    name="bounce",
    title=f"A switch that bounces; debounce of {24 * DEBOUNCE_SCANS} us",
    axis="time for which it opens once more, us",
    amount="touches seen",
    values=tuple(range(0, 193, 12)),
    runs={
        f"`{method}`": functools.partial(_bounce, BOUNCING if method == "none" else debounced(method))
        for method in ("none", "sym_defer_pk", "asym_eager_defer_pk")
    },
    helps="longer debounce times than the switch bounces; nobody can tell a long bounce from a second touch",
    unnoticed="a switch that opens and closes once more is what a second touch is",
)


CAPACITY = 8

SKINS = {name: REFERENCE.replace(labeller=name) for name in LABELLERS}


def arm(size: int, quarters: int) -> np.ndarray:
    """(size, size) bool: an arm one cell wide that winds inwards, a free cell between its turns."""
    cells = np.zeros((size, size), bool)
    y, x, (dy, dx) = 0, 0, (0, 1)
    cells[y, x] = True
    for quarter in range(quarters):
        for _ in range(size - 1 - 2 * max(0, (quarter - 1) // 2)):
            y, x = y + dy, x + dx
            cells[y, x] = True
        dy, dx = dx, -dy
    return cells


def _counted(zones: Zones, cells: np.ndarray, right: bool, what: str) -> Outcome:
    """The outcome where the picture shows how many zones there are."""
    return Outcome(right, faults(zones), what, len(zones), cells, places(zones))


def _winding(skin: Skin, quarters: float) -> Outcome:
    around = arm(skin.rows, int(quarters))
    finger = np.zeros_like(around)
    middle = slice(skin.rows // 2 - 1, skin.rows // 2 + 1)
    finger[middle, middle] = True
    zones = still(skin, around | finger)
    right = reported(zones) == sorted([moments(around), moments(finger)])
    return _counted(zones, around | finger, right, f"{plural(len(zones), 'zone')} of 2 contacts")


WINDING = Knob(
    name="winding",
    title="An arm that winds around a finger",
    axis="quarters of a turn",
    amount="zones",
    values=tuple(range(12)),
    runs={f"`{name}`": functools.partial(_winding, skin) for name, skin in SKINS.items()},
    helps="an exact labeller: `run` or `serial`",
    unnoticed="`projection` and `single` keep the shadows of what is pressed, and both shapes have the same ones",
)


def _crossing(skin: Skin, distance_mm: float) -> Outcome:
    middle = (skin.rows - 1) * skin.pitch_y_mm / 2
    pair = contacts.pair(distance_mm - 2 * FINGER_MM, FINGER_MM, middle, middle, 45.0)
    scene = Scene(pair)
    cells = scene.pressed(0.0, skin)
    zones = still(skin, cells)
    right = len(zones) == scene.truth(0.0).count
    return _counted(zones, cells, right, f"{plural(len(zones), 'zone')} of {scene.truth(0.0).count} contacts")


CROSSING = Knob(
    name="crossing",
    title="Two fingers of 24 mm, one diagonally behind the other",
    axis="distance of their middles, mm",
    amount="zones",
    values=tuple(range(70, 24, -1)),
    runs={f"`{name}`": functools.partial(_crossing, SKINS[name]) for name in ("run", "projection", "single")},
    helps="an exact labeller; a sheet turned so that shadows part",
    unnoticed="pressed cells that touch are one zone by definition; `projection` and `single` see shadows only",
)


def _many(skin: Skin, count: float) -> Outcome:
    cells = np.zeros((skin.rows, skin.columns), bool)
    spots = [(2 * (place // (skin.columns // 2)), 2 * (place % (skin.columns // 2))) for place in range(int(count))]
    for row, column in spots:
        cells[row, column] = True
    zones = still(skin, cells)
    right = reported(zones) == sorted((1, column, row) for row, column in spots) and not zones.flags
    return _counted(zones, cells, right, f"{len(zones)} of {int(count)} zones; `total_zones` says {zones.total_zones}")


MANY = Knob(
    name="capacity",
    title=f"More zones than `zone_capacity = {CAPACITY}`",
    axis="zones on the sheet",
    amount="zones in the frame",
    values=(*range(1, 13), 16, 32, 64),
    runs={"any labeller": functools.partial(_many, REFERENCE.replace(zone_capacity=CAPACITY))},
    helps='a larger `zone_capacity`; `report = "cells"`',
)
