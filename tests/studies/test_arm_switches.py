"""Switches under the arm's cover, one by one."""

import math

import numpy as np
import pytest

from contactfpga.skin import Skin
from contactfpga_sim.lab.arm.case import Case
from contactfpga_sim.lab.arm.world import Switches

PAPER = Case.load("paper")
SKIN = Skin(rows=12, columns=14, pitch_y_mm=8.0)
CLOSING_PA = 1 / 12.6e-6


def below(force, x_mm, y_mm, depth_mm=5.0):
    """(9) at every switch of the sheet, one after the other."""
    stress = np.zeros((SKIN.rows, SKIN.columns))
    for row in range(SKIN.rows):
        for column in range(SKIN.columns):
            rho2 = (10.0 * column - x_mm) ** 2 + (8.0 * row - y_mm) ** 2
            stress[row, column] = 1e6 * 3 * force * depth_mm**3 / (2 * math.pi * (rho2 + depth_mm**2) ** 2.5)
    return stress


def test_two_touches_press_each_switch_by_the_sum_of_9_over_its_face():
    case = PAPER.but(touch=({"x_mm": 33.0, "y_mm": 41.0}, {"x_mm": 90.0, "y_mm": 16.0}))
    found = Switches(case, SKIN).forces_n((7.0, 12.0))
    assert found == pytest.approx(12.6e-6 * (below(7.0, 33.0, 41.0) + below(12.0, 90.0, 16.0)), rel=1e-12)


def test_every_switch_closes_at_its_stress_and_opens_a_fifth_below():
    place = {"x_mm": 43.0, "y_mm": 30.0}
    switches = Switches(PAPER.but(touch=(place,)), SKIN)
    per_newton = below(1.0, 43.0, 30.0)
    closes, opens = CLOSING_PA / per_newton, 0.8 * CLOSING_PA / per_newton
    made = np.zeros(per_newton.shape, bool)
    forces = [*np.arange(0.0, 130.0, 0.37), *np.arange(130.0, 0.0, -0.37), 0.0]
    most = 0
    for number, force in enumerate(forces):
        made = np.where(made, force > opens, force >= closes)
        found = switches.at(1e-3 * number, (force,))
        assert (found == made).all()
        most = max(most, int(found.sum()))
    assert most == 3
    assert not found.any()


def test_a_switch_bounces_after_it_closes_and_after_it_opens():
    """Closed, then open and closed by half periods of 0.49 ms for 2.2 ms; and the other way round."""
    case = PAPER.but(switch={"bounce_s": 2.2e-3, "bounce_period_s": 0.98e-3}, touch=({"x_mm": 40.0, "y_mm": 40.0},))
    switches = Switches(case, SKIN)
    levels = []
    for number in range(140):
        force = 6.0 if 20 <= number < 80 else 0.0
        found = switches.at(1e-4 * number + 1e-9, (force,))
        levels.append(bool(found[5, 4]))
        assert found.sum() == levels[-1]
    bounce = [True] * 5 + [False] * 5 + [True] * 5 + [False] * 5
    closing = [*bounce, *[True] * 40]
    opening = [*(not level for level in bounce), *[False] * 40]
    assert levels == [*[False] * 20, *closing, *opening]
