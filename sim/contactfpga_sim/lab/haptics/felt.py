"""End to end: contacts press a sheet on three units, compiled gateware sends, driver and haptics answer.

A push rises by 1.6 N per ms, as the arm's does. Each method estimates the place from data since the first switch
closed.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Sequence

import numpy as np

import contactfpga
from contactfpga.robot.haptics import AloneWatch, ClosingWatch, LoadCells, Locator, Plane, WithReadings, felt
from contactfpga.robot.haptics.rate import tripod
from contactfpga.skin import Skin
from contactfpga.surfaces.shapes import Floats
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab.haptics.coverage import MIDDLE, POINT, reach_of
from contactfpga_sim.model.board.virtual import VirtualBoard
from contactfpga_sim.model.scenes.contacts import Contact, Track, disc
from contactfpga_sim.model.scenes.felt import UnitReadings
from contactfpga_sim.model.scenes.scene import Scene

RATE_N_S = 1600.0
MOST_N = 30.0
LEAD_S = 1.5e-3
"""Time from power-up until the first switch closes."""
LOOK_S = 20e-6
RING_M = 0.075
GAIN_N = 0.02
ZERO = 300.0

TIMES_S = (0.25e-3, 0.5e-3, 1e-3, 2e-3, 4e-3, 8e-3, 15e-3)

METHODS = ("barycenter", "center of pressure", "closings", "closings + center of pressure")


@dataclasses.dataclass(frozen=True)
class Setting:
    """A sheet, and the quality of its parts."""

    name: str
    pitch_mm: float
    unit_sigma_n: float = 0.05
    spread: float = 0.0
    lines: int = 16

    @property
    def skin(self) -> Skin:
        return Skin(
            rows=self.lines, columns=self.lines, pitch_x_mm=self.pitch_mm, pitch_y_mm=self.pitch_mm,
            units=3, unit_sums=((1, 1, 1),), baud=6_000_000,
        )  # fmt: skip

    @property
    def cells(self) -> LoadCells:
        """Three units on a ring around the sheet's middle."""
        middle = -0.5e-3 * self.pitch_mm * (self.lines - 1)
        units = [
            dataclasses.replace(unit, gain_n=GAIN_N, zero=ZERO, sigma_n=self.unit_sigma_n)
            for unit in tripod(RING_M).units
        ]
        return LoadCells(units, surface=Plane(), sheet_m=(middle, middle))


SETTINGS = (
    Setting("10 mm", 10.0),
    Setting("5 mm", 5.0),
    Setting("5 mm, 0.5 N of noise, thresholds spread by 10 %", 5.0, 0.5 / math.sqrt(3), 0.1),
)


@dataclasses.dataclass(frozen=True)
class Touching:
    """A point force whose push rises."""

    setting: Setting
    place_m: Floats
    """(2,) place on the sheet."""
    seed: int

    @functools.cached_property
    def closing_n(self) -> Floats:
        """(rows, columns) push in N that closes each switch."""
        along = 1e-3 * self.setting.pitch_mm * np.arange(self.setting.lines)
        x, y = np.meshgrid(along, along)
        spread = 1 + self.setting.spread * np.random.default_rng([self.seed, 7]).standard_normal(x.shape)
        return reach_of(POINT).closing_n(np.hypot(x - self.place_m[0], y - self.place_m[1])) * np.maximum(spread, 0.1)

    def push(self, seconds: float) -> float:
        return min(MOST_N, max(0.0, float(self.closing_n.min()) + RATE_N_S * (seconds - LEAD_S)))

    def pressed(self, seconds: float) -> np.ndarray:
        """(rows, columns) bool closed switches."""
        found: np.ndarray = self.closing_n <= self.push(seconds)
        return found

    def board(self) -> VirtualBoard:
        cells, rng = self.setting.cells, np.random.default_rng([self.seed, 8])
        x, y = self.place_m + np.array(cells.sheet_m)
        each = np.linalg.pinv(cells.matrix) @ np.array([0, 0, -1, -y, x, 0])
        sigma = self.setting.unit_sigma_n / GAIN_N

        def readings(seconds: float) -> list[int]:
            noisy = self.push(seconds) * each + ZERO + sigma * rng.standard_normal(3)
            steps: list[int] = np.clip(np.rint(noisy), 0, 4095).astype(int).tolist()
            return steps

        return VirtualBoard(self.setting.skin, self.pressed, units=readings, look_s=LOOK_S)


@dataclasses.dataclass
class FrameArrival:
    """A frame, with host times of it and of its readings."""

    zones: Zones
    came_s: float
    known_s: float = math.inf


def heard(touching: Touching, until_s: float) -> list[FrameArrival]:
    found: list[FrameArrival] = []
    open_ones: list[FrameArrival] = []
    with contactfpga.open(touching.board(), touching.setting.skin) as board:
        while board.clock() < until_s:
            one = FrameArrival(board.next(), board.clock())
            found.append(one)
            open_ones.append(one)
            for each in [each for each in open_ones if each.zones.units is not None]:
                each.known_s = one.came_s
                open_ones.remove(each)
    return found


def ramp(setting: Setting, seed: int) -> Touching:
    """One contact anywhere in a middle cell."""
    return Touching(setting, (MIDDLE + np.random.default_rng(seed).random(2)) * 1e-3 * setting.pitch_mm, seed)


def errors(setting: Setting, seed: int, times_s: Sequence[float] = TIMES_S) -> dict[str, list[float]]:
    """Errors in m of a contact, by method at these rising times; NaN without an answer."""
    touching, cells = ramp(setting, seed), setting.cells
    frames = heard(touching, LEAD_S + times_s[-1] + 0.2e-3)
    assert cells.noise.covariance is not None
    push_sigma = math.sqrt(float(cells.noise.covariance[2, 2]) + (RATE_N_S * 0.15e-3) ** 2 / 12)
    finder = Locator(setting.skin.sheet, reach_of(POINT), setting.spread, push_sigma)
    truth = touching.place_m
    found: dict[str, list[float]] = {method: [] for method in METHODS}
    watch, taken = ClosingWatch(cells), 0
    for time_s in times_s:
        now = LEAD_S + time_s
        came = [one.zones for one in frames if one.came_s <= now]
        known = [one.zones for one in frames if one.known_s <= now]
        for zones in known[taken:]:
            watch.take(zones)
        taken = len(known)
        for method, place in _places(finder, cells, watch, came, known).items():
            found[method].append(math.nan if place is None else float(np.hypot(*(np.array(place) - truth))))
    return found


def _places(
    finder: Locator, cells: LoadCells, watch: ClosingWatch, came: list[Zones], known: list[Zones]
) -> dict[str, tuple[float, float] | None]:
    zone = came[-1][0] if came and len(came[-1]) else None
    coarse = None if zone is None or zone.x_mm is None else (1e-3 * zone.x_mm, 1e-3 * (zone.y_mm or 0.0))
    center = None
    if known and known[-1].units is not None and cells.surface is not None:
        pressure = cells.surface.center(cells.wrench(known[-1].units.readings))
        center = None if pressure is None else finder.center(pressure, cells.sheet_m)
    middle = None if center is None else (center.x_m, center.y_m)
    found = {"barycenter": coarse, "center of pressure": middle}
    for method, also in (("closings", None), ("closings + center of pressure", center)):
        if watch.complete and watch.cells and watch.push_n is not None:
            place = finder.locate(watch.cells, watch.push_n, watch.closings, also)
            found[method] = (place.x_m, place.y_m)
        else:
            found[method] = coarse if also is None else middle
    return found


@dataclasses.dataclass(frozen=True)
class PairForces:
    zones: int
    off_n: tuple[float, ...]
    """Error of each push, if there are two zones."""


FINGER_MM = 6.0
FINGER = f"finger of {2 * FINGER_MM:g} mm"
KINDS = POINTS, AT_ONCE, ONE_FIRST = ("point", FINGER, f"{FINGER}, one of them alone before")
FIRST_S = 0.025
BOTH = 4
"""Frames of both contacts; the last counts."""


def two(apart_mm: float, seed: int, kind: str = POINTS, push_n: float = 12.0) -> PairForces:
    """Pushes of two contacts at a distance, at a random place and angle of the sheet of 10 mm. Points are where each
    alone closes a switch; fingers are anywhere."""
    setting = SETTINGS[0]
    cells, skin = setting.cells, setting.skin
    near_mm = 1e3 * reach_of(POINT).reach_m(push_n) if kind == POINTS else math.inf
    places = pair(setting, apart_mm, near_mm, np.random.default_rng([seed, 9]))
    pushes = (push_n, Track((FIRST_S - 1e-6, FIRST_S), (0.0, push_n)) if kind == ONE_FIRST else push_n)
    fingers = tuple(
        Contact(shape=disc(FINGER_MM), x_mm=x, y_mm=y, force_n=push) for (x, y), push in zip(places, pushes)
    )
    units = UnitReadings(Scene(fingers), cells, skin, seed)
    if kind == POINTS:
        each = np.array([1 / Touching(setting, 1e-3 * np.array(place), seed).closing_n for place in places])
        closed = push_n * each.sum(axis=0) >= 1
        board = VirtualBoard(skin, lambda seconds: closed, units=units)
    else:
        board = VirtualBoard(skin, Scene(fingers), units=units)
    with contactfpga.open(board, skin) as opened:
        frames, alone, both = WithReadings(opened), AloneWatch(cells), 0
        while both < BOTH and opened.clock() < FIRST_S + 0.02:
            zones = frames.next()
            alone.take(zones)
            both += len(zones) == 2
    found = felt(cells, zones, friction=0.0, alone=alone)
    if found is None or len(zones) != 2:
        return PairForces(len(zones), ())
    true_m = 1e-3 * np.array(places) + np.array(cells.sheet_m)
    pairs = [min(found, key=lambda one: math.dist(one.point_m[:2], place)) for place in true_m]
    return PairForces(2, tuple((one.normal_n or 0.0) - push_n for one in pairs))


def pair(setting: Setting, apart_mm: float, near_mm: float, rng: np.random.Generator) -> list[tuple[float, float]]:
    """Two places in mm, each within ``near_mm`` of a switch."""
    pitch = setting.pitch_mm
    while True:
        turn, half = rng.uniform(0, 2 * math.pi), apart_mm / 2
        x, y = (MIDDLE + rng.random(2)) * pitch
        places = [(x + side * half * math.cos(turn), y + side * half * math.sin(turn)) for side in (-1, 1)]
        off = [math.hypot(x - pitch * round(x / pitch), y - pitch * round(y / pitch)) for x, y in places]
        if max(off) < near_mm:
            return places
