"""Random histories: what holds for every one of them, and ids against oracles that try all there is."""

import itertools
import math
import random

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment
from tracker_frames import SKIN, frame, moments, pressed, run

from contactfpga import Tracker
from contactfpga.tracking.assignment import assign

SEEDS = range(8)


def blobs(rng, count):
    """(rows, columns) bool: discs that walk, come, go, meet and bounce, frame by frame."""
    discs = []
    rows, columns = np.mgrid[: SKIN.rows, : SKIN.columns]
    for _ in range(count):
        if rng.random() < 0.05 and len(discs) < 6:
            discs.append([rng.uniform(0, 15), rng.uniform(0, 15), rng.uniform(0.6, 2.5)])
        if rng.random() < 0.04 and discs:
            discs.pop(rng.randrange(len(discs)))
        cells = np.zeros((SKIN.rows, SKIN.columns), bool)
        for disc in discs:
            disc[0] += rng.uniform(-0.6, 0.6)
            disc[1] += rng.uniform(-0.6, 0.6)
            if rng.random() > 0.03:
                cells |= (columns - disc[0]) ** 2 + (rows - disc[1]) ** 2 < disc[2] ** 2
        yield cells


def history(seed, count=200):
    """Frames with flags, losses, time jumps and restarts among them, at last an empty one of a board that restarted."""
    rng = random.Random(seed)
    time_us, frames = 0, []
    for cells in blobs(rng, count):
        time_us += rng.choice([0, 100, 100, 1000, 20_000])
        if rng.random() < 0.01:
            time_us = rng.choice([0, time_us + 10**8])
        flags = [name for name, share in (("overflow", 0.03), ("mismatch", 0.03)) if rng.random() < share]
        if "mismatch" in flags:
            junk = [(rng.randrange(0, 9), rng.randrange(99), rng.randrange(99)) for _ in range(rng.randrange(9))]
            frames.append(moments(time_us, junk, flags))
        else:
            frames.append(pressed(time_us, cells, flags))
    return [*frames, frame(time_us + 10**9, []), frame(0, [])]


@pytest.fixture(scope="module", params=SEEDS)
def tracked(request):
    """What is said of a random history."""
    frames = history(request.param)
    return frames, run(Tracker(hold_ms=random.Random(request.param).choice([0, 5, 50])), frames)


def all_events(said):
    return [event for tracks in said for event in tracks.events]


def test_ids_are_never_used_again_and_each_down_has_one_up(tracked):
    _, said = tracked
    downs = [event.id for event in all_events(said) if event.kind == "down"]
    ups = [event.id for event in all_events(said) if event.kind == "up"]
    assert downs == sorted(set(downs))
    assert sorted(ups) == downs
    assert len(downs) > 3


def test_nothing_happens_to_a_contact_before_its_down_or_after_its_up(tracked):
    _, said = tracked
    open_ids = set()
    for event in all_events(said):
        if event.kind == "down":
            open_ids.add(event.id)
        else:
            assert event.id in open_ids
        assert set(event.parents) <= open_ids
        if event.kind == "up":
            open_ids.discard(event.id)


def test_events_and_frames_have_one_order_in_time(tracked):
    frames, said = tracked
    last = -1
    for zones, tracks in zip(frames, said):
        assert tracks.time_us == zones.time_us
        assert tracks.restarted == (zones.time_us < last)
        last = zones.time_us
        ends = [event for event in tracks.events if event.time_us != zones.time_us]
        assert not ends or (tracks.restarted and {event.kind for event in ends} == {"up"})
        assert all(event.seen_us <= event.time_us for event in tracks.events)


def test_each_id_is_in_one_place_and_each_zone_has_one_contact(tracked):
    frames, said = tracked
    alive = set()
    for zones, tracks in zip(frames, said):
        for event in tracks.events:
            if event.kind == "down":
                alive.add(event.id)
            elif event.kind == "up":
                alive.remove(event.id)
        named = [name for track in tracks.active for name in (track.id, *track.merged)]
        assert sorted(named) == sorted(alive)
        if "mismatch" not in zones.flags:
            assert {id(track.zone) for track in tracks.active if not track.held} == {id(zone) for zone in zones}


@pytest.mark.parametrize("seed", SEEDS)
def test_contacts_that_stay_apart_are_those_of_the_best_assignment_by_brute_force(seed):
    """Three to five fingers that move less than they are apart, at 100 frames per second."""
    rng = random.Random(seed)
    count = rng.randrange(3, 6)
    homes = rng.sample([(x, y) for x in (2, 7, 12) for y in (2, 7, 12)], count)
    tracker, before, names = Tracker(), None, None
    for number in range(60):
        order = rng.sample(range(count), count)
        spots = [(homes[one][0] + rng.uniform(-0.6, 0.6), homes[one][1] + rng.uniform(-0.6, 0.6)) for one in order]
        tracks = tracker.update(frame(number * 10_000, spots))
        now = [(track.zone.x_mm, track.zone.y_mm) for track in tracks.active]
        if before is not None:
            best = min(itertools.permutations(range(count)), key=lambda way: total(before, now, way))
            assert [names[one] for one in range(count)] == [tracks.active[best[one]].id for one in range(count)]
        before, names = now, [track.id for track in tracks.active]
    assert names == list(range(1, count + 1))


def total(before, now, way):
    return math.fsum(math.dist(before[one], now[other]) for one, other in enumerate(way))


@pytest.mark.parametrize("seed", range(120))
def test_assignments_are_scipys(seed):
    rng = random.Random(seed)
    rows, columns, alone = rng.randrange(1, 8), rng.randrange(1, 8), rng.choice([3.0, 10.0, 30.0])
    costs = [
        [
            math.inf if rng.random() < 0.4 else rng.choice([rng.uniform(0, 20), float(rng.randrange(4))])
            for _ in range(columns)
        ]
        for _ in range(rows)
    ]
    found = assign(costs, alone)
    chosen = [column for column in found if column is not None]
    assert len(set(chosen)) == len(chosen)
    padded = np.full((rows, columns + rows), alone)
    padded[:, :columns] = np.minimum(costs, 1e6)
    ours = math.fsum(alone if column is None else costs[row][column] for row, column in enumerate(found))
    assert ours == pytest.approx(padded[linear_sum_assignment(padded)].sum())


def test_nothing_to_assign():
    assert assign([], 1.0) == []
    assert assign([[math.inf, math.inf]], 1.0) == [None]
