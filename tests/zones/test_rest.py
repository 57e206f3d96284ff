"""Rest levels from frames that cells with known ones would send.

What only this kills: a level one sixteenth off, a lasting contact or its rim taken for rest, a drift that is not
followed, or followed in a jump.
"""

import math

import numpy as np
import pytest

from contactfpga.instruments.rest import MARGIN, NEVER, QUIET_US, STEP, Rest

FRAME_US = 20_000


def measured(takes):
    rest, frames = Rest(takes.shape), 0
    while (level := rest.next_level()) is not None:
        rest.take(level, takes <= level)
        frames += 1
    return rest, frames


def follow(rest, takes, usual, frames, start_us=0):
    """Frames of cells that read pressed from ``takes`` on, at the usual level and where the rest is renewed."""
    renewed = 0
    for number in range(frames):
        if rest.quiet(bool((takes <= usual).any()), start_us + number * FRAME_US):
            level = rest.probe()
            before = rest.levels
            rest.renew(level, takes <= level)
            assert np.abs(np.log(rest.levels / before)).max() <= math.log(STEP) + 1e-9
            renewed += 1
    return renewed


def test_each_cell_has_the_first_level_at_which_it_reads_pressed(rng):
    takes = np.array(
        [[rng.choice([1, 2, NEVER - 1, NEVER, rng.randrange(1, 256)]) for _ in range(7)] for _ in range(5)]
    )
    rest, frames = measured(takes)
    assert rest.levels.tolist() == takes.tolist()
    assert rest.lightest == max(1, math.floor(takes.min() / MARGIN))
    assert rest.high(20) == [tuple(cell) for cell in np.argwhere(takes < 40).tolist()]
    assert frames <= 3 * 8 * takes.size
    assert measured(np.full((64, 64), NEVER))[0].lightest is None
    assert measured(np.full((64, 64), 60))[1] <= 3 * 8


def test_a_drift_is_followed_slowly_and_an_untouched_sheet_stays_as_it_is():
    takes = np.full((4, 4), 100.0)
    takes[1, 2] = NEVER
    rest, _ = measured(takes)
    assert follow(rest, takes, 12, 2_000)
    assert rest.levels == pytest.approx(takes, rel=0.1)
    takes[0, 0] = 50.0  # creep
    takes[3, 3] = 200.0
    follow(rest, takes, 12, 3_000, 10**8)
    assert rest.levels == pytest.approx(takes, rel=0.1)


def test_a_lasting_contact_with_its_rim_never_becomes_rest():
    takes = np.full((5, 5), 100.0)
    rest, _ = measured(takes)
    before = rest.levels
    takes[1:4, 1:4] = 30.0  # the rim, too light to read pressed
    takes[2, 2] = 5.0
    assert follow(rest, takes, 12, 180_000) == 0, "an hour"
    assert (rest.levels == before).all()
    takes[:] = 100.0
    assert follow(rest, takes, 12, QUIET_US // FRAME_US - 1, 180_000 * FRAME_US) == 0, "just gone"
    assert follow(rest, takes, 12, 10, 180_000 * FRAME_US + QUIET_US) == 10
