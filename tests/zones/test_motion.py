"""The flag `motion`: a zone that moved by more than a pitch from one scan to the next."""

import random

import pytest
from wire import Wire

from contactfpga import Skin
from contactfpga.driver.conversation import Conversation

MOMENTS = Skin(rows=16, columns=16, settle_us=20.0)
SKINS = [MOMENTS, MOMENTS.replace(report="barycenter"), MOMENTS.replace(report="cells")]
IDS = [skin.report for skin in SKINS]


def packets(skin, frames, **sent):
    """Of frames of zones that are rectangles: (row, column, rows, columns) each."""
    wire, found = Wire(skin), []
    for number, rectangles in enumerate(frames):
        options = {"time": 100 + 200 * number, "sequence": number}
        options |= {name: values[number] for name, values in sent.items()}
        found.append(
            wire.cells(bitmap(rectangles), **options) if skin.report == "cells" else zones(skin, rectangles, options)
        )
    return wire.hello(sent=0), found


def bitmap(rectangles):
    inside = {
        (y, x)
        for row, column, high, wide in rectangles
        for y in range(row, row + high)
        for x in range(column, column + wide)
    }
    return [[(y, x) in inside for x in range(16)] for y in range(16)]


def zones(skin, rectangles, options):
    rows = []
    for row, column, high, wide in rectangles:
        area, x, y = high * wide, column + (wide - 1) / 2, row + (high - 1) / 2
        scale = 2**skin.barycenter_bits if skin.report == "barycenter" else area
        rows.append((area, round(x * scale), round(y * scale)))
    return Wire(skin).zones(rows, **options)


def flagged(skin, frames, runs=False, **sent):
    """Whether each frame carries the flag."""
    hello, found = packets(skin, frames, **sent)
    host = Conversation("x")
    host.receive(hello, 0.0)
    pieces = [b"".join(found)] if runs else found
    return ["motion" in zones.flags for data in pieces for run in host.receive(data, 0.0) for zones in run]


@pytest.mark.parametrize("skin", SKINS, ids=IDS)
def test_a_zone_that_moves_by_more_than_a_pitch_is_flagged(skin):
    path = [(3, 3), (3, 4), (4, 4), (5, 5), (5, 7), (5, 7), (5, 4)]
    frames = [[(row, column, 2, 2)] for row, column in path]
    assert flagged(skin, frames) == [False, False, False, True, True, False, True]


@pytest.mark.parametrize("skin", SKINS, ids=IDS)
def test_of_several_zones_one_that_moves_is_enough(skin):
    frames = [[(1, 1, 2, 2), (9, 9, 2, 2)], [(1, 1, 2, 2), (9, 11, 2, 2)], [(1, 1, 2, 2), (9, 12, 2, 2)]]
    assert flagged(skin, frames) == [False, True, False]


@pytest.mark.parametrize("skin", SKINS, ids=IDS)
def test_zones_that_come_or_go_have_not_moved(skin):
    frames = [[], [(1, 1, 2, 2)], [(1, 1, 2, 2), (9, 9, 2, 2)], [(9, 9, 2, 2)], []]
    assert flagged(skin, frames) == [False] * 5


def test_frames_that_do_not_follow_each_other_show_no_motion():
    frames = [[(1, 1, 2, 2)], [(9, 9, 2, 2)]]
    assert flagged(MOMENTS, frames) == [False, True]
    assert flagged(MOMENTS, frames, sequence=(0, 2)) == [False, False]
    assert flagged(MOMENTS, frames, overwritten=(0, 1)) == [False, False]


@pytest.mark.parametrize("skin", SKINS[:2], ids=IDS[:2])
def test_frames_in_runs_are_flagged_as_one_by_one(skin):
    """The first of a run, too, by the frame before it."""
    rng = random.Random(4)
    frames = [[(rng.randrange(14), rng.randrange(14), 2, 2)] for _ in range(60)]
    alone = flagged(skin, frames)
    assert flagged(skin, frames, runs=True) == alone
    assert 30 < sum(alone) < 60


def test_a_run_that_was_begun_keeps_the_frame_before():
    frames = [[(row, 2, 2, 2)] for row in 4 * (0, 4, 5, 9, 10, 14, 10, 6, 5, 1, 5, 9)]
    hello, found = packets(MOMENTS, frames)
    host = Conversation("x")
    host.receive(hello, 0.0)
    run = host.receive(b"".join(found), 0.0)[-1]
    assert len(run) == len(frames) - 1
    for taken in range(1, len(run)):
        assert ["motion" in one.flags for one in run.after(taken)] == ["motion" in one.flags for one in run][taken:]


def test_a_zone_without_cells_lies_nowhere():
    hello, _ = packets(MOMENTS, [])
    host, wire = Conversation("x"), Wire(MOMENTS)
    host.receive(hello, 0.0)
    for number in range(2):
        data = wire.zones([(0, 0, number)], cells=0, time=100 * number + 1, sequence=number, flags=["mismatch"])
        ((zones,),) = host.receive(data, 0.0)
        assert zones.flags == {"mismatch"}


CLOSED = Skin(rows=16, columns=16, surface="cylinder", radius_mm=25.0, closed=True, settle_us=20.0)


@pytest.mark.parametrize(
    ("first", "second", "moves"),
    [
        ((4, 58, 12, 0), (4, 30, 12, 2), False),  # columns 14 and 15, then 15 and 0
        ((4, 30, 12, 2), (4, 2, 12, 0), False),
        ((4, 2, 12, 0), (4, 54, 12, 0), True),  # then 13 and 14
        ((4, 2, 48, 0), (16, 120, 48, 16), False),  # a ring has no place that it could have moved to
        ((16, 120, 48, 16), (18, 230, 54, 18), False),
        ((16, 32, 48, 511), (16, 160, 48, 511), False),
        ((16, 120, 48, 16), (16, 120, 80, 16), True),  # but along the cylinder
        ((4, 2, 48, 0), (16, 120, 160, 16), False),
    ],
)
def test_over_the_seam_the_short_way_counts_and_an_x_that_is_not_known_does_not(first, second, moves):
    wire, host = Wire(CLOSED), Conversation("x")
    host.receive(wire.hello(sent=0), 0.0)
    frames = [wire.zones([one], time=100 + 200 * number, sequence=number) for number, one in enumerate((first, second))]
    _, after = [zones for data in frames for run in host.receive(data, 0.0) for zones in run]
    assert ("motion" in after.flags) is moves
