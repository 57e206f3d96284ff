"""Where ids are lost: one knob at a time, moved until a contact no longer keeps its id."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence

from contactfpga.tracking.tracker import Tracker
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab.failures.knob import Knob, Outcome
from contactfpga_sim.lab.tracking.scenes import FINGER_MM, SKIN, Finger, zones_of
from contactfpga_sim.lab.tracking.scores import Nearest, Update, ours
from contactfpga_sim.model.scenes.contacts import Contact, Track, disc

WIDE = SKIN.replace(columns=60, settle_us=20.0)
"""For slides that a smaller sheet has no room for."""

Y_MM = 73.0
HZ = 1000.0

Ids = list[list[int]]
"""From left to right, frame by frame; a frame without a zone is left out."""


def _finger(times: Sequence[float], xs: Sequence[float], y_mm: float = Y_MM) -> Finger:
    contact = Contact(shape=disc(FINGER_MM), x_mm=Track(tuple(times), tuple(xs)), y_mm=y_mm)
    return Finger(contact, times[0], times[-1])


def _frames(fingers: Sequence[Finger], times: Sequence[float], stuck: Sequence[tuple[int, int]] = ()) -> list[Zones]:
    found = []
    for now in times:
        cells = sum((finger.cells(now, WIDE) for finger in fingers), start=fingers[0].cells(-1.0, WIDE))
        for row, column in stuck:
            cells[row, column] = True
        found.append(zones_of(cells, round(now * 1e6), WIDE)[0])
    return found


def _ids(update: Update, frames: Sequence[Zones]) -> Ids:
    said = [sorted((place, name) for name, place in update(zones).items()) for zones in frames]
    return [[name for _, name in one] for one in said if one]


def _times(seconds: float, hz: float = HZ) -> list[float]:
    return [number / hz for number in range(int(seconds * hz))]


def _nearest() -> Update:
    return Nearest().update


METHODS: dict[str, Callable[[], Update]] = {"`Tracker`": ours, "nearest zone": _nearest}


def _runs(run: Callable[[Callable[[], Update], float], Outcome]) -> dict[str, Callable[[float], Outcome]]:
    return {name: functools.partial(run, make) for name, make in METHODS.items()}


def _one_id(ids: Ids) -> Outcome:
    names = {name for one in ids for name in one}
    return Outcome(len(names) == 1, (), f"{len(names)} ids for 1 contact", len(names))


@functools.lru_cache
def _slide(from_rest: bool, step_mm: float) -> tuple[Zones, ...]:
    """Ten frames at this speed, after ten in which it speeds up to it, or none."""
    steps = [step_mm * (number + 1) / 10 for number in range(10 if from_rest else 0)] + [step_mm] * 9
    xs = [10.0]
    for step in steps:
        if xs[-1] + step < 580:
            xs.append(xs[-1] + step)
    times = [number / 100 for number in range(len(xs))]
    return tuple(_frames([_finger([*times, times[-1] + 1], [*xs, xs[-1]])], times))


def _slides(make: Callable[[], Update], from_rest: bool, step_mm: float) -> Outcome:
    return _one_id(_ids(make(), _slide(from_rest, step_mm)))


SLIDE = Knob(
    name="slide",
    title="A finger that slides",
    axis="mm per frame",
    amount="ids",
    values=tuple(float(step) for step in range(4, 64, 2)),
    runs={
        f"{name}, {how}": functools.partial(_slides, make, from_rest)
        for how, from_rest in (("speeding up over ten frames", True), ("at once", False))
        for name, make in METHODS.items()
    },
    helps="more frames per second, a larger `gate_mm`: at 1,000 frames per second 20 mm per frame are 20 m/s",
)


@functools.lru_cache
def _pair(distance_mm: float) -> tuple[Zones, ...]:
    """They come from 60 mm apart, stay 0.1 s at this distance, and go back, at 400 mm/s toward each other."""
    travel = (60 - distance_mm) / 400
    times = [0.0, travel, travel + 0.1, 2 * travel + 0.1, 2 * travel + 0.2]
    left = [103.0 - half / 2 for half in (60, distance_mm, distance_mm, 60, 60)]
    fingers = [_finger(times, left), _finger(times, [206.0 - x for x in left])]
    return tuple(_frames(fingers, _times(times[-1])))


def _meets(make: Callable[[], Update], distance_mm: float) -> Outcome:
    ids = _ids(make(), _pair(distance_mm))
    told = ("merge",) if min(map(len, ids)) == 1 and make is ours else ()
    return Outcome(ids[0] == ids[-1], told, f"ids {ids[0]} come back as {ids[-1]}", min(map(len, ids)))


MEET = Knob(
    name="meet",
    title="Two fingers of 16 mm that meet and part",
    axis="distance of their middles, mm",
    amount="zones",
    values=tuple(float(value) for value in range(40, 6, -2)),
    runs=_runs(_meets),
    helps="a finer pitch keeps their zones apart for longer",
)


@functools.lru_cache
def _lanes(gap_mm: float) -> tuple[Zones, ...]:
    times = [0.0, 0.12, 0.2]
    fingers = [
        _finger(times, [40.0, 160.0, 160.0], Y_MM - gap_mm / 2),
        _finger(times, [163.0, 43.0, 43.0], Y_MM + gap_mm / 2),
    ]
    return tuple(_frames(fingers, _times(0.2)))


def _crosses(make: Callable[[], Update], gap_mm: float) -> Outcome:
    ids = _ids(make(), _lanes(gap_mm))
    told = ("merge",) if min(map(len, ids)) == 1 and make is ours else ()
    return Outcome(ids[0] == ids[-1][::-1], told, f"ids {ids[0]} go on as {ids[-1][::-1]}", len(ids[-1]))


CROSS = Knob(
    name="cross",
    title="Two fingers of 16 mm that pass each other at 1 m/s each",
    axis="distance of their lanes, mm",
    amount="ids",
    values=tuple(float(value) for value in range(40, -2, -2)),
    runs=_runs(_crosses),
    helps="head on, only how long they share a zone tells passing from going back",
)


@functools.lru_cache
def _open(open_ms: float) -> tuple[Zones, ...]:
    """A finger whose switches open once for this long, at 2,000 frames per second."""
    finger = _finger([0.0, 0.2], [73.0, 73.0])
    still, empty = finger.cells(0.0, WIDE), finger.cells(-1.0, WIDE)
    return tuple(
        zones_of(empty if 0.05 <= now < 0.05 + open_ms / 1000 else still, round(now * 1e6), WIDE)[0]
        for now in _times(0.15, 2000.0)
    )


def _holding(hold_ms: float) -> Update:
    tracker = Tracker(hold_ms=hold_ms)

    def update(zones: Zones) -> dict[int, tuple[float, float]]:
        return {one.id: (one.zone.x_mm or 0.0, one.zone.y_mm or 0.0) for one in tracker.update(zones).active}

    return update


def _bounces(make: Callable[[], Update], open_ms: float) -> Outcome:
    return _one_id(_ids(make(), _open(open_ms)))


BOUNCE = Knob(
    name="bounce",
    title="A contact that bounces",
    axis="time for which it is open, ms",
    amount="ids",
    values=(0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 4.5, 5.0, 6.0, 8.0, 10.0, 15.0, 19.0, 19.5, 20.0, 25.0, 30.0),
    runs={
        "`Tracker`, `hold_ms = 5`": functools.partial(_bounces, lambda: _holding(5.0)),
        "`Tracker`, `hold_ms = 20`": functools.partial(_bounces, lambda: _holding(20.0)),
        "nearest zone": functools.partial(_bounces, _nearest),
    },
    helps="`hold_ms` above the bounce; each `up` comes as much later. The board's `debounce` costs less",
)


@functools.lru_cache
def _stuck(count: int) -> tuple[Zones, ...]:
    """A finger slides along a row with stuck switches 40 mm apart, at 300 mm/s, and off it."""
    spots = [(7, 10 + 4 * number) for number in range(count)]
    return tuple(_frames([_finger([0.0, 1.4], [40.0, 460.0])], _times(1.4, 250.0), spots))


def _sticks(make: Callable[[], Update], count: float) -> Outcome:
    ids = _ids(make(), _stuck(int(count)))
    finger = ids[0][0]
    right = ids[-1][-1] == finger and len({name for one in ids for name in one}) == count + 1
    return Outcome(right, (), f"{len({name for one in ids for name in one})} ids for {count + 1:g} contacts", count)


STUCK = Knob(
    name="stuck",
    title="A finger that slides over stuck switches",
    axis="how many are stuck",
    amount="stuck switches",
    values=tuple(float(value) for value in range(10)),
    runs=_runs(_sticks),
    helps="a stuck switch is a contact that never ends: list it in `mask`",
)


@functools.lru_cache
def _gap(lost_ms: float) -> tuple[Zones, ...]:
    finger = _finger([0.0, 1.0], [30.0, 530.0])
    return tuple(_frames([finger], [now for now in _times(0.7) if not 0.2 < now < 0.2 + lost_ms / 1000]))


def _loses(make: Callable[[], Update], lost_ms: float) -> Outcome:
    return _one_id(_ids(make(), _gap(lost_ms)))


LOST = Knob(
    name="lost",
    title="A finger that slides at 500 mm/s while frames are lost",
    axis="ms without a frame",
    amount="ids",
    values=tuple(float(value) for value in range(0, 140, 5)),
    runs=_runs(_loses),
    helps="a larger `gate_mm`; `board.stats.lost` counts lost frames",
)

KNOBS = {knob.name: knob for knob in (SLIDE, MEET, CROSS, BOUNCE, STUCK, LOST)}
"""Every knob by its name."""
