"""Where ids are lost: each knob is moved until fewer than 95 % of random placements keep them.

A placement shifts the scene by up to a pitch along both axes, and its frames by up to one.
"""

from __future__ import annotations

import functools
import zlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from contactfpga.tracking.tracker import Tracker
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab.knobs import Knob, Outcome, RateTest
from contactfpga_sim.lab.tracking.scenes import FINGER_MM, SKIN, Random, zones_of
from contactfpga_sim.lab.tracking.scores import Nearest, Update, ours

WIDE = SKIN.replace(columns=60, settle_us=20.0)

Y_MM = 73.0
HZ = 1000.0

Ids = list[list[int]]
"""Ids from left to right by frame, without frames that lack a zone."""

Made = tuple[Zones, ...]


def rated(
    name: str, scene: Callable[[float, Random], Made], right: Callable[[Ids, float], bool], method: Callable[[], Update]
) -> RateTest:
    """A method over random placements: whether its ids are those of the contacts."""

    def draws(value: float, rng: Random, count: int) -> list[Outcome]:
        return [Outcome(right(_ids(method(), scene(value, rng)), value)) for _ in range(count)]

    return RateTest(draws, zlib.crc32(name.encode()))


def _knob(
    name: str,
    scene: Callable[[float, Random], Made],
    right: Callable[[Ids, float], bool],
    methods: Mapping[str, Callable[[], Update]],
    **more: Any,
) -> Knob:
    """A knob with a rate of each method, all on the same placements."""
    return Knob(name=name, runs={title: rated(name, scene, right, make) for title, make in methods.items()}, **more)


def _moved(rng: Random) -> tuple[float, float]:
    x, y = rng.uniform(0, SKIN.pitch_x_mm), rng.uniform(0, SKIN.pitch_y_mm)
    return float(x), float(y)


def under(xs_mm: np.ndarray, y_mm: float) -> np.ndarray:
    """(n, rows, columns) bool: bare switches under a finger at n places."""
    columns, rows = WIDE.pitch_x_mm * np.arange(WIDE.columns), WIDE.pitch_y_mm * np.arange(WIDE.rows)
    across, along = columns - xs_mm[:, None, None], rows[:, None] - y_mm
    closed: np.ndarray = across**2 + along**2 <= FINGER_MM**2
    return closed


def _frames(times: Sequence[float], cells: np.ndarray) -> Made:
    return tuple(zones_of(one, round(now * 1e6), WIDE)[0] for now, one in zip(times, cells))


def _ids(update: Update, frames: Sequence[Zones]) -> Ids:
    said = [sorted((place, name) for name, place in update(zones).items()) for zones in frames]
    return [[name for _, name in one] for one in said if one]


def _times(seconds: float, rng: Random, hz: float = HZ) -> list[float]:
    late = float(rng.uniform(0, 1))
    return [(number + late) / hz for number in range(int(seconds * hz))]


def _nearest() -> Update:
    return Nearest(20.0 * (1 + 1e-9)).update  # a zone at the gate is within it, as it is for the tracker


METHODS: dict[str, Callable[[], Update]] = {"`Tracker`": ours, "nearest zone": _nearest}


def _one_id(ids: Ids, _value: float) -> bool:
    return len({name for one in ids for name in one}) == 1


def _slide(step_mm: float, rng: Random, from_rest: bool) -> Made:
    steps = [step_mm * (number + 1) / 10 for number in range(10 if from_rest else 0)] + [step_mm] * 9
    xs = [10.0]
    for step in steps:
        if xs[-1] + step < 570:
            xs.append(xs[-1] + step)
    x_mm, y_mm = _moved(rng)
    return _frames([number / 100 for number in range(len(xs))], under(x_mm + np.array(xs), Y_MM + y_mm))


SPEEDING, AT_ONCE = (
    _knob(
        name=name,
        title=f"A finger that slides, {how}",
        axis="mm per frame",
        values=tuple(float(step) for step in range(12, 68, 4)),
        scene=functools.partial(_slide, from_rest=from_rest),
        right=_one_id,
        methods=METHODS,
        closed=closed,
        helps="more frames per second, a larger `gate_mm`: at 1,000 frames per second 20 mm per frame are 20 m/s",
    )
    for name, how, from_rest, closed in (
        ("slide", "speeding up over ten frames", True, {"nearest zone": 20.0}),  # no barycenter goes beyond the gate
        (
            "slide at once",
            "at full speed at once",
            False,
            {"`Tracker`": 20.0, "nearest zone": 20.0},  # the first does not go beyond it, and none does
        ),
    )
)


def _pair(distance_mm: float, rng: Random) -> Made:
    travel = (60 - distance_mm) / 400
    x_mm, y_mm = _moved(rng)
    now = _times(2 * travel + 0.19, rng, 250.0)
    apart = np.interp(now, np.cumsum([0.0, travel, 0.1, travel]), [60, distance_mm, distance_mm, 60])
    both = [under(103 + x_mm + way * apart / 2, Y_MM + y_mm) for way in (-1, 1)]
    return _frames(now, both[0] | both[1])


MEET = _knob(
    name="meet",
    title="Two fingers of 16 mm that meet and part, at 250 frames per second",
    axis="distance of their middles, mm",
    values=tuple(float(value) for value in range(28, 6, -4)),
    scene=_pair,
    right=lambda ids, _: ids[0] == ids[-1],
    methods=METHODS,
    closed={"nearest zone": 24.8},  # a column between their cells
    helps="a finer pitch keeps their zones apart for longer",
)


def _lanes(gap_mm: float, rng: Random) -> Made:
    x_mm, y_mm = _moved(rng)
    now = _times(0.118, rng)
    far = 60 - 1000 * np.array(now)
    both = [under(100 + x_mm - way * far, Y_MM + y_mm - way * gap_mm / 2) for way in (-1, 1)]
    return _frames(now, both[0] | both[1])


CROSS = _knob(
    name="cross",
    title="Two fingers of 16 mm that pass each other at 1 m/s each",
    axis="distance of their lanes, mm",
    values=tuple(float(value) for value in range(28, -2, -4)),
    scene=_lanes,
    right=lambda ids, _: ids[0] == ids[-1][::-1],
    methods=METHODS,
    closed={"nearest zone": 25.3},  # a row between their cells
    helps="head on, only how long they share a zone tells passing from going back",
)


def _open(open_ms: float, rng: Random) -> Made:
    x_mm, y_mm = _moved(rng)
    now = np.array(_times(0.04, rng, 2000.0))
    lifted = (now >= 0.01) & (now < 0.01 + open_ms / 1000)
    return _frames(now.tolist(), under(np.full(len(now), 73 + x_mm), Y_MM + y_mm) & ~lifted[:, None, None])


def _holding(hold_ms: float) -> Update:
    tracker = Tracker(hold_ms=hold_ms)

    def update(zones: Zones) -> dict[int, tuple[float, float]]:
        return {one.id: (one.zone.x_mm or 0.0, one.zone.y_mm or 0.0) for one in tracker.update(zones).active}

    return update


BOUNCE = _knob(
    name="bounce",
    title="A contact that bounces, at 2,000 frames per second",
    axis="time for which it is open, ms",
    values=(0.0, 0.5, 2.0, 4.0, 4.5, 5.0, 10.0, 19.0, 19.5, 20.0, 25.0),
    scene=_open,
    right=_one_id,
    methods={
        "`Tracker`, `hold_ms = 5`": lambda: _holding(5.0),
        "`Tracker`, `hold_ms = 20`": lambda: _holding(20.0),
        "nearest zone": _nearest,
    },
    # The hold less a frame; for the nearest zone any frame that does not show the contact.
    closed={"`Tracker`, `hold_ms = 5`": 4.5, "`Tracker`, `hold_ms = 20`": 19.5, "nearest zone": 0.0},
    helps="`hold_ms` above the bounce; each `up` comes as much later. The board's `debounce` costs less",
)


def _stuck(count: float, rng: Random) -> Made:
    x_mm, y_mm = _moved(rng)
    now = _times(0.69, rng, 125.0)
    cells = under(40 + x_mm + 300 * np.array(now), Y_MM + y_mm)
    cells[:, 7, [10 + 4 * number for number in range(int(count))]] = True
    return _frames(now, cells)


def _slides_over(ids: Ids, count: float) -> bool:
    return ids[-1][-1] == ids[0][0] and len({name for one in ids for name in one}) == count + 1


STUCK = _knob(
    name="stuck",
    title="A finger that slides over stuck switches, at 125 frames per second",
    axis="how many are stuck",
    values=tuple(float(value) for value in range(5)),
    scene=_stuck,
    right=_slides_over,
    methods=METHODS,
    helps="a stuck switch is a contact that never ends: list it in `mask`",
)


def _gap(ms: float, rng: Random) -> Made:
    x_mm, y_mm = _moved(rng)
    now = np.array(_times(0.2, rng, 500.0))
    half = len(now) // 2
    now[half:] += ms / 1000 - (now[half] - now[half - 1])
    return _frames(now.tolist(), under(30 + x_mm + 500 * now, Y_MM + y_mm))


LOST = _knob(
    name="lost",
    title="A finger that slides at 500 mm/s while frames are lost, at 500 frames per second",
    axis="ms from a frame to the next",
    values=tuple(float(value) for value in range(30, 122, 4)),
    scene=_gap,
    right=_one_id,
    methods=METHODS,
    # The barycenter is within the gate of where the filter puts it after 50 ms, or of the one before.
    closed={"`Tracker`": 80.5, "nearest zone": 40.3},
    helps="a larger `gate_mm`; `board.stats.lost` counts lost frames",
)

KNOBS = {knob.name: knob for knob in (SPEEDING, AT_ONCE, MEET, CROSS, BOUNCE, STUCK, LOST)}
