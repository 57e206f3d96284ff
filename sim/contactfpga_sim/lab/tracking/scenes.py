"""Moving fingers with true numbers, and their frames by the golden model."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Iterator

import numpy as np

from contactfpga.skin import Skin
from contactfpga.wire.protocol import Frame
from contactfpga.zones.zone import Zones
from contactfpga_sim.model.golden.zones import flood, moments
from contactfpga_sim.model.scenes.contacts import Contact, Swing, Track, disc
from contactfpga_sim.model.scenes.scene import Scene

SKIN = Skin()
FINGER_MM = 8.0
SECONDS = 2.0
MIDDLE_MM = 75.0

BOUNCE_S = 0.003
"""Bounce after a touch and before a lift: 1 ms open, 1 ms closed."""

Random = np.random.Generator
Place = tuple[float, float]
"""x and y in mm."""


@dataclasses.dataclass(frozen=True)
class Finger:
    """A contact and its times."""

    contact: Contact
    begins_s: float = -math.inf
    ends_s: float = math.inf
    bounces: bool = False

    def there(self, seconds: float) -> bool:
        return self.begins_s <= seconds < self.ends_s

    def cells(self, seconds: float, skin: Skin) -> np.ndarray:
        """(rows, columns) bool: closed switches."""
        if not self.there(seconds) or self._open(seconds):
            return np.zeros((skin.rows, skin.columns), bool)
        return Scene((self.contact,)).pressed(seconds, skin)

    def _open(self, seconds: float) -> bool:
        after, before = seconds - self.begins_s, self.ends_s - seconds
        return self.bounces and min(after, before) < BOUNCE_S and int(min(after, before) * 1000) % 2 == 1


Played = tuple[Finger, ...]


def _finger(x_mm: object, y_mm: object, **options: float) -> Finger:
    return Finger(Contact(shape=disc(FINGER_MM), x_mm=x_mm, y_mm=y_mm), **options)  # type: ignore[arg-type]


def sliding(rng: Random) -> Played:
    """Three fingers that swing along lanes 50 mm apart, with peaks of 50 to 1000 mm/s."""
    found = []
    for lane in (25.0, 75.0, 125.0):
        reach, speed = rng.uniform(20, 55), math.exp(rng.uniform(math.log(50), math.log(1000)))
        hertz = speed / (2 * math.pi * reach)
        found.append(_finger(Swing(MIDDLE_MM, reach, hertz, rng.uniform(0, 6)), lane + rng.uniform(-4, 4)))
    return tuple(found)


def crossing(rng: Random) -> Played:
    """Two fingers that swing past each other on lanes 0 to 24 mm apart, with peaks of 300 to 1500 mm/s."""
    speed, gap = rng.uniform(300, 1500), rng.uniform(0, 24)
    hertz = speed / (2 * math.pi * 55)
    phase = rng.uniform(0, 2 * math.pi)
    return (
        _finger(Swing(MIDDLE_MM, 55, hertz, phase), MIDDLE_MM - gap / 2),
        _finger(Swing(MIDDLE_MM, 55, hertz, phase + math.pi), MIDDLE_MM + gap / 2),
    )


def meeting(rng: Random) -> Played:
    """Two fingers that meet, stay up to 0.4 s, and part as they came; three times."""
    angle, speed = rng.uniform(0, 2 * math.pi), rng.uniform(100, 400)
    far, near = 40.0, rng.uniform(8, 11)
    travel, rest = (far - near) / speed, rng.uniform(0.02, 0.4)
    times, values, now = [0.0], [far], 0.0
    for _ in range(3):
        for pause, value in ((0.05, far), (travel, near), (rest, near), (travel, far)):
            now += pause
            times.append(now)
            values.append(value)
    apart = Track(tuple(times), tuple(values))
    return tuple(_along(apart, angle + turn) for turn in (0.0, math.pi))


def _along(far: Callable[[float], float], angle: float, x_mm: float = MIDDLE_MM, y_mm: float = MIDDLE_MM) -> Finger:
    def place(seconds: float, middle: float, share: float) -> float:
        return middle + share * far(seconds)

    x = functools.partial(place, middle=x_mm, share=math.cos(angle))
    return _finger(x, functools.partial(place, middle=y_mm, share=math.sin(angle)))


def tapping(rng: Random) -> Played:
    """Four fingers of a hand, 19 to 23 mm apart, that tap in turn, with bouncing switches; each tap is a new contact,
    and may rest while the next ones tap."""
    apart, turn, now = rng.uniform(19, 23), rng.uniform(0, 2 * math.pi), rng.uniform(0, 0.1)
    found: list[Finger] = []
    while now < SECONDS:
        along, long = (len(found) % 4 - 1.5) * apart, rng.uniform(0.05, 0.3)
        x, y = (MIDDLE_MM + along * share + rng.uniform(-2, 2) for share in (math.cos(turn), math.sin(turn)))
        found.append(_finger(x, y, begins_s=now, ends_s=now + long, bounces=True))
        now += long * rng.uniform(0.3, 1.2)
    return tuple(found)


def angles(rng: Random) -> Played:
    """Two fingers that swing through the middle on any lines, with peaks of 300 to 1500 mm/s; one is up to 20 mm
    later."""
    turn, between, speed = rng.uniform(0, 2 * math.pi), rng.uniform(0, 2 * math.pi), rng.uniform(300, 1500)
    hertz, phase = speed / (2 * math.pi * 55), rng.uniform(0, 2 * math.pi)
    late = rng.uniform(-20, 20) / 55
    return (
        _along(Swing(0.0, 55, hertz, phase), turn),
        _along(Swing(0.0, 55, hertz, phase + late), turn + between),
    )


def stopping(rng: Random) -> Played:
    """Three fingers that move at 100 to 1000 mm/s, stop for 20 to 300 ms, and move on."""
    return tuple(_finger(*_stop_and_go(rng)) for _ in range(3))


def _stop_and_go(rng: Random) -> tuple[Track, Track]:
    here, now = rng.uniform(30, 120, 2), 0.0
    times, places = [now], [here]
    while now < SECONDS:
        there = rng.uniform(30, 120, 2)
        for place, pause in ((there, math.dist(here, there) / rng.uniform(100, 1000)), (there, rng.uniform(0.02, 0.3))):
            now += pause
            times.append(now)
            places.append(place)
        here = there
    return tuple(Track(tuple(times), tuple(float(place[axis]) for place in places)) for axis in (0, 1))  # type: ignore[return-value]


def row(rng: Random) -> Played:
    """Three fingers in a row, 22 to 30 mm apart, that swing together along any line, with peaks of 200 to 1500 mm/s."""
    turn, way, apart = rng.uniform(0, 2 * math.pi), rng.uniform(0, 2 * math.pi), rng.uniform(22, 30)
    hertz, phase = rng.uniform(200, 1500) / (2 * math.pi * 35), rng.uniform(0, 2 * math.pi)
    swing = Swing(0.0, 35, hertz, phase)
    return tuple(
        _along(swing, way, MIDDLE_MM + step * math.cos(turn), MIDDLE_MM + step * math.sin(turn))
        for step in (-apart, 0.0, apart)
    )


def entering(rng: Random) -> Played:
    """Two or three fingers at a time that slide in over an edge and out over another at 200 to 1500 mm/s; each is a
    new contact."""
    found = []
    for _ in range(3):
        now = rng.uniform(0, 0.2)
        while now < SECONDS:
            first, last = rng.permutation(4)[:2]
            ends = [_outside(int(edge), rng) for edge in (first, last)]
            times = (now, now + math.dist(*ends) / rng.uniform(200, 1500))
            x, y = (Track(times, (ends[0][axis], ends[1][axis])) for axis in (0, 1))
            found.append(_finger(x, y, begins_s=times[0], ends_s=times[1]))
            now = times[1] + rng.uniform(0.02, 0.2)
    return tuple(found)


def _outside(edge: int, rng: Random) -> Place:
    beyond, along = (-FINGER_MM, 2 * MIDDLE_MM + FINGER_MM)[edge % 2], rng.uniform(0, 2 * MIDDLE_MM)
    return (beyond, along) if edge < 2 else (along, beyond)


FAMILIES: dict[str, Callable[[Random], Played]] = {
    family.__name__: family for family in (sliding, crossing, meeting, tapping, angles, stopping, row, entering)
}


@dataclasses.dataclass(frozen=True)
class FrameTruth:
    """A frame and the true contacts."""

    zones: Zones
    truth: dict[int, Place]
    """Barycenter of each distinguishable contact, by number."""
    shared: tuple[Place, ...]
    """Zones of several contacts, whose ids are not judged."""


def zones_of(cells: np.ndarray, time_us: int, skin: Skin = SKIN) -> tuple[Zones, np.ndarray]:
    """Frame of (rows, columns) bool cells, and each cell's zone, from 1."""
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


def played(fingers: Played, rate_hz: float, skin: Skin = SKIN, seconds: float = SECONDS) -> Iterator[FrameTruth]:
    for number in range(int(seconds * rate_hz)):
        now = number / rate_hz
        yield shown(fingers, now, skin)


def shown(fingers: Played, now: float, skin: Skin = SKIN) -> FrameTruth:
    """One frame; bouncing contacts are present, those between switches are not."""
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
    return FrameTruth(zones, truth, tuple(_middle(labels == number, skin) for number in sorted(several)))


def _place(fingers: Played, number: int, now: float) -> Place:
    contact = fingers[number].contact
    x, y = (value(now) if callable(value) else value for value in (contact.x_mm, contact.y_mm))
    return float(x), float(y)


def _middle(cells: np.ndarray, skin: Skin) -> Place:
    y, x = np.nonzero(cells)
    return float(x.mean() * skin.pitch_x_mm), float(y.mean() * skin.pitch_y_mm)
