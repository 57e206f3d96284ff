"""Touches cell by cell, and the table that places contacts by the times at which cells close."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from contactfpga.design.cover import Cover, cells_of
from contactfpga.design.cover.numerics import Floats
from contactfpga.skin import Skin
from contactfpga.tracking.places import Places, Row
from contactfpga.tracking.tracker import Tracker
from contactfpga.tracking.tracks import Track
from contactfpga.wire.protocol import Frame
from contactfpga.zones import labels
from contactfpga.zones.zone import Zones
from contactfpga_sim.model.scenes.contacts import M
from contactfpga_sim.model.scenes.families import touches
from contactfpga_sim.model.scenes.scene import Scene

STEPS = 40
"""Moments of a rise at which forces are computed. Between them each is linear in time."""

FITTED, FLAT = ("finger", "bumper"), "edge"
"""Families of touches that a table is fitted to, and one whose cells close as their forces are spread."""

CELLS = (1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 14, 18, 23, 30, 40, 55, 75, 100)
"""Least cells of a row."""

FEWEST = 100
"""States from which a row is fitted."""

CHI2_95 = -2 * math.log(0.05)
"""Squared distance, over the variance along each axis, that 95 % of places in a plane keep."""

FLATTEST = 0.95
"""Share of the states of flat bodies whose times say nothing."""

Touch = tuple[Floats, tuple[tuple[float, float], ...], float]
"""(rows, columns) closing times in s, inf for cells that stay open; places of the contacts in mm; and the time in s by
which all forces have risen."""


def touch(scene: Scene, skin: Skin, cover: Cover) -> Touch:
    """A scene of :func:`~contactfpga_sim.model.scenes.families.touches` on a cover that goes by stress."""
    until = scene.settled_s
    times = np.linspace(0, until, STEPS + 1)
    cells = cells_of(cover, skin.rows, skin.columns, skin.pitch_x_mm * M, skin.pitch_y_mm * M, scene.drawn)
    forces = np.array([cells.forces_n(scene.loads(seconds)) for seconds in times])
    places = tuple((one.x_mm, one.y_mm) for one in scene.truth(until, skin).contacts)
    return crossings(times, forces, cells.thresholds_n), places, until


def crossings(times: Floats, forces: Floats, thresholds: Floats) -> Floats:
    """Times at which (times, rows, columns) forces first reach thresholds; inf where they do not."""
    reached = np.maximum.accumulate(forces)
    after = (reached >= thresholds).argmax(axis=0)
    before = np.maximum(after - 1, 0)
    low, high = (np.take_along_axis(reached, at[None], 0)[0] for at in (before, after))
    share = np.clip((thresholds - low) / np.maximum(high - low, 1e-12), 0, 1)
    found = times[before] + share * (times[after] - times[before])
    return np.where(reached[-1] >= thresholds, found, np.inf)


def frame(cells: np.ndarray, time_us: int, skin: Skin) -> Zones:
    """The frame of (rows, columns) bool cells."""
    moments = labels.moments(labels.label(cells, skin.connectivity))
    sent = Frame(
        sequence=0,
        time_us=time_us % (1 << 24),
        flags=frozenset(),
        overwritten=0,
        heard=0,
        zones=len(moments),
        cells=int(cells.sum()),
        moments=moments,
        bitmap=None,
        barycenters=None,
    )
    return Zones(sent, skin.sheet, time_us)


def frames(closing_s: Floats, skin: Skin, period_us: float) -> Iterator[Zones]:
    """The frames in which cells close, of those that begin every ``period_us``."""
    scans = np.ceil(closing_s * 1e6 / period_us - 1e-9)
    for scan in np.unique(scans[np.isfinite(scans)]).tolist():
        yield frame(scans <= scan, round(scan * period_us), skin)


class State(NamedTuple):
    """A contact after a change of its zone."""

    track: Track
    place: tuple[float, float]
    """True place of the nearest contact in mm; no other zone is nearer to it."""
    time_us: int


def states(shown: Iterable[Zones], places: tuple[tuple[float, float], ...], table: Places) -> Iterator[State]:
    """The contacts after each change of their zones, as a tracker places them."""
    tracker, before = Tracker(places=table), {}
    for zones in shown:
        tracks = tracker.update(zones)
        now = {track.id: track.zone for track in tracks.active if not track.held}
        for track in tracks.active:
            if track.id not in now or track.zone == before.get(track.id):
                continue
            place = min(places, key=lambda one: math.dist(one, middle(track)))
            if all(math.dist(place, middle(track)) <= math.dist(place, middle(other)) for other in tracks.active):
                yield State(track, place, tracks.time_us)
        before = now


def middle(track: Track) -> tuple[float, float]:
    """The barycenter of a contact's zone in mm."""
    assert track.zone.centroid_mm is not None
    return track.zone.centroid_mm


def fit(skin: Skin, cover: Cover, count: int = 1000, seed: int = 0) -> Places:
    """The table of a sheet, by so many simulated touches of each family. Raises CoverError for the model ``patch``."""
    skin = dataclasses.replace(skin, closed=False, report="moments")
    pitches = skin.pitch_x_mm, skin.pitch_y_mm
    # A table with a single factor moves a place by what that factor multiplies.
    units = [Places(*pitches, 0.0, (Row(1, *factors, 0.0, 0.0),)) for factors in ((1.0, 0.0), (0.0, 1.0))]
    period_us = skin.derived.frame_clocks / skin.clock_hz * 1e6
    found: dict[str, list[tuple[int, float, list[Floats], Floats]]] = {}
    for family in (*FITTED, FLAT):
        found[family] = []
        for scene in touches(family, count, seed, skin, cover):
            closing_s, places, _ = touch(scene, skin, cover)
            shown = list(frames(closing_s, skin, period_us))
            for both in zip(*(states(shown, places, unit) for unit in units), strict=True):
                first = both[0]
                at, cells = np.array(middle(first.track)), first.track.zone.area_cells
                pace_us = (first.time_us - first.track.since_us) / max(1, cells - 1)
                moves = [np.array(one.track.place_mm) - at for one in both]
                found[family].append((cells, pace_us, moves, np.array(first.place) - at))
    least_us = float(np.quantile([pace for cells, pace, _, _ in found[FLAT] if cells > 1] or [0.0], FLATTEST))
    grown = [one for family in FITTED for one in found[family]]
    rows = [row for first, end in zip(CELLS, (*CELLS[1:], 10**9)) if (row := _row(first, end, least_us, grown))]
    return Places(*pitches, least_us, tuple(rows))


def _row(first: int, end: int, least_us: float, grown: list[tuple[int, float, list[Floats], Floats]]) -> Row | None:
    here = [one for one in grown if first <= one[0] < end]
    if len(here) < FEWEST:
        return None
    moves, off = np.array([one[2] for one in here]), np.array([one[3] for one in here])
    told = np.array([pace > least_us for _, pace, _, _ in here])
    flat = moves[told].transpose(0, 2, 1).reshape(-1, 2)
    linear, square = np.linalg.lstsq(flat, off[told].ravel(), rcond=1e-6)[0].tolist() if first > 1 else (0.0, 0.0)
    left = off[told] - np.array([linear, square]) @ moves[told]
    return Row(first, linear, square, _variance(left), _variance(off))


def _variance(off: Floats) -> float:
    """Variance along each axis of which 95 % of (n, 2) offsets keep the limit."""
    return float(np.quantile((off**2).sum(axis=1), 0.95) / CHI2_95) if len(off) else 0.0
