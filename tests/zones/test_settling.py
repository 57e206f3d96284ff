"""Settle times from frames that a sheet with known times would send."""

import numpy as np
import pytest

from contactfpga.instruments.settling import AGREE, STEADY, Settling

FIRST, SETTLE = 3, 100


class SlowSheet:
    """What frames show: ``takes`` (rows, columns) clocks of each cell; a column that was pulled is back ``back`` clocks
    after the next row is selected."""

    def __init__(self, takes, back=0, guard=False):
        self.takes, self.back, self.guard = np.array(takes), np.broadcast_to(back, np.shape(takes)[1]), guard
        self.pressed = np.ones(self.takes.shape, bool)

    def frame(self, clocks):
        pulled = np.roll(self.pressed, 1, axis=0)
        pulled[0] |= self.guard
        return self.pressed & (self.takes <= clocks) | pulled & ~self.pressed & (clocks < self.back)


def measured(sheet, changes=(), frames=600, **options):
    """After as many frames; ``changes`` are functions, each called with the number of the frame that comes next."""
    settling, number = Settling(sheet.takes.shape, FIRST, SETTLE, **options), 0

    def frame(clocks):
        nonlocal number
        for change in changes:
            change(number)
        number += 1
        return sheet.frame(clocks)

    settling.start(frame(SETTLE))
    while number < frames:
        clocks = settling.next_clocks()
        if clocks is None:
            settling.start(frame(SETTLE))
        else:
            assert FIRST <= clocks < SETTLE
            settling.take(clocks, frame(clocks), frame(SETTLE))
    return settling


def test_each_cell_has_the_least_clocks_at_which_it_reads_pressed():
    takes = np.random.default_rng(1).integers(1, SETTLE + 1, (5, 7))
    settling = measured(SlowSheet(takes))
    assert settling.clocks.tolist() == np.maximum(takes, FIRST).tolist()
    assert settling.next_clocks() is None


def test_a_uniform_sheet_is_known_after_a_few_frames():
    """Seven halvings, each agreed on by three frames of two."""
    settling = measured(SlowSheet(np.full((64, 64), 20)), frames=STEADY + 2 * AGREE * 7 + 2)
    assert (settling.clocks == 20).all()


def test_what_is_not_pressed_or_takes_longer_than_the_settle_time_is_not_known():
    takes = np.full((3, 3), 20)
    takes[1, 1] = SETTLE + 1
    sheet = SlowSheet(takes)
    sheet.pressed[2] = False
    assert measured(sheet).clocks.tolist() == [[20] * 3, [20, 0, 20], [0] * 3]


def test_cells_that_are_pressed_one_after_the_other_all_have_their_times():
    takes = np.random.default_rng(2).integers(FIRST, SETTLE, (3, 3))
    sheet = SlowSheet(takes)

    def move(number):
        sheet.pressed[:] = False
        sheet.pressed.flat[number // 120 % 9] = True

    assert measured(sheet, [move], 9 * 120).clocks.tolist() == takes.tolist()


@pytest.mark.parametrize("seed", range(2))
def test_presses_that_end_or_bounce_at_any_frame_make_no_cell_slow(seed):
    """A cell is closed for 5 to 30 frames, open for some, and after each change it is so in half of 4 frames."""
    rng, takes = np.random.default_rng(seed), np.full((4, 4), 30)
    sheet, until, bounces = SlowSheet(takes), np.zeros((4, 4), int), np.zeros((4, 4), int)
    closed = np.zeros((4, 4), bool)

    def play(number):
        over = until <= number
        closed[over] ^= True
        until[over] = number + rng.integers(5, 30, over.sum())
        bounces[over] = number + 4
        sheet.pressed = np.where(bounces > number, rng.random((4, 4)) < 0.5, closed)

    settling = measured(sheet, [play], 4000)
    assert settling.clocks.tolist() == takes.tolist()


def test_noise_about_a_threshold_moves_a_time_by_no_more_than_the_noise():
    rng, takes = np.random.default_rng(3), np.full((8, 8), 40)
    sheet = SlowSheet(takes)

    def shake(_):
        sheet.takes = takes + rng.integers(-3, 4, takes.shape)

    clocks = measured(sheet, [shake]).clocks
    assert np.abs(clocks - 40).max() <= 3
    assert len(np.unique(clocks)) > 1


@pytest.mark.parametrize("back", [0, FIRST, 10, 61])
def test_a_column_that_comes_back_late_shows_in_the_cell_after_a_pressed_one(back):
    sheet = SlowSheet(np.full((4, 3), 20), back=[0, back, 0])
    sheet.pressed[:] = False
    sheet.pressed[1] = True
    settling = measured(sheet)
    assert settling.back_clocks.tolist() == [FIRST, max(back, FIRST), FIRST]


def test_a_guard_row_pulls_the_columns_before_row_0():
    sheet = SlowSheet(np.full((3, 2), 20), back=[9, 30], guard=True)
    sheet.pressed[:] = False
    sheet.pressed[2, 0] = True
    assert measured(sheet, guard=True).back_clocks.tolist() == [9, 30]
    sheet.guard = False
    sheet.pressed[2, 0] = False
    assert measured(sheet).back_clocks.tolist() == [0, 0]


def test_a_scan_that_skips_rows_is_followed():
    """Rows 0 and 3 are driven one after the other."""
    sheet = SlowSheet(np.full((4, 3), 20))
    sheet.pressed = np.array([[1, 1, 0], [0, 0, 0], [0, 0, 0], [1, 0, 0]], bool)
    settling = measured(sheet, skips=True)
    assert settling.back_clocks.tolist() == [0, FIRST, 0]


def test_slow_cells_rows_and_columns():
    takes = np.full((6, 6), 20)
    takes[4] = 45
    takes[:, 1] = 41
    takes[0, 5] = 76
    takes[2, 3] = 40
    slow = measured(SlowSheet(takes)).slow()
    assert (slow.rows, slow.columns) == ([4], [1])
    assert set(slow.cells) == {(row, column) for row in range(6) for column in range(6) if takes[row, column] > 40}


def test_nothing_known_is_nothing_slow():
    settling = Settling((2, 2), FIRST, SETTLE)
    assert settling.next_clocks() is None
    assert np.isnan(settling.median)
    assert settling.slow().cells == []
