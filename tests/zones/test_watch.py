"""A watch over random histories: what is planted is found in time, and nothing else is."""

import time
import tomllib

import numpy as np
import pytest
from histories import RATE_HZ, frame, frames, moving_touches

from contactfpga import Skin, SkinMismatch, Watch
from contactfpga.instruments.watch import cells_of

CELLS = Skin(rows=16, columns=16, report="cells")
MOMENTS = Skin(rows=16, columns=16)
BARYCENTERS = Skin(rows=16, columns=16, report="barycenter")
SKINS = {skin.report: skin for skin in (CELLS, MOMENTS, BARYCENTERS)}
REPORTS = pytest.mark.parametrize("report", SKINS)
STUCK_S = 5.0
SECONDS = 25.0


def watched(skin, cells, **limits):
    """All that a watch suspects, and the watch."""
    watch = Watch(skin, **{"stuck_s": STUCK_S, **limits})
    return [one for zones in frames(skin, cells) for one in watch.update(zones)], watch


def stuck_at(cells, *spots):
    cells = cells.copy()
    for row, column in spots:
        cells[:, row, column] = True
    return cells


@REPORTS
@pytest.mark.parametrize("seed", range(2))
def test_moving_hands_alone_are_no_suspicion(report, seed):
    cells = moving_touches(np.random.default_rng(seed), SKINS[report], SECONDS)
    found, watch = watched(SKINS[report], cells)
    assert found == []
    assert (watch.stuck, watch.mask, watch.mask_line) == ((), (), "")


def due_us(spot, report, touches):
    """Time by which a watch must have reported the switch at ``spot``: nothing touched its neighbors for the limit
    (zones: twice, as long as its zone must stay the same; cells: for a tenth of it), and meanwhile 8 cells elsewhere
    came and went, counted from the cells themselves."""
    y, x = np.mgrid[:16, :16]
    near = np.maximum(abs(y - spot[0]), abs(x - spot[1])) <= 1
    start, steps = 0, round(STUCK_S * RATE_HZ)
    for index in range(len(touches)):
        if report != "cells" and (touches[index] & near).any():
            start = index + 1
        if index - start >= steps:
            since = touches[start : index + 1]
            if report == "cells":
                edges = np.diff(since.astype(int), axis=0)
                came_and_went = (edges > 0).any(axis=0) & (edges < 0).any(axis=0) & ~near
                beside = (touches[index - steps // 10 : index + 1] & near).any(axis=0)
                beside[spot] = False
                if came_and_went.sum() >= 8 and not beside.any():
                    return round(index * 1e6 / RATE_HZ)
            elif index - start >= 2 * steps:  # zones: their barycenters moved over 8 cells meanwhile
                return round(index * 1e6 / RATE_HZ)
    return None


@REPORTS
@pytest.mark.parametrize("seed", range(2))
def test_a_stuck_switch_is_found_in_the_time_stated(report, seed):
    rng = np.random.default_rng(100 + seed)
    skin = SKINS[report]
    touches = moving_touches(rng, skin, 40.0, hands=1 if report != "cells" else 3)
    spot = tuple(rng.integers(0, 16, 2).tolist())
    due = due_us(spot, report, touches)
    assert due is not None, "the history shows it to nobody"
    found, watch = watched(skin, stuck_at(touches, spot))
    reported = [one for one in found if one.cells == (spot,)]
    assert reported
    assert reported[0].kind == "stuck"
    assert reported[0].time_us <= due + 0.1e6
    assert {one.cells for one in found} == {(spot,)}  # and no other
    if report == "cells":
        assert len(found) == 1
        assert watch.stuck == (spot,)
        assert watch.mask_line == f"mask = [[{spot[0]}, {spot[1]}]]"


@pytest.mark.campaign
@REPORTS
@pytest.mark.parametrize("seed", range(1000, 1060))
def test_what_the_page_says_of_random_histories(report, seed):
    rng, skin = np.random.default_rng(seed), SKINS[report]
    touches = moving_touches(rng, skin, 40.0, hands=1 if report != "cells" else 3)
    assert watched(skin, touches)[0] == []
    spot = tuple(rng.integers(0, 16, 2).tolist())
    assert {one.cells for one in watched(skin, stuck_at(touches, spot))[0]} == {(spot,)}


def test_a_watch_keeps_up_with_10000_frames_per_s():
    """Of cells that change in each frame, by the processor's time."""
    cells = moving_touches(np.random.default_rng(9), CELLS, 20.0, rate_hz=100.0)
    sent = list(frames(CELLS, cells, 10_000.0))
    watch = Watch(CELLS)
    started = time.process_time()
    for zones in sent:
        watch.update(zones)
    assert len(sent) / (time.process_time() - started) > 10_000


def resting(count, row=5, column=5, size=4):
    cells = np.zeros((count, 16, 16), bool)
    cells[:, row : row + size, column : column + size] = True
    return cells


@REPORTS
def test_an_arm_that_rests_for_long_is_no_suspicion(report):
    """It comes after the first frame, and nothing else changes."""
    cells = resting(round(40 * RATE_HZ))
    cells[: int(RATE_HZ)] = False
    assert watched(SKINS[report], cells)[0] == []


def test_an_arm_that_rests_with_a_trembling_rim_is_no_suspicion():
    rng = np.random.default_rng(5)
    cells = resting(round(40 * RATE_HZ))
    rim = np.zeros((16, 16), bool)
    rim[4:10, 4:10] = True
    rim[5:9, 5:9] = False
    held = rng.random((len(cells) // 8, 16, 16)) < 0.5
    cells |= np.repeat(held, 8, axis=0) & rim
    assert watched(CELLS, cells)[0] == []


@REPORTS
def test_an_arm_that_rests_while_hands_move_is_one_clear_line_and_no_mask(report):
    skin = SKINS[report]
    cells = resting(round(40 * RATE_HZ), row=0, column=0)
    elsewhere = moving_touches(np.random.default_rng(6), skin, 40.0)
    elsewhere[:, :6, :6] = False
    found, watch = watched(skin, cells | elsewhere)
    assert [one.kind for one in found] == ["held"]
    assert "something lies there, or they are stuck" in found[0].sentence
    assert "16 cells" in found[0].sentence
    assert watch.mask_line == ""


def test_a_stuck_switch_under_a_resting_arm_is_reported_once_the_arm_is_gone():
    cells = resting(round(30 * RATE_HZ))
    cells[len(cells) // 2 :] = False
    elsewhere = moving_touches(np.random.default_rng(7), CELLS, 30.0)
    elsewhere[:, 3:11, 3:11] = False
    found, watch = watched(CELLS, stuck_at(cells | elsewhere, (6, 6)))
    assert watch.stuck == ((6, 6),)
    assert [one.kind for one in found] == ["held", "stuck"]


def test_what_is_left_of_a_resting_arm_that_goes_is_no_suspicion():
    """Its cells go one by one, and the last of them rested as long as a stuck one."""
    cells = resting(round(30 * RATE_HZ))
    for index, (row, column) in enumerate(np.argwhere(cells[0]).tolist()):
        cells[800 + 4 * index :, row, column] = False
    elsewhere = moving_touches(np.random.default_rng(8), CELLS, 30.0)
    elsewhere[:, 3:11, 3:11] = False
    found, _ = watched(CELLS, cells | elsewhere)
    assert [one.kind for one in found] == ["held"]


def sweep(skin, spots=()):
    """A finger of a single cell that goes over each row, half a second per row; and switches that stay pressed."""
    path = [(row, column) for row in range(skin.rows) for column in range(skin.columns)]
    cells = np.zeros((2 * len(path), skin.rows, skin.columns), bool)
    for index, (row, column) in enumerate(path):
        cells[2 * index, row, column] = True
    return stuck_at(cells, *spots)


def test_the_sentence_names_the_cell_the_time_and_the_others():
    (one,), watch = watched(CELLS, sweep(CELLS, [(15, 4)]))
    assert one.sentence == (
        "cell (15, 4) pressed for 5.0 s, since the first frame, while 99 others changed: stuck, or something small "
        "lies there"
    )
    assert watch.never == ()


def test_a_switch_that_stuck_later_is_not_said_to_be_so_since_the_first_frame():
    cells = sweep(CELLS)
    cells[40:, 15, 4] = True
    (one,), _ = watched(CELLS, cells)
    assert "first frame" not in one.sentence


def test_switches_that_never_read_pressed_are_listed_but_for_the_mask():
    cells = sweep(CELLS)
    cells[:, 3, 4] = cells[:, 9, 2] = False
    _, watch = watched(CELLS, cells)
    assert watch.never == ((3, 4), (9, 2))
    assert not watch.seen[3, 4]
    assert watch.seen.sum() == 254
    assert watched(CELLS.replace(mask=((9, 2),)), cells)[1].never == ((3, 4),)


def test_what_was_seen_is_known_after_the_board_starts_again():
    watch = Watch(CELLS)
    for zones in frames(CELLS, sweep(CELLS), start_us=10**9):
        watch.update(zones)
    watch.update(frame(CELLS, np.zeros((16, 16), bool), 0))
    assert watch.never == ()


def test_times_do_not_reach_back_before_a_restart():
    watch = Watch(CELLS, stuck_s=STUCK_S)
    cells = sweep(CELLS, [(15, 4)])
    early = [one for zones in frames(CELLS, cells[:190], start_us=10**9) for one in watch.update(zones)]
    late = [one for zones in frames(CELLS, cells[190:370]) for one in watch.update(zones)]
    assert early + late == []


@pytest.mark.parametrize(("period", "reported"), [(2, True), (20, False)])
def test_a_switch_that_flutters_is_reported_and_one_that_is_tapped_is_not(period, reported):
    """At 200 frames per s: 200 changes per s, every 5 ms, and 10 taps per s."""
    cells = np.zeros((600, 16, 16), bool)
    phase = np.arange(600) % period
    cells[:, 2, 3] = phase < period // 2
    watch = Watch(CELLS)
    found = [one for zones in frames(CELLS, cells, 200.0) for one in watch.update(zones)]
    assert [one.kind for one in found] == (["flutter"] if reported else [])
    assert watch.fluttering == (((2, 3),) if reported else ())
    assert all("cell (2, 3) changes at least 100 times per s" in one.sentence for one in found)


def test_bounces_of_a_fast_tap_are_no_flutter():
    cells = np.zeros((12_000, 1, 1), bool)
    phase = np.arange(12_000) % 1000  # 10 taps per s at 10,000 frames per s
    cells[:, 0, 0] = ((phase < 500) & ((phase > 60) | (phase % 2 == 0))) | ((phase > 500) & (phase < 560) & phase % 2)
    skin = Skin(rows=1, columns=1, report="cells", settle_us=100.0)
    watch = Watch(skin)
    assert [one for zones in frames(skin, cells, 10_000.0) for one in watch.update(zones)] == []


def test_the_mask_line_is_toml_that_adds_to_the_skins_mask():
    skin = CELLS.replace(mask=((1, 1), (0, 7)))
    _, watch = watched(skin, sweep(skin, [(15, 4)]))
    mask = tomllib.loads(watch.mask_line)["mask"]
    assert mask == [[0, 7], [1, 1], [15, 4]]
    repaired = skin.replace(mask=watch.mask)
    assert watched(repaired, sweep(skin, [(15, 4)]))[0] == []


@pytest.mark.parametrize("report", ["moments", "barycenter"])
@pytest.mark.parametrize("spots", [((15, 4),), ((15, 4), (15, 5)), ((14, 4), (15, 4)), ((14, 4), (15, 5))])
def test_zones_of_one_or_two_cells_are_named_where_that_is_unique(report, spots):
    (one,), watch = watched(SKINS[report], sweep(SKINS[report], spots))
    diagonal = spots[0][0] != spots[-1][0] and spots[0][1] != spots[-1][1]
    assert one.cells == (() if diagonal else spots)
    assert watch.stuck == one.cells
    assert one.kind == "stuck"
    if diagonal:
        assert "a zone of 2 cells at x 45.0 mm, y 145.0 mm" in one.sentence
        assert watch.mask_line == ""


def test_each_zone_of_two_cells_is_named_right_or_not_at_all():
    for row in range(3):
        for column in range(3):
            for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
                other = row + down, column + right
                if other[1] >= 0:
                    record = (2, column + other[1], row + other[0])
                    assert cells_of(record, MOMENTS.sheet) == (() if down and right else ((row, column), other))


def test_zones_do_not_tell_which_cells_were_seen():
    _, watch = watched(MOMENTS, sweep(MOMENTS))
    assert watch.seen is None
    assert watch.never == ()
    assert Watch().stuck == ()
    assert Watch().seen is None


def test_frames_of_another_skin_are_refused():
    watch = Watch(CELLS.replace(mask=((15, 15),)))
    with pytest.raises(SkinMismatch, match="another Skin"):
        watch.update(frame(Skin(rows=2, columns=2, report="cells", settle_us=50.0), np.zeros((2, 2), bool), 0))


@pytest.mark.parametrize("limits", [{"stuck_s": 0}, {"stuck_s": float("nan")}, {"others": 0}, {"flutter_hz": -1}])
def test_limits_are_positive(limits):
    ((name, value),) = limits.items()
    with pytest.raises(ValueError, match=f"{name} is {value!r}"):
        Watch(**limits)


def test_ghosts_do_not_count_as_seen():
    skin = Skin(rows=4, columns=4, report="cells", diodes="none", settle_us=20.0)
    watch = Watch(skin)
    corners = np.zeros((4, 4), bool)
    corners[np.ix_([0, 2], [0, 2])] = True
    watch.update(frame(skin, corners, 0))
    assert not watch.seen.any()


def test_a_small_sheet_needs_fewer_others():
    skin = Skin(rows=4, columns=4, report="cells", settle_us=20.0)
    cells = np.tile(sweep(skin), (20, 1, 1))
    watch = Watch(skin, stuck_s=STUCK_S)
    found = [one for zones in frames(skin, stuck_at(cells, (1, 1)), 10.0) for one in watch.update(zones)]
    assert [one.cells for one in found] == [((1, 1),)]
