"""Ids, events and settings of the tracker, case by case. Places are in cells of 10 mm."""

import json
import math

import pytest
from tracker_frames import SKIN, events, frame, ids, run

from contactfpga import Skin, Tracker

MS = 1000


def sequence(places_at, count, step_us=MS, start_us=0, **options):
    return [frame(start_us + number * step_us, places_at(number), **options) for number in range(count)]


def test_down_move_up_with_their_times():
    frames = [frame(0, [(3, 3)]), frame(MS, [(3.4, 3)]), frame(2 * MS, [(3.8, 3)]), frame(20 * MS, [])]
    said = run(Tracker(move_mm=7.0), frames)
    assert [(event.kind, event.id, event.time_us, event.seen_us) for one in said for event in one.events] == [
        ("down", 1, 0, 0),
        ("move", 1, 2 * MS, 2 * MS),
        ("up", 1, 20 * MS, 2 * MS),
    ]
    assert [len(one.active) for one in said] == [1, 1, 1, 0]
    (track,) = said[2].active
    assert (track.since_us, track.seen_us, track.zone, track.held) == (0, 2 * MS, frames[2][0], False)


def test_speed_is_that_of_the_contact():
    said = run(Tracker(), sequence(lambda n: [(2 + n * 0.05, 12 - n * 0.02)], 200))
    (track,) = said[-1].active
    assert track.vx_mm_s == pytest.approx(500, rel=0.05)
    assert track.vy_mm_s == pytest.approx(-200, rel=0.08)


@pytest.mark.parametrize(("hold_ms", "kinds"), [(0, ["down", "up", "down"]), (5, ["down"])])
def test_a_contact_is_seen_through_a_bounce(hold_ms, kinds):
    said = run(Tracker(hold_ms=hold_ms), sequence(lambda n: [] if 10 <= n < 14 else [(3, 3)], 30, 1000))
    assert [kind for kind, _ in events(said)] == kinds
    assert [track.held for track in said[12].active] == ([] if hold_ms == 0 else [True])


def test_a_lift_is_said_when_the_hold_is_over_with_the_time_it_was_seen():
    said = run(Tracker(hold_ms=5), sequence(lambda n: [(3, 3)] if n < 10 else [], 30, 1000))
    (up,) = [event for one in said for event in one.events if event.kind == "up"]
    assert (up.time_us, up.seen_us) == (14 * MS, 9 * MS)


def meeting(gap):
    """Two fingers, their middles ``gap`` cells apart."""
    left, right = 7 - gap / 2, 7 + gap / 2
    return [(left, 5), (right, 5)] if gap >= 4 else [((left + right) / 2, 5, 18)]


def test_two_fingers_that_meet_and_part_keep_their_ids_and_sides():
    gaps = [8 - n * 0.1 for n in range(45)]
    said = run(Tracker(), [frame(n * 4 * MS, meeting(gap)) for n, gap in enumerate(gaps + gaps[::-1])])
    assert [one for one in events(said) if one[0] != "move"] == [
        ("down", 1),
        ("down", 2),
        ("merge", 1),
        ("split", 2),
    ]
    assert ids(said[0]) == ids(said[-1]) == [1, 2]
    (both,) = said[45].active
    assert (both.id, both.merged) == (1, (2,))


def test_fingers_that_pass_side_by_side_keep_their_ids():
    """On lanes 1.4 cells apart: back on its own side, each would lie farther from where it came."""
    places = [(2 + n * 0.1, 14 - n * 0.1) for n in range(120)]
    frames = [
        frame(n * MS, [(one, 4), (other, 5.4)] if abs(one - other) >= 3 else [((one + other) / 2, 4.7, 18)])
        for n, (one, other) in enumerate(places)
    ]
    said = run(Tracker(), frames)
    assert [kind for kind, _ in events(said) if kind not in ("move", "down")] == ["merge", "split"]
    assert ids(said[0]) == [1, 2]
    assert ids(said[-1]) == [2, 1]


def test_a_contact_that_comes_apart_keeps_one_id_and_gives_the_other_its_parent():
    said = run(Tracker(), [frame(0, [(5, 5, 30)]), frame(MS, [(4.5, 5, 20), (8, 5, 8)])])
    assert [(event.kind, event.id, event.parents) for event in said[1].events] == [
        ("down", 2, (1,)),
        ("split", 2, (1,)),
    ]
    assert ids(said[1]) == [1, 2]


def test_a_touch_beside_two_in_one_zone_takes_no_id_from_them():
    """As recorded: a cell beside a foot joins it, and another cell closes at the foot's other side."""
    foot, cell = (10.1, 8, 22), (13, 7, 1)
    frames = [frame(0, [foot, cell]), frame(10 * MS, [(10.3, 8, 23)]), frame(20 * MS, [(10.3, 8, 23), (7, 9, 1)])]
    said = run(Tracker(), frames)
    (one,) = said[1].active
    assert (one.id, one.merged) == (2, (1,))
    after = {track.zone.area_cells: track.id for track in said[2].active}
    assert (after[23], after[1]) == (2, 3)
    assert [(event.kind, event.parents) for event in said[2].events] == [("down", ())]


def test_a_long_contact_that_comes_apart_far_from_its_middle_keeps_its_id():
    """As recorded: a foot's heel, 75 mm from the middle of ball and heel."""
    whole, parts = [(8, 7, 70)], [(8, 2.6, 44), (8, 14.5, 26)]
    said = run(Tracker(), [frame(0, whole), frame(20 * MS, parts), frame(40 * MS, whole)])
    assert events(said) == [("down", 1), ("down", 2), ("split", 2), ("merge", 1)]


def test_a_touch_beside_a_contact_that_lost_nothing_has_no_parent():
    said = run(Tracker(), [frame(0, [(5, 5, 9)]), frame(MS, [(5, 5, 9), (8, 5, 8)])])
    assert [(event.kind, event.parents) for event in said[1].events] == [("down", ())]


def test_a_lift_beside_a_contact_that_gained_nothing_is_no_merge():
    said = run(Tracker(hold_ms=0), [frame(0, [(5, 5), (9, 5)]), frame(MS, [(5, 5)])])
    assert events(said)[2:] == [("up", 2)]


def test_all_contacts_of_a_zone_end_with_it():
    frames = [frame(0, [(5, 5), (9, 5)]), frame(MS, [(7, 5, 18)]), frame(90 * MS, [])]
    assert events(run(Tracker(), frames))[2:] == [("merge", 1), ("up", 1), ("up", 2)]


def test_one_that_lifts_out_of_a_shared_zone_is_forgotten():
    shared = [frame(0, [(5, 5, 12), (9, 5)]), frame(MS, [(6.7, 5, 21)])]
    alone = sequence(lambda n: [(5, 5, 12)], 400, MS, 2 * MS)
    said = run(Tracker(shared_ms=300), shared + alone)
    (up,) = [event for one in said for event in one.events if event.kind == "up"]
    assert (up.id, up.time_us) == (2, 302 * MS)
    assert said[-1].active[0].merged == ()


def test_a_finger_that_comes_down_in_the_zone_of_one_that_rests_is_a_contact_of_its_own():
    """The first finger lifts before the second one does, and each tap has an id of its own."""
    frames = sequence(lambda n: [(5, 5, 2)], 60) + sequence(lambda n: [(6, 5, 4)], 60, MS, 60 * MS)
    frames += sequence(lambda n: [(7, 5, 2)], 60, MS, 120 * MS) + [frame(190 * MS, [])]
    said = run(Tracker(), frames)
    assert [one for one in events(said) if one[0] != "move"] == [
        ("down", 1),
        ("down", 2),
        ("merge", 1),
        ("up", 1),
        ("up", 2),
    ]
    assert (ids(said[100]), said[100].active[0].merged, ids(said[120]), ids(said[150])) == ([1], (2,), [2], [2])


@pytest.mark.parametrize("opens", [(60, 62), (120, 122)])
def test_a_switch_that_bounces_in_a_shared_zone_begins_no_other_contact(opens):
    def places(n):
        both = 60 <= n < 125 and not (opens[0] < n <= opens[1])
        return [(6, 5, 4)] if both else [(5, 5, 2)]

    said = run(Tracker(), sequence(places, 300))
    assert [one for one in events(said) if one[0] != "move"] == [("down", 1), ("down", 2), ("merge", 1), ("up", 2)]


def test_a_finger_that_moves_on_in_one_frame_is_no_second_one():
    said = run(Tracker(), sequence(lambda n: [(5, 5, 2)], 60) + sequence(lambda n: [(5.5, 5, 4)], 9, MS, 60 * MS))
    assert {one[0] for one in events(said)} == {"down", "move"}


def test_a_noisy_cell_that_goes_while_a_zone_breathes_did_not_merge_into_it():
    """The recording `sdh13x6` has such a cell, 26 mm from the middle of ten."""
    frames = [frame(n * 10 * MS, [(5, 5, 10 + n % 2), *([(5, 2.4, 1)] if n % 3 else [])]) for n in range(1, 40)]
    assert not {one[0] for one in events(run(Tracker(), frames))} & {"merge", "split"}


def test_a_shared_zone_has_the_id_of_the_zone_that_was_largest():
    """The largest zone is of several small contacts, each smaller than the other zone."""
    small = [frame(0, [(4, 5, 3), (6, 5, 3), (9, 5, 5)]), frame(MS, [(5, 5, 6), (9, 5, 5)])]
    assert events(run(Tracker(), [*small, frame(2 * MS, [(6.8, 5, 11)])]))[3:] == [("merge", 1), ("merge", 1)]


def test_a_finger_that_lifts_from_a_stuck_switch_ends_and_the_switch_stays():
    stuck = [(7, 5, 1)]
    frames = sequence(lambda n: stuck, 10)
    frames += sequence(lambda n: [*stuck, (3 + n * 0.1, 5)] if n < 20 else [(5 + n * 0.02, 5, 10)], 60, MS, 10 * MS)
    frames += sequence(lambda n: stuck, 400, MS, 70 * MS)
    said = run(Tracker(), frames)
    assert [one for one in events(said) if one[0] != "move"] == [("down", 1), ("down", 2), ("merge", 2), ("up", 2)]
    assert ids(said[60]) == [2]
    assert ids(said[-1]) == [1]


def test_a_finger_that_slides_over_a_stuck_switch_keeps_its_id():
    def places(n):
        x = 2 + n * 0.1
        return [(x, 5, 10)] if abs(x - 7) < 2 else [(7, 5, 1), (x, 5)]

    said = run(Tracker(), sequence(places, 100))
    assert ids(said[0]) == [1, 2]
    assert ids(said[-1]) == [2, 1]
    assert ids(said[50]) == [1]


def test_zones_that_a_frame_leaves_out_are_not_up():
    full = [(2, 2), (6, 6), (12, 12)]
    frames = sequence(lambda n: full if n == 0 else full[:1], 50, 10 * MS, flags=["overflow"], total=3)
    said = run(Tracker(), frames)
    assert len(said[-1].active) == 3
    assert [track.held for track in said[-1].active] == [False, True, True]
    after = Tracker()
    run(after, frames)
    assert [event.kind for event in after.update(frame(10**6, full[:1])).events] == ["up", "up"]


def test_a_frame_with_mismatch_changes_nothing():
    tracker = Tracker()
    tracker.update(frame(0, [(5, 5)]))
    odd = tracker.update(frame(50 * MS, [(1, 1), (2, 9), (14, 3, 0)], flags=["mismatch"]))
    assert (ids(odd), odd.events, odd.active[0].held, odd.active[0].seen_us) == ([1], (), True, 0)
    assert ids(tracker.update(frame(51 * MS, [(5, 5)]))) == [1]


def test_a_speed_is_not_believed_across_a_long_gap():
    fast = sequence(lambda n: [(2 + n * 0.05, 5)], 40)
    assert ids(run(Tracker(), [*fast, frame(3000 * MS, [(4.2, 5)])])[-1]) == [1]


def test_a_restart_ends_all_and_ids_go_on():
    said = run(Tracker(), [frame(10**7, [(5, 5)]), frame(100, [(5, 5)])])
    assert events(said) == [("down", 1), ("up", 1), ("down", 2)]
    assert [one.restarted for one in said] == [False, True]


def test_another_sheet_is_a_restart():
    said = run(Tracker(), [frame(0, [(5, 5)]), frame(MS, [(5, 5)], skin=Skin(pitch_x_mm=5.0))])
    assert events(said) == [("down", 1), ("up", 1), ("down", 2)]
    assert said[1].restarted


def test_on_a_cylinder_a_contact_goes_on_across_the_seam():
    """The last column lies 20 mm before the first one, around a link of 160 mm."""
    ring = SKIN.replace(columns=15, surface="cylinder", radius_mm=160 / math.tau)

    def places(n):
        x = 12 + n * 0.1
        return [(min(x, 14) if x < 15 else max(x - 16, 0), 5)]

    tracker = Tracker(gate_mm=25, move_mm=1000)
    assert events(run(tracker, sequence(places, 80, skin=ring))) == [("down", 1)]
    flat = SKIN.replace(columns=15)
    on_a_plane = events(run(Tracker(gate_mm=25, move_mm=1000), sequence(places, 80, skin=flat)))
    assert sorted(kind for kind, _ in on_a_plane) == ["down", "down", "up"]


def test_zones_that_may_be_ghosts_begin_no_contact_and_end_none():
    skin = SKIN.replace(diodes="none", connectivity=4)
    corners = [(3, 3), (9, 3), (3, 10), (9, 10)]
    tracker, before, said = Tracker(), None, []
    for number, places in enumerate([corners[:1], corners[:1], corners[:2], corners[:2], corners, corners]):
        zones = frame(number * 10 * MS, places, skin=skin, before=before)
        before = zones.frame
        said.append(tracker.update(zones))
    assert [len(one.active) for one in said] == [1, 1, 1, 2, 2, 2]
    assert [len(one.unsure) for one in said] == [0, 0, 1, 0, 2, 2]


def test_a_zone_at_the_gate_goes_on_and_one_beyond_does_not():
    for step, kinds in ((2.0, ["down", "move"]), (2.001, ["down", "down", "up"])):
        frames = [frame(0, [(3, 3, 1000)]), frame(10 * MS, [(3 + step, 3, 1000)])]
        assert sorted(kind for kind, _ in events(run(Tracker(gate_mm=20), frames))) == sorted(kinds)


def test_a_slide_of_more_than_the_gate_per_frame_goes_on_once_its_speed_is_known():
    """From 1 cell per frame to 3, with a gate of 2."""
    places, x = [], 0.0
    for n in range(9):
        x += min(1 + n * 0.5, 3)
        places.append((x, 5))
    wide = SKIN.replace(columns=40, zone_capacity=8)
    said = run(Tracker(gate_mm=20, move_mm=1000), sequence(lambda n: [places[n]], 9, 10 * MS, skin=wide))
    assert events(said) == [("down", 1)]


@pytest.mark.parametrize("name", ["gate_mm", "hold_ms", "shared_ms", "move_mm"])
@pytest.mark.parametrize("value", [-1, float("nan"), float("inf"), "20", None, True, 1e12])
def test_settings_that_cannot_be_are_named(name, value):
    with pytest.raises(ValueError, match=rf"^{name} is .+; it must be a number from [\d.]+ to [\d,]+ m[ms]$"):
        Tracker(**{name: value})


def test_a_gate_of_nothing_is_refused():
    with pytest.raises(ValueError, match=r"^gate_mm is 0; it must be a number from 0.1 to 10,000 mm$"):
        Tracker(gate_mm=0)


@pytest.mark.parametrize("what", [None, [], "frame", 3])
def test_only_frames_are_taken(what):
    with pytest.raises(TypeError, match=r"^update\(\) takes a frame of zones, such as board.next\(\) returns; it got"):
        Tracker().update(what)


def test_what_it_says_is_ready_for_json():
    said = run(Tracker(), [frame(0, [(5, 5), (9, 5)]), frame(MS, [(7, 5, 18)])])
    found = json.loads(json.dumps(said[1].to_dict()))
    assert found["tracks"][0] | {"vx_mm_s": 0, "vy_mm_s": 0} == {
        "id": 1,
        "x_mm": 70.0,
        "y_mm": 50.0,
        "vx_mm_s": 0,
        "vy_mm_s": 0,
        "area_cells": 18,
        "since_us": 0,
        "seen_us": 1000,
        "held": False,
        "merged": [2],
    }
    assert found["events"] == [
        {"kind": "merge", "id": 1, "time_us": 1000, "parents": [2], "x_mm": 70.0, "y_mm": 50.0, "seen_us": 1000}
    ]
    assert (found["unsure"], found["restarted"]) == (0, False)
