"""The record of a touch, against one that sees the cells: kills a record that takes one cell for another, forgets when
a cell closed first, or misses that a contact slid."""

import itertools

import numpy as np
import pytest

from contactfpga.tracking.growth import BOUNCE_US, Closing, Growth, Moments

CELLS = list(itertools.product((3, 4), (6, 7)))
"""(row, column) of a square of four."""
STEP_US = 3000


def moments(cells):
    return Moments(len(cells), sum(x for _, x in cells), sum(y for y, _ in cells))


def closing(time_us, *cells):
    return Closing(time_us, moments(cells))


def grown(frames, around=0):
    """The record of zones, each a set of cells, one every step."""
    growth = Growth(around)
    for number, cells in enumerate(frames):
        growth.take(moments(cells), number * STEP_US)
    return growth


def test_every_course_of_four_cells_that_change_one_at_a_time():
    """All that six steps can do: first times by cell, and whether one closed while another was open for too long."""
    outcomes = set()
    for steps in itertools.product((None, *CELLS), repeat=6):
        now, gone, first, moved, since = {CELLS[0]}, set(), {CELLS[0]: 0}, False, 0
        growth = grown([now])
        for time_us, cell in enumerate(steps, 1):
            time_us *= STEP_US
            if cell in now:
                since = since if gone else time_us
                now, gone = now - {cell}, gone | {cell}
            elif cell is not None:
                now, gone = now | {cell}, gone - {cell}
                first.setdefault(cell, time_us)
            long = bool(gone) and time_us - since >= BOUNCE_US
            moved = moved or (long and since <= max(first.values()))
            growth.take(moments(now), time_us)
            assert (growth.moved, growth.shrinks or growth.moved) == (moved, long or moved), steps
            if moved:
                break
        else:
            assert growth.closings == sorted(closing(at, cell) for cell, at in first.items()), steps
        outcomes.add((moved, len(first)))
    assert outcomes == {(moved, count) for moved in (False, True) for count in (1, 2, 3, 4)} - {(True, 1)}


def test_cells_that_close_together_are_stated_together():
    growth = grown([CELLS[:1], CELLS[:1], CELLS])
    assert growth.closings == [closing(0, CELLS[0]), closing(2 * STEP_US, *CELLS[1:])]
    assert not growth.moved


@pytest.mark.parametrize(
    "frames",
    [
        [CELLS[:2], CELLS[1:3]],  # one opens as another closes
        [CELLS[:1], CELLS[:2], [*CELLS[:2], CELLS[1]]],  # by the moments, a closed cell closes
        [CELLS[:1], CELLS[:2], *[CELLS[:1]] * 3, [CELLS[0], CELLS[3]]],  # one closes while another has long been open
    ],
)
def test_what_no_growth_in_place_does_is_a_move(frames):
    growth = grown(frames)
    recorded = list(growth.closings)
    growth.take(moments([*frames[-1], (20, 20)]), 10**7)
    assert growth.moved
    assert growth.closings == recorded  # nor is more recorded, so that it does not grow for ever


def test_cells_that_open_and_close_together_or_come_late_at_a_low_rate_do_not_move():
    bounced = grown([CELLS[:1], CELLS[:3], CELLS[:1], CELLS[:3]])
    assert bounced.closings == [closing(0, CELLS[0]), closing(STEP_US, *CELLS[1:3])]
    five = [(0, column) for column in range(5)]
    assert not any(one.moved or one.shrinks for one in (bounced, grown([five, five, [*five, (0, 5)]])))


def test_a_cell_that_closes_long_after_five_others_is_a_move():
    five = [(0, column) for column in range(5)]
    steps = [five[: 1 + number] for number in range(5)]
    for pause, moved in ((8, False), (9, True)):
        assert grown([*steps, *[five] * (pause - 1), [*five, (0, 5)]]).moved is moved


def test_turns_around_a_closed_sheet_do_not_matter(rng):
    """Columns count on past the seam, from whichever end the labeller came."""
    cells, around = [(0, 14), (0, 15), (1, 15), (0, 16), (1, 16), (1, 17)], 16
    growth, flat = Growth(around), Growth()
    for count in range(1, 7):
        here = moments(cells[:count])
        flat.take(here, count)
        growth.take(here.shifted(around * rng.choice([-1, 0, 1]) if count > 1 else 0), count)
    assert growth.closings == flat.closings


def test_contacts_that_meet_have_the_cells_of_both():
    one, other = grown([CELLS[:1], CELLS[:2]]), Growth(16)
    other.take(moments([(3, 8 + 16)]), 4000)
    around = Growth(16)
    for number in (1, 2):
        around.take(moments(CELLS[:number]), (number - 1) * STEP_US)
    around.join(other)
    around.take(moments([*CELLS[:2], (3, 8)]), 5000)
    assert around.closings == [*one.closings, closing(4000, (3, 8))]
    assert np.sum([each.closed for each in around.closings], axis=0).tolist() == list(moments([*CELLS[:2], (3, 8)]))
    assert not around.moved
    other.moved = True
    around.join(other)
    assert around.moved
