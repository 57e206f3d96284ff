"""How far a zone's middle is off under a known cover, against touches at random places that the test presses itself."""

import numpy as np
import pytest

from contactfpga.cover import CoverError
from contactfpga.design.cover import BODIES, Cap, Cells, Cover, Load, Switch
from contactfpga.robot.haptics.cover_bias import RADII_M, CoverBias

TILES = Cover("foam", 0.003, Switch(force_n=0.3), cap=Cap(0.0098))
PITCH = 0.01


@pytest.fixture(scope="module")
def touched():
    """(n, 2): count of cells, and squared distance in m2 of their middle from the touch, for pushes of 5 N."""
    rng, cells, found = np.random.default_rng(1), Cells(TILES, 9, 9, PITCH, PITCH), []
    rigid = BODIES["rigid"]
    balls = [cells.indentation([rigid.ball(radius)], rigid) for radius in RADII_M]
    for _ in range(1200):
        x, y = rng.uniform(3.5, 4.5, 2) * PITCH
        ball = balls[rng.integers(3)]
        (part,) = ball.parts_at(ball.depth_m(5.0))
        rows, columns = np.nonzero(cells.closed([Load((part.placed(x, y, 0.0),), 5.0)]))
        found.append((len(rows), (columns.mean() * PITCH - x) ** 2 + (rows.mean() * PITCH - y) ** 2))
    return np.array(found)


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_the_spread_is_that_of_random_touches_which_close_as_many(touched, count):
    mine = touched[touched[:, 0] == count, 1]
    assert len(mine) > 40
    expected = np.sqrt(mine.mean() / 2)
    assert CoverBias(TILES, PITCH, PITCH).sigma_m(count, 5.0) == pytest.approx(expected, rel=0.15)
    assert expected < 0.7 * PITCH / np.sqrt(12)


def test_what_no_touch_closes_is_not_known():
    pressed = CoverBias(TILES, PITCH, PITCH)
    assert pressed.sigma_m(40, 5.0) is None
    assert pressed.sigma_m(1, 0.0) is None
    assert pressed.sigma_m(1, 1e-3) is None
    with pytest.raises(CoverError, match="patch"):
        CoverBias(Cover(), PITCH, PITCH)
