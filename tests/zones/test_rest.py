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


def follow(rest, takes, frames, start_us=0):
    """Frames at level 12 of cells that read pressed from ``takes`` on; returns how many others renewed the rest."""
    renewed = 0
    for number in range(frames):
        if rest.quiet(bool((takes <= 12).any()), start_us + number * FRAME_US):
            level, before, renewed = rest.probe(), rest.levels, renewed + 1
            rest.renew(level, takes <= level)
            assert np.abs(np.log(rest.levels / before)).max() <= math.log(STEP) + 1e-9
    return renewed


def test_each_cell_has_the_first_level_at_which_it_reads_pressed(rng):
    takes = np.array([rng.choice([1, 2, NEVER - 1, NEVER, rng.randrange(1, 256)]) for _ in range(35)]).reshape(5, 7)
    rest, frames = measured(takes)
    assert rest.levels.tolist() == takes.tolist()
    assert rest.high(20) == [tuple(cell) for cell in np.argwhere(takes < 40).tolist()]
    assert frames <= 3 * 8 * takes.size
    assert measured(np.full((64, 64), NEVER))[0].lightest is None
    rest, frames = measured(np.full((64, 64), 60))
    assert (rest.lightest, len(rest.high(30)), len(rest.high(31))) == (math.floor(60 / MARGIN), 0, 4096)
    assert frames <= 3 * 8


def test_a_drift_is_followed_slowly_and_a_lasting_contact_with_its_rim_never():
    takes = np.full((5, 5), 100.0)
    takes[1, 2] = NEVER
    rest, _ = measured(takes)
    assert follow(rest, takes, 2_000)
    assert rest.levels == pytest.approx(takes, rel=0.1)
    takes[0, 0], takes[3, 3] = 50.0, 200.0  # creep
    follow(rest, takes, 3_000, 10**8)
    assert rest.levels == pytest.approx(takes, rel=0.1)
    before, untouched, hour = rest.levels, takes.copy(), 180_000
    takes[1:4, 1:4], takes[2, 2] = 30.0, 5.0  # the rim is too light to read pressed
    assert follow(rest, takes, hour, 10**9) == 0
    assert (rest.levels == before).all()
    assert follow(rest, untouched, QUIET_US // FRAME_US - 1, 10**9 + hour * FRAME_US) == 0, "just gone"
    assert follow(rest, untouched, 10, 10**9 + hour * FRAME_US + QUIET_US) == 10
