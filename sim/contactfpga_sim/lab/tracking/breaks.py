"""Where ids are lost: one knob at a time, moved until fewer than 95 % of random placements keep them."""

from __future__ import annotations

import dataclasses
import functools
import zlib
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from contactfpga.tracking.tracker import Tracker
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab.flips.campaign import wilson
from contactfpga_sim.lab.tracking.scenes import FINGER_MM, SKIN, Finger, Random, zones_of
from contactfpga_sim.lab.tracking.scores import Nearest, Update, ours
from contactfpga_sim.model.scenes.contacts import Contact, Track, disc

WIDE = SKIN.replace(columns=60, settle_us=20.0)
"""For slides that a smaller sheet has no room for."""

Y_MM = 73.0
HZ = 1000.0

PLACEMENTS = 100
"""Of each value: the scene moved by up to a pitch along both axes, its frames by up to one frame."""

RIGHT = 0.95
"""Part of the placements that have to be right."""

Ids = list[list[int]]
"""From left to right, frame by frame; a frame without a zone is left out."""

Made = tuple[Zones, ...]


@dataclasses.dataclass(frozen=True)
class Rate:
    """How many placements were right at a value."""

    value: float
    right: int
    of: int

    @property
    def holds(self) -> bool:
        """Enough of them."""
        return self.right >= RIGHT * self.of

    def __str__(self) -> str:
        low, high = wilson(self.right, self.of)
        return f"{100 * self.right / self.of:.0f} % ({100 * low:.1f} to {100 * high:.1f})"


@dataclasses.dataclass(frozen=True)
class Knob:
    """One quantity that is moved until ids are lost."""

    name: str
    title: str
    axis: str
    """What is moved, with its unit."""
    values: tuple[float, ...]
    """In the order in which the knob is moved."""
    scene: Callable[[float, Random], Made]
    """The frames at a value, at a random placement."""
    right: Callable[[Ids, float], bool]
    """Whether these ids are those of the contacts."""
    methods: Mapping[str, Callable[[], Update]]
    closed: Mapping[str, str]
    """Where it breaks by a formula, for the methods for which there is one."""
    helps: str
    """What to do about it."""

    def rate(self, method: str, value: float, seed: int = 0, placements: int = PLACEMENTS) -> Rate:
        """How many placements are right at a value, the same ones for every method."""
        made = (_made(self.scene, zlib.crc32(self.name.encode()), seed, number, value) for number in range(placements))
        hits = sum(self.right(_ids(self.methods[method](), frames), value) for frames in made)
        return Rate(value, hits, placements)

    def sweep(self, method: str, seed: int = 0, placements: int = PLACEMENTS) -> list[Rate]:
        """Value by value, up to the first one at which too few are right."""
        found: list[Rate] = []
        for value in self.values:
            found.append(self.rate(method, value, seed, placements))
            if not found[-1].holds:
                break
        return found


@functools.lru_cache(maxsize=2 * PLACEMENTS)
def _made(scene: Callable[[float, Random], Made], name: int, seed: int, number: int, value: float) -> Made:
    return scene(value, np.random.default_rng([name, seed, number]))


def _finger(times: Sequence[float], xs: Sequence[float], rng_mm: Sequence[float], y_mm: float = Y_MM) -> Finger:
    x = Track(tuple(times), tuple(each + float(rng_mm[0]) for each in xs))
    return Finger(
        Contact(shape=disc(FINGER_MM), x_mm=x, y_mm=y_mm + float(rng_mm[1])), begins_s=times[0], ends_s=times[-1]
    )


def _moved(rng: Random) -> tuple[float, float]:
    """How far a scene is moved, in mm."""
    x, y = rng.uniform(0, SKIN.pitch_x_mm), rng.uniform(0, SKIN.pitch_y_mm)
    return float(x), float(y)


def _frames(fingers: Sequence[Finger], times: Sequence[float], stuck: Sequence[tuple[int, int]] = ()) -> Made:
    found = []
    for now in times:
        cells = sum((finger.cells(now, WIDE) for finger in fingers), start=fingers[0].cells(-1.0, WIDE))
        for row, column in stuck:
            cells[row, column] = True
        found.append(zones_of(cells, round(now * 1e6), WIDE)[0])
    return tuple(found)


def _ids(update: Update, frames: Sequence[Zones]) -> Ids:
    said = [sorted((place, name) for name, place in update(zones).items()) for zones in frames]
    return [[name for _, name in one] for one in said if one]


def _times(seconds: float, rng: Random, hz: float = HZ) -> list[float]:
    late = float(rng.uniform(0, 1))
    return [(number + late) / hz for number in range(int(seconds * hz))]


def _nearest() -> Update:
    return Nearest().update


METHODS: dict[str, Callable[[], Update]] = {"`Tracker`": ours, "nearest zone": _nearest}


def _one_id(ids: Ids, _value: float) -> bool:
    return len({name for one in ids for name in one}) == 1


def _slide(step_mm: float, rng: Random, from_rest: bool) -> Made:
    """Ten frames at this speed, after ten in which it speeds up to it, or none."""
    steps = [step_mm * (number + 1) / 10 for number in range(10 if from_rest else 0)] + [step_mm] * 9
    xs = [10.0]
    for step in steps:
        if xs[-1] + step < 570:
            xs.append(xs[-1] + step)
    times = [number / 100 for number in range(len(xs))]
    return _frames([_finger([*times, times[-1] + 1], [*xs, xs[-1]], _moved(rng))], times)


SPEEDING, AT_ONCE = (
    Knob(
        name=name,
        title=f"A finger that slides, {how}",
        axis="mm per frame",
        values=tuple(float(step) for step in range(4, 64, 2)),
        scene=functools.partial(_slide, from_rest=from_rest),
        right=_one_id,
        methods=METHODS,
        closed=closed,
        helps="more frames per second, a larger `gate_mm`: at 1,000 frames per second 20 mm per frame are 20 m/s",
    )
    for name, how, from_rest, closed in (
        ("slide", "speeding up over ten frames", True, {"nearest zone": "20: the gate"}),
        (
            "slide at once",
            "at full speed at once",
            False,
            {"`Tracker`": "20: the gate", "nearest zone": "20: the gate"},
        ),
    )
)


def _pair(distance_mm: float, rng: Random) -> Made:
    """They come from 60 mm apart, stay 0.1 s at this distance, and go back, at 400 mm/s toward each other."""
    travel = (60 - distance_mm) / 400
    times = [0.0, travel, travel + 0.1, 2 * travel + 0.1, 2 * travel + 0.2]
    left = [103.0 - half / 2 for half in (60, distance_mm, distance_mm, 60, 60)]
    moved = _moved(rng)
    fingers = [_finger(times, left, moved), _finger(times, [206.0 - x for x in left], moved)]
    return _frames(fingers, _times(times[-1] - 0.01, rng, 250.0))


MEET = Knob(
    name="meet",
    title="Two fingers of 16 mm that meet and part, at 250 frames per second",
    axis="distance of their middles, mm",
    values=tuple(float(value) for value in range(40, 6, -2)),
    scene=_pair,
    right=lambda ids, _: ids[0] == ids[-1],
    methods=METHODS,
    closed={},
    helps="a finer pitch keeps their zones apart for longer",
)


def _lanes(gap_mm: float, rng: Random) -> Made:
    times, moved = [0.0, 0.12, 0.2], _moved(rng)
    fingers = [
        _finger(times, [40.0, 160.0, 160.0], moved, Y_MM - gap_mm / 2),
        _finger(times, [163.0, 43.0, 43.0], moved, Y_MM + gap_mm / 2),
    ]
    return _frames(fingers, _times(0.198, rng))


CROSS = Knob(
    name="cross",
    title="Two fingers of 16 mm that pass each other at 1 m/s each",
    axis="distance of their lanes, mm",
    values=tuple(float(value) for value in range(40, -2, -2)),
    scene=_lanes,
    right=lambda ids, _: ids[0] == ids[-1][::-1],
    methods=METHODS,
    closed={},
    helps="head on, only how long they share a zone tells passing from going back",
)


def _open(open_ms: float, rng: Random) -> Made:
    """A finger whose switches open once for this long, at 2,000 frames per second."""
    finger = _finger([0.0, 0.2], [73.0, 73.0], _moved(rng))
    still, empty = finger.cells(0.0, WIDE), finger.cells(-1.0, WIDE)
    return tuple(
        zones_of(empty if 0.05 <= now < 0.05 + open_ms / 1000 else still, round(now * 1e6), WIDE)[0]
        for now in _times(0.15, rng, 2000.0)
    )


def _holding(hold_ms: float) -> Update:
    tracker = Tracker(hold_ms=hold_ms)

    def update(zones: Zones) -> dict[int, tuple[float, float]]:
        return {one.id: (one.zone.x_mm or 0.0, one.zone.y_mm or 0.0) for one in tracker.update(zones).active}

    return update


BOUNCE = Knob(
    name="bounce",
    title="A contact that bounces, at 2,000 frames per second",
    axis="time for which it is open, ms",
    values=(0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 4.5, 5.0, 6.0, 8.0, 10.0, 15.0, 19.0, 19.5, 20.0, 25.0, 30.0),
    scene=_open,
    right=_one_id,
    methods={
        "`Tracker`, `hold_ms = 5`": lambda: _holding(5.0),
        "`Tracker`, `hold_ms = 20`": lambda: _holding(20.0),
        "nearest zone": _nearest,
    },
    closed={
        "`Tracker`, `hold_ms = 5`": "4.5: the hold less a frame",
        "`Tracker`, `hold_ms = 20`": "19.5: the hold less a frame",
        "nearest zone": "0: any frame that does not show it",
    },
    helps="`hold_ms` above the bounce; each `up` comes as much later. The board's `debounce` costs less",
)


def _stuck(count: float, rng: Random) -> Made:
    """A finger slides along a row with stuck switches 40 mm apart, at 300 mm/s, and off it."""
    spots = [(7, 10 + 4 * number) for number in range(int(count))]
    return _frames([_finger([0.0, 1.4], [40.0, 460.0], _moved(rng))], _times(1.39, rng, 250.0), spots)


def _slides_over(ids: Ids, count: float) -> bool:
    return ids[-1][-1] == ids[0][0] and len({name for one in ids for name in one}) == count + 1


STUCK = Knob(
    name="stuck",
    title="A finger that slides over stuck switches, at 250 frames per second",
    axis="how many are stuck",
    values=tuple(float(value) for value in range(10)),
    scene=_stuck,
    right=_slides_over,
    methods=METHODS,
    closed={},
    helps="a stuck switch is a contact that never ends: list it in `mask`",
)


def _gap(lost_ms: float, rng: Random) -> Made:
    finger = _finger([0.0, 1.0], [30.0, 530.0], _moved(rng))
    return _frames([finger], [now for now in _times(0.5, rng, 500.0) if not 0.2 < now < 0.2 + lost_ms / 1000])


LOST = Knob(
    name="lost",
    title="A finger that slides at 500 mm/s while frames are lost, at 500 frames per second",
    axis="ms without a frame",
    values=tuple(float(value) for value in range(0, 140, 5)),
    scene=_gap,
    right=_one_id,
    methods=METHODS,
    closed={"`Tracker`": "90: the gate, and 50 ms of speed", "nearest zone": "40: the gate"},
    helps="a larger `gate_mm`; `board.stats.lost` counts lost frames",
)

KNOBS = {knob.name: knob for knob in (SPEEDING, AT_ONCE, MEET, CROSS, BOUNCE, STUCK, LOST)}
"""Every knob by its name."""
