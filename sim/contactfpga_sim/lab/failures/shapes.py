"""Knobs of shape and number: an arm that winds, shadows that cross, more zones than a frame carries."""

from __future__ import annotations

import functools

import numpy as np

from contactfpga.choices.labellers import LABELLERS
from contactfpga.skin import Skin
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab.failures.knob import Knob, Outcome
from contactfpga_sim.lab.failures.rig import REFERENCE, faults, moments, places, plural, reported, still
from contactfpga_sim.model.scenes import contacts
from contactfpga_sim.model.scenes.scene import FINGER_MM, Scene

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
