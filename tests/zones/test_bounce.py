"""How long switches bounce: planted bounces come back, to what frames can resolve."""

import tomllib

import numpy as np
import pytest
from histories import frames

from contactfpga import ContactFPGAError, Skin
from contactfpga.instruments.bounce import QUIET_US, Bounce, Proposal

SKIN = Skin(rows=2, columns=3, report="cells", settle_us=40.0)
RATE_HZ = 10_000.0
FRAME_US = 100


def level(edges_us, at_us):
    """Of a switch that is open at first and turns at each of these times."""
    return np.searchsorted(edges_us, at_us, side="right") % 2 == 1


def chatter(rng, start_us, us):
    """Edges, an odd number, the first and the last of them so far apart."""
    if not us:
        return [start_us]
    count = 2 * int(rng.integers(1, 4)) - 1
    return [start_us, *np.sort(start_us + rng.uniform(0, us, count)).tolist(), start_us + us]


def measured(edges, seconds, **options):
    """``edges``: of each (row, column), in us."""
    cells = np.zeros((round(seconds * RATE_HZ), SKIN.rows, SKIN.columns), bool)
    for (row, column), edges_us in edges.items():
        cells[:, row, column] = level(edges_us, np.arange(len(cells)) * FRAME_US)
    bounce = Bounce(**options)
    for zones in frames(SKIN, cells, RATE_HZ):
        bounce.update(zones)
    bounce.finish()
    return bounce


@pytest.mark.parametrize("seed", range(2))
def test_planted_bounces_come_back_as_frames_show_them(seed):
    rng = np.random.default_rng(seed)
    edges, starts = {}, {}
    for cell in ((0, 0), (0, 2), (1, 1)):
        starts[cell] = [10_000 + 100_000 * turn + rng.uniform(0, 1000) for turn in range(8)]
        edges[cell] = [
            edge for start in starts[cell] for edge in chatter(rng, start, rng.choice([0, rng.uniform(500, 6000)]))
        ]
    bounce = measured(edges, 0.9)
    assert bounce.blips == []
    for cell, times in edges.items():
        found = [one for one in bounce.bounced if one.cell == cell]
        assert [one.pressed for one in found] == [True, False] * 4
        for one, start in zip(found, starts[cell]):
            own = [edge for edge in times if start <= edge <= start + 10_000]
            shown = np.flatnonzero(np.diff(level(times, np.arange(start // 100 * 100, start + 10_000, FRAME_US))))
            assert (one.us, one.changes) == (FRAME_US * np.ptp(shown), len(shown))
            assert one.us <= own[-1] - own[0] + FRAME_US


def test_a_bounce_that_frames_see_whole_is_measured_to_a_frame():
    """Open and closed for a millisecond each."""
    edges = [20_050, 21_050, 22_050, 120_050, 121_050, 122_050, 123_050, 124_050]
    bounce = measured({(1, 2): edges}, 0.2)
    assert [(one.cell, one.pressed, one.us, one.changes) for one in bounce.bounced] == [
        ((1, 2), True, 2000, 3),
        ((1, 2), False, 4000, 5),
    ]
    assert bounce.times_us(True).tolist() == [2000]
    assert bounce.longest() == {(1, 2): 4000}


def test_the_proposal_is_twice_the_longest_and_two_frames():
    bounce = measured({(1, 2): [20_050, 21_050, 22_050, 120_050]}, 0.2)
    proposal = bounce.proposal()
    assert proposal == Proposal("asym_eager_defer_pk", 2 * (2000 + 2 * FRAME_US), 2 * 2 * FRAME_US)
    fields = tomllib.loads(proposal.lines)
    assert SKIN.replace(**fields).debounce_press_us == 4400
    assert fields == {"debounce": "asym_eager_defer_pk", "debounce_press_us": 4400, "debounce_release_us": 400}


def test_switches_that_do_not_bounce_need_no_debounce():
    assert measured({(0, 0): [20_000, 120_000]}, 0.2).proposal() is None
    assert measured({}, 0.2).proposal() is None
    assert measured({}, 0.2).slow() == {}


def test_a_touch_shorter_than_the_rest_is_a_blip():
    bounce = measured({(0, 0): [20_000, 25_000]}, 0.1)
    assert bounce.bounced == []
    assert [(one.us, one.changes) for one in bounce.blips] == [(5000, 2)]


def test_two_touches_are_two_where_a_switch_rests_between_them():
    rest = QUIET_US + 2 * FRAME_US
    edges = [20_000 + rest * step for step in range(4)]
    assert [one.changes for one in measured({(0, 0): edges}, 0.2).bounced] == [1, 1, 1, 1]


def test_what_has_not_come_to_rest_does_not_count():
    assert measured({(0, 0): [95_000]}, 0.1).bounced == []


def test_slow_switches_stand_out():
    edges = {(0, column): [20_050, 21_050, 22_050] for column in range(3)}
    assert measured(edges, 0.1).slow() == {}
    edges[1, 0] = [20_050, 21_050, 30_050]
    assert measured(edges, 0.1).slow() == {(1, 0): 10_000}


def test_a_board_that_sends_on_change_resolves_the_least_distance_of_frames():
    bounce = Bounce(on_change=True)
    for zones, time_us in zip(frames(SKIN, np.zeros((4, 2, 3), bool)), (0, 50_000, 50_120, 100_120)):
        zones.time_us = time_us
        bounce.update(zones)
    assert bounce.resolution_us == 120
    assert Bounce().resolution_us == 0


def test_a_board_that_starts_again_ends_no_press():
    bounce = Bounce()
    pressed = np.ones((1, 2, 3), bool)
    for one in (
        *frames(SKIN, ~pressed, start_us=500_000),
        *frames(SKIN, pressed),
        *frames(SKIN, pressed, start_us=90_000),
    ):
        bounce.update(one)
    bounce.finish()
    assert bounce.bounced == bounce.blips == []


def test_zones_are_refused():
    with pytest.raises(ContactFPGAError, match='report = "cells"'):
        Bounce().update(next(frames(Skin(), np.zeros((1, 16, 16), bool))))
