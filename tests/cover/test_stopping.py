"""Peak forces of a late stop and of none: the one test that notices a wrong sign of drive or brake, or a lost bed."""

import dataclasses
import math

import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from contactfpga.design.cover import Bed, Cover, Switch
from contactfpga.design.cover.stopping import peak_forces
from contactfpga.design.cover.task import FIRST_DESIGN

E_PA, RADIUS_M, MASS = 2e5, 0.019, FIRST_DESIGN.arm.inertia_kgm2 / 0.2**2
BED = Bed(0.01, 4e-4, 0.1)


def force_n(depth, bed):
    """Hertz on the half-space, in series with pads of p = E e/(1 - e), by a search for the force."""

    def beyond(force):
        hertz = (force * 3 / 4 / (E_PA / 0.75) / math.sqrt(RADIUS_M)) ** (2 / 3)
        pads = bed.thickness_m * force / (bed.area_m2 * E_PA + force) if bed else 0.0
        return hertz + pads - depth

    return 0.0 if depth <= 0 else brentq(beyond, 0, 300, xtol=1e-9)


def integrated(push_n, brake_n, latency_s, bed, speed):
    def slope(seconds, y):
        drive = push_n if seconds < latency_s else -brake_n
        return y[1], (drive - force_n(y[0], bed)) / MASS

    def rests(seconds, y):
        return y[1]

    rests.terminal, rests.direction = True, -1
    ends = solve_ivp(slope, (0, 0.2), (0, speed), events=rests, rtol=1e-8, atol=1e-10, max_step=2e-4).y[0, -1]
    return force_n(ends, bed)


@pytest.mark.parametrize("bed", [None, BED])
@pytest.mark.parametrize(
    ("torque", "brake", "latency"), [(0.0, 0.0, 6e-3), (1.5, 3.0, 4e-3), (1.5, 3.0, 0.1), (3.0, 1.0, 1e-3)]
)
def test_a_late_stop_and_none_are_what_an_integration_finds(bed, torque, brake, latency):
    arm = dataclasses.replace(FIRST_DESIGN.arm, torque_nm=torque)
    task = dataclasses.replace(FIRST_DESIGN, arm=arm, brake_nm=brake, latency_s=latency, radius_m=RADIUS_M)
    found = peak_forces(task, Cover("point", 5e-3, Switch(), modulus_pa=E_PA, bed=bed), 0.01, 0.01)
    push, force = torque / 0.2, brake / 0.2
    assert found.late == pytest.approx(integrated(push, force, latency, bed, 0.4), rel=2e-3)
    assert found.no_stop == pytest.approx(integrated(push, -push, 0.0, bed, 0.4), rel=2e-3)


def test_a_cover_pressed_solid_has_no_number():
    hard = dataclasses.replace(FIRST_DESIGN, speed_m_s=40.0)
    assert peak_forces(hard, Cover("foam", 1e-3, Switch()), 0.01, 0.01) == (math.inf, math.inf)
