"""Errors of places by the order of closings, beside those of barycenters, over simulated touches of the kits' sheet.

The table is fitted to touches of another seed, at the sheet's own frame rate.
"""

from __future__ import annotations

import bisect
import dataclasses
import functools
import math
import zlib
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import numpy as np

from contactfpga.design import kits
from contactfpga.design.cover import Body, Cover, load_cover
from contactfpga.design.cover.layers import Layer
from contactfpga.design.cover.numerics import Floats
from contactfpga.tracking.places import Places
from contactfpga.tracking.tracker import Tracker
from contactfpga.tracking.tracks import Track, Tracks
from contactfpga.zones.zone import Zones
from contactfpga_sim.apps import places, pool
from contactfpga_sim.apps.places import Place
from contactfpga_sim.apps.score import Z95
from contactfpga_sim.lab.tracking.scenes import zones_of
from contactfpga_sim.model.scenes import contacts
from contactfpga_sim.model.scenes.families import APPROACH_MM_S, placements
from contactfpga_sim.model.scenes.scene import Scene

KIT = kits.kit("starter")
SKIN, SHEET = KIT.skin, KIT.skin.sheet
PITCHES_MM = SHEET.pitch_x_mm, SHEET.pitch_y_mm
FIRM = Body("firm", 3e-3, Layer(6e-3, 200e3), "chosen: a firm fingertip, or soft rubber")

HZ = 10_000.0
RATES_HZ = (100.0, 1000.0, 3000.0, HZ, 1e6 / places.frame_us(kits.kit("fast").skin))
"""Frames per second of raster scans, and of the fast kit's reversal."""

LEVELS = (0.25, 0.5, 1.0, 2.0, 4.0)
"""Levels over the switch's closing force, of cells that no kit has."""

ANALOG, ANALOG_STEPS = 25.0, 255
"""Full scale of an analog array over the closing force, and its steps. Its gains have the spread of the closing
forces."""

AFTER_MS = (1.0, 2.0, 5.0, 10.0, 20.0, 40.0)
"""Times since the first cell closed."""

COUNT, MOVING_COUNT, PIECE, SEED = 400, 40, 20, 53


@dataclasses.dataclass(frozen=True)
class Case:
    """Touches under one condition."""

    title: str
    family: str = "finger"
    body: Body | None = None
    """What presses; None: the family's own."""
    hz: float = HZ
    spread: float | None = None
    """Spread of the closing forces; None: the kit's, which the table is fitted to."""
    bounce_s: float = 0.0
    """Longest time after its closing until which a cell opens once more."""
    late_s: float = 0.0
    """Longest delay of a closing, drawn for each cell: a debounce that waits for the end of the bounce."""
    lost: float = 0.0
    """Share of the frames with a change that are lost, where a board sends no others."""
    sensor: str = "switches"
    """``switches``; ``levels``: cells with :data:`LEVELS`; ``analog``: an 8-bit array read in one frame."""
    early: bool = False
    """Whether the time runs from the first crossing of the lightest level and not from when a switch would close."""
    speed_mm_s: float = 0.0
    """Speed at which the contact moves by :data:`FAR_MM`, on a straight line at any angle."""
    rises: bool = False
    """Whether it moves from when the first cell closes and not only once its force has risen. What moves before that
    closes no cell."""


FAR_MM, WAIT_S = 20.0, 0.02
"""Way of a moving contact, and its rest before it slides."""

RESTS_S = 0.001, 0.003, 0.01, 0.03, 0.1, 0.25
"""Times after the last change of frames of a touch that settles."""

STEP_MM, STEP_S = 0.1, 1e-3
"""Most from frame to frame of a moving contact."""

GROWING = (
    Case("a finger"),
    Case("a firm finger", body=FIRM),
    *(Case(f"`{family}`", family) for family in ("bumper", "fingers", "pair", "palm", "edge")),
    Case("a finger, no spread of closing forces", spread=0.0),
    Case("a finger, 20 % spread", spread=0.2),
    Case("a finger, 30 % spread", spread=0.3),
    Case("a finger, cells bounce for up to 1 ms", bounce_s=1e-3),
    Case("a finger, debounced, up to 1 ms late", late_s=1e-3),
    Case("a finger, a fifth of the frames lost", lost=0.2),
)
TIMED = (
    *(Case(f"{hz:,.0f} frames per second{' (reversal)' * (hz > HZ)}", body=FIRM, hz=hz) for hz in RATES_HZ),
    Case("five levels per cell", body=FIRM, sensor="levels"),
    Case("five levels, from their own first crossing", body=FIRM, sensor="levels", early=True),
    Case("8-bit analog array", body=FIRM, sensor="analog"),
)
MOVING = tuple(
    Case(f"{'rolls' if rises else 'slides'} at {speed:g} mm/s", speed_mm_s=speed, rises=rises)
    for rises in (False, True)
    for speed in (50.0, 200.0, 800.0)
)


@functools.cache
def cover(spread: float | None = None) -> Cover:
    """The kit's cover, with its spread of closing forces or another one."""
    found = load_cover(KIT.skin_path)
    assert found is not None
    switch = found.switch if spread is None else dataclasses.replace(found.switch, spread=spread)
    return dataclasses.replace(found, switch=switch)


@functools.cache
def table(levels: tuple[float, ...] = (1.0,)) -> Places:
    return places.fit(SKIN, cover(), 2000 // (1 + len(levels)), levels=levels)


def drawn(case: Case, number: int) -> tuple[Scene, np.random.Generator]:
    """Touch number n of a case, at a speed of the families, and random numbers. Cases of a family differ in nothing
    else."""
    (scene,) = placements(case.family, 1, SEED, SKIN, number)
    rng = np.random.default_rng([zlib.crc32(case.family.encode()), SEED, number, 1])
    if case.body is not None:
        pressing = tuple(dataclasses.replace(one, body=case.body) for one in scene.contacts)
        scene = dataclasses.replace(scene, contacts=pressing)
    return scene.approaching(float(rng.uniform(*APPROACH_MM_S))).on_cover(SKIN, cover(case.spread)), rng


def frames(changes_s: Floats, hz: float) -> Iterator[Zones]:
    """The frames in which cells change, and some at rest. (n, rows, columns) ``changes_s`` rise: a cell closes at the
    first time, opens at the second, and so on."""
    scans = np.ceil(changes_s * hz - 1e-9)
    changing = np.unique(scans[np.isfinite(scans)])
    for scan in (*changing, *(changing[-1:, None] + np.multiply(RESTS_S, hz)).flat):
        yield zones_of((scans <= scan).sum(axis=0) % 2 == 1, round(scan / hz * 1e6), SKIN)[0]


class Outcome(NamedTuple):
    """Errors in mm, averaged over the contacts of a touch and over time."""

    place: float
    barycenter: float
    covered: float
    """Share of places within the ellipse of 95 %."""
    moved: float
    """Share of contacts flagged as moved."""


def judged(tracks: Tracks, there: list[Place]) -> list[Outcome]:
    """Each contact with the nearest zone, if no other contact is nearer to that."""
    found, seen = [], [track for track in tracks.active if not track.held]
    for place in there if seen else ():
        track = min(seen, key=lambda one: math.dist(_middle(one), place))
        if math.dist(_middle(track), place) <= min(math.dist(_middle(track), other) for other in there):
            assert track.place_mm is not None
            assert track.place_cov_mm2 is not None
            error, barycenter = (math.dist(at, place) for at in (track.place_mm, _middle(track)))
            found.append(Outcome(error, barycenter, _covered(error, track.place_cov_mm2[0][0]), track.moved))
    return found


def _middle(track: Track) -> Place:
    assert track.zone.centroid_mm is not None
    return track.zone.centroid_mm


def _covered(off_mm: float, variance_mm2: float) -> bool:
    return off_mm**2 <= places.CHI2_95 * variance_mm2


def averaged(found: list[Outcome]) -> Outcome | None:
    return Outcome(*np.mean(found, axis=0).tolist()) if found else None


# ---- touches that grow in place

Timeline = list[Outcome | None]
"""After each of :data:`AFTER_MS`, and when the forces have risen; None without a contact."""


def grown(case: Case, number: int) -> Timeline:
    scene, rng = drawn(case, number)
    levels = LEVELS if case.sensor == "levels" else (1.0,)
    closing_s = places.closings(scene, SKIN, cover(case.spread), levels)
    where = places.whereabouts(scene, SKIN)
    if case.sensor == "analog":
        return _analog(scene, where(math.inf)[0], float(closing_s.min()))
    closing_s = closing_s + rng.uniform(0, 1 / case.hz) + rng.uniform(0, max(case.late_s, 1e-12), closing_s.shape)
    if case.sensor == "levels":
        return _levels(closing_s, case, where(math.inf)[0])
    if case.bounce_s:
        opens, closes = np.sort(rng.uniform(0, case.bounce_s, (2, *closing_s.shape[1:])), axis=0)
        closing_s = np.concatenate([closing_s, closing_s + opens, closing_s + closes])
    shown = list(frames(closing_s, case.hz))
    kept = [one for one in shown[:-1] if rng.random() >= case.lost] + shown[-1:]
    tracker = Tracker(places=table())
    said = [tracker.update(one) for one in kept]
    times_us = [one.time_us for one in said]
    return _at(times_us, lambda n: averaged(judged(said[n], where(said[n].time_us / 1e6))), *times_us[:1])


def _at(times_us: list[int], outcome: Callable[[int], Outcome | None], first_us: float = math.inf) -> Timeline:
    """The outcome of the last of rising times before each end, by the time since the first closing."""
    if math.isinf(first_us):
        return [None] * (len(AFTER_MS) + 1)
    ends = [bisect.bisect_right(times_us, first_us + 1e3 * after) for after in AFTER_MS]
    return [outcome(end - 1) for end in (*ends, len(times_us))]


def _levels(closing_s: Floats, case: Case, place: Place) -> Timeline:
    """A single contact of cells with levels, each crossing of which counts as a closing."""
    first_s = closing_s.min() if case.early else closing_s[LEVELS.index(1.0)].min()
    times_us, found = [], []
    for growth in places.grown(closing_s, 1e6 / case.hz):
        cells, middle = places.middle(growth, SHEET)
        one = table(LEVELS).of(growth, *middle, cells)
        off = math.dist(one[:2], place)
        times_us.append(growth.closings[-1].time_us)
        found.append(Outcome(off, math.dist(middle, place), _covered(off, one.variance_mm2), one.moved))
    return _at(times_us, found.__getitem__, 1e6 * (first_s + 1 / case.hz))


def _analog(scene: Scene, place: Place, first_s: float) -> Timeline:
    """A single contact by the forces on all cells at one moment, after the first switch would have closed."""
    found: Timeline = []
    sheet = places.cells(scene, SKIN, cover())
    for seconds in (*(first_s + 1e-3 * after for after in AFTER_MS), math.inf):
        shares = sheet.forces_n(scene.loads(min(seconds, scene.settled_s))) / sheet.thresholds_n
        steps = np.clip(np.rint(shares / ANALOG * ANALOG_STEPS), 0, ANALOG_STEPS)
        at = [
            (steps.sum(axis=axis) @ np.arange(steps.shape[1 - axis])) / steps.sum() * PITCHES_MM[axis]
            for axis in (0, 1)
        ]
        found.append(Outcome(math.dist(at, place), math.dist(at, place), math.nan, math.nan))
    return found


# ---- touches that move


def moved(case: Case, number: int) -> Timeline:
    """One outcome, over all frames; :attr:`Outcome.moved` is that of the last."""
    scene, rng = drawn(case, number)
    (contact,) = scene.contacts
    angle = rng.uniform(0, 2 * math.pi)
    middle = (contacts.at(value, 0.0) for value in (contact.x_mm, contact.y_mm))
    halves = FAR_MM / 2 * math.cos(angle), FAR_MM / 2 * math.sin(angle)
    ends = [(at - half, at + half) for at, half in zip(middle, halves)]
    begins = dataclasses.replace(contact, x_mm=ends[0][0], y_mm=ends[1][0])
    first_s = float(places.closings(dataclasses.replace(scene, contacts=(begins,)), SKIN, cover()).min())
    start_s = first_s if case.rises else scene.settled_s + WAIT_S
    if math.isinf(start_s):
        return [None]
    end_s, step_s = start_s + FAR_MM / case.speed_mm_s, min(STEP_S, STEP_MM / case.speed_mm_s)
    x, y = (contacts.Track((start_s, end_s), both) for both in ends)
    cells = Scene((dataclasses.replace(contact, x_mm=x, y_mm=y),), scene.drawn).on(SKIN, cover())
    tracker, found = Tracker(places=table()), []
    for seconds in np.arange(step_s, max(scene.settled_s, end_s) + WAIT_S, step_s).tolist():
        zones, _ = zones_of(cells(seconds), round(seconds * 1e6), SKIN)
        found += judged(tracker.update(zones), [(x(seconds), y(seconds))])
    whole = averaged(found)
    return [whole and whole._replace(moved=found[-1].moved)]


class Mean(NamedTuple):
    """Means over touches: errors in mm, and the place's over the barycenter's and the share covered, with halves of
    their 95 % intervals."""

    touches: int
    place: float
    barycenter: float
    ratio: float
    half: float
    covered: float
    covered_half: float
    moved: float


def mean(found: Iterable[Outcome | None]) -> Mean:
    place, barycenter, covered, flagged = np.array([one for one in found if one is not None]).T
    ratio = place.mean() / barycenter.mean()
    half = Z95 * (place - ratio * barycenter).std(ddof=1) / math.sqrt(len(place)) / barycenter.mean()
    covered_half = Z95 * covered.std(ddof=1) / math.sqrt(len(place))
    means = (place.mean(), barycenter.mean(), ratio, half, covered.mean(), covered_half, flagged.mean())
    return Mean(len(place), *(float(one) for one in means))


def _piece(case: Case, first: int) -> list[Timeline]:
    one = moved if case.speed_mm_s else grown
    return [one(case, number) for number in range(first, first + PIECE)]


def measured() -> dict[Case, list[Mean]]:
    """The means of each case after each time of :data:`AFTER_MS` and at the end; a moving one has one."""
    table(), table(LEVELS)  # before the workers part, which take them along
    with pool.executor() as workers:
        pending = {
            case: [workers.submit(_piece, case, first) for first in range(0, count, PIECE)]
            for cases, count in ((MOVING, MOVING_COUNT), (GROWING, COUNT), (TIMED, COUNT))
            for case in cases
        }
        lines = {case: [line for piece in pieces for line in piece.result()] for case, pieces in pending.items()}
    return {case: [mean(column) for column in zip(*found, strict=True)] for case, found in lines.items()}
