"""What a tracker's ids do not depend on: the order of zones, where they lie on the sheet, a mirror, when it began; and
that what it remembers is bounded."""

import math
import random

import pytest
from tracker_frames import frame, run

from contactfpga import Skin, Tracker

WIDE = Skin(rows=40, columns=40, settle_us=10.0)
SEEDS = range(4)


def walks(seed, count=150):
    """(time in us, places) of up to five fingers that come, walk, meet, part and go; no two distances are alike."""
    rng = random.Random(seed)
    fingers, time_us = [], 0
    for _ in range(count):
        time_us += rng.choice([1000, 1000, 5000, 20_000])
        if len(fingers) < 5 and rng.random() < 0.1:
            fingers.append([rng.uniform(10, 25), rng.uniform(10, 25), rng.choice([5, 7, 8, 9, 11, 13])])
        if fingers and rng.random() < 0.03:
            fingers.pop(rng.randrange(len(fingers)))
        for finger in fingers:
            finger[0] = min(max(finger[0] + rng.uniform(-0.8, 0.8), 5), 30)
            finger[1] = min(max(finger[1] + rng.uniform(-0.8, 0.8), 5), 30)
        yield time_us, joined(fingers)


def joined(fingers):
    """Fingers less than 3 cells apart are one zone."""
    zones = []
    for x, y, area in fingers:
        near = [one for one in zones if math.dist((x, y), one[:2]) < 3]
        zones = [one for one in zones if one not in near]
        total = area + sum(one[2] for one in near)
        zones.append(
            (
                (x * area + sum(one[0] * one[2] for one in near)) / total,
                (y * area + sum(one[1] * one[2] for one in near)) / total,
                total,
            )
        )
    return zones


def tracked(frames, change=lambda x, y: (x, y), order=list, later_us=0):
    """The frames, changed, and what a tracker says of them."""
    made = [
        frame(time_us + later_us, order([(*change(x, y), area) for x, y, area in zones]), skin=WIDE)
        for time_us, zones in frames
    ]
    return made, run(Tracker(), made)


def ids_at(made, said, change=lambda x, y: (x, y)):
    """By frame: the id of each place, as it was before the change."""
    found = []
    for tracks in said:
        places = {(one.zone.x_mm, one.zone.y_mm): one.id for one in tracks.active if not one.held}
        found.append({tuple(round(each, 6) for each in change(*place)): name for place, name in places.items()})
    return found


def same(one, other):
    """Whether ids are the same up to their numbers: those that begin in one frame are numbered in the zones' order."""
    names = {}
    for first, second in zip(one, other, strict=True):
        assert first.keys() == second.keys()
        for place, name in first.items():
            if names.setdefault(name, second[place]) != second[place]:
                return False
    return len(set(names.values())) == len(names)


@pytest.mark.parametrize("seed", SEEDS)
def test_ids_do_not_depend_on_the_order_of_zones(seed):
    frames = list(walks(seed))
    rng = random.Random(seed)
    plain, mixed = tracked(frames), tracked(frames, order=lambda zones: rng.sample(zones, len(zones)))
    assert same(ids_at(*plain), ids_at(*mixed))


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    ("change", "back"),
    [
        (lambda x, y: (x + 4, y + 3), lambda x, y: (x - 40, y - 30)),
        (lambda x, y: (39 - x, y), lambda x, y: (390 - x, y)),
        (lambda x, y: (x, 39 - y), lambda x, y: (x, 390 - y)),
        (lambda x, y: (y, x), lambda x, y: (y, x)),
    ],
    ids=["moved", "mirrored", "upside down", "transposed"],
)
def test_ids_do_not_depend_on_where_the_sheet_begins_nor_on_a_mirror(seed, change, back):
    frames = list(walks(seed))
    plain, changed = tracked(frames), tracked(frames, change)
    assert same(ids_at(*plain), ids_at(*changed, back))


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("later_us", [1, 10**6, 10**12])
def test_ids_do_not_depend_on_when_the_board_began(seed, later_us):
    frames = list(walks(seed))
    kinds = [
        [(one.kind, one.id, one.parents) for tracks in tracked(frames, later_us=late)[1] for one in tracks.events]
        for late in (0, later_us)
    ]
    assert kinds[0] == kinds[1]


@pytest.mark.parametrize("gap_us", [0, 1, 10**6, 10**10, 10**15])
def test_a_gap_of_any_length_ends_nothing_that_is_there_again(gap_us):
    frames = [frame(1000 * step, [(3 + step * 0.1, 5)]) for step in range(20)]
    tracker = Tracker()
    run(tracker, frames)
    tracks = tracker.update(frame(19_000 + gap_us, [(5, 5)]))
    (track,) = tracks.active
    assert track.id == 1
    assert all(map(math.isfinite, (track.vx_mm_s, track.vy_mm_s)))


def test_speeds_stay_finite_where_many_frames_have_one_time():
    tracker = Tracker()
    said = run(tracker, [frame(1000 * (step // 50), [(3 + step % 7 * 0.3, 5)]) for step in range(500)])
    assert {track.id for tracks in said for track in tracks.active} == {1}
    assert all(abs(track.vx_mm_s) < 1e5 for tracks in said for track in tracks.active)


def test_what_it_remembers_is_bounded():
    """Contacts that come, meet and go for 5,000 frames leave nothing behind."""
    rng, tracker, most = random.Random(1), Tracker(shared_ms=50), 0
    for step in range(5_000):
        places = [(4 + 8 * (step // 300 % 3), 5 + rng.random(), rng.choice([4, 9]))]
        if step % 40 < 20:
            places.append((12, 12 + 0.1 * (step % 20)))
        tracker.update(frame(1000 * step, places))
        most = max(most, sum(len(spot.members) for spot in tracker._spots))
    assert most <= 8
    assert len(tracker.update(frame(10**9, [])).active) == 0
