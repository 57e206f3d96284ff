"""Frames of a scene at a rate, by the golden model's zones, with the truth about each."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np

from contactfpga.skin import Skin
from contactfpga.wire.protocol import Frame
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab.tracking.scenes import SECONDS, SKIN, Played
from contactfpga_sim.model.golden.zones import flood, moments

Place = tuple[float, float]
"""x and y in mm."""


@dataclasses.dataclass(frozen=True)
class Shown:
    """A frame and what was there."""

    zones: Zones
    truth: dict[int, Place]
    """The barycenter of each contact that can be told apart, by its number."""
    shared: tuple[Place, ...]
    """Zones that several contacts have: who is asked for one of these is neither right nor wrong."""


def zones_of(cells: np.ndarray, time_us: int, skin: Skin = SKIN) -> tuple[Zones, np.ndarray]:
    """The frame of (rows, columns) bool cells, and the number of each cell's zone, from 1."""
    labels, count = flood(cells, skin.connectivity)
    sums = [moments(labels, number) for number in range(1, count + 1)]
    frame = Frame(
        sequence=0,
        time_us=time_us % (1 << 24),
        flags=frozenset(),
        overwritten=0,
        heard=0,
        zones=count,
        cells=int(cells.sum()),
        moments=np.array(sums, np.int64).reshape(-1, 3),
        bitmap=None,
        barycenters=None,
    )
    return Zones(frame, skin.sheet, time_us), labels


def played(fingers: Played, rate_hz: float, skin: Skin = SKIN, seconds: float = SECONDS) -> Iterator[Shown]:
    """All frames of a scene."""
    for number in range(int(seconds * rate_hz)):
        now = number / rate_hz
        yield shown(fingers, now, skin)


def shown(fingers: Played, now: float, skin: Skin = SKIN) -> Shown:
    """One frame. A contact that bounces is there all the time; one that lies between switches is not."""
    each = {number: finger.cells(now, skin) for number, finger in enumerate(fingers) if finger.there(now)}
    cells = np.any([np.zeros((skin.rows, skin.columns), bool), *each.values()], axis=0)
    zones, labels = zones_of(cells, round(now * 1e6), skin)
    within = {number: set(labels[own].tolist()) for number, own in each.items()}
    truth: dict[int, Place] = {}
    several: set[int] = set()
    for number, mine in within.items():
        others = set().union(*(theirs for other, theirs in within.items() if other != number))
        if mine & others:
            several |= mine
        elif mine or fingers[number].bounces:
            truth[number] = _place(fingers, number, now)
    return Shown(zones, truth, tuple(_middle(labels == number, skin) for number in sorted(several)))


def _place(fingers: Played, number: int, now: float) -> Place:
    contact = fingers[number].contact
    x, y = (value(now) if callable(value) else value for value in (contact.x_mm, contact.y_mm))
    return float(x), float(y)


def _middle(cells: np.ndarray, skin: Skin) -> Place:
    y, x = np.nonzero(cells)
    return float(x.mean() * skin.pitch_x_mm), float(y.mean() * skin.pitch_y_mm)
