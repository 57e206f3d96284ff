"""The cover: reference values of the paper's equations as corrected, limits, and what has no answer."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import integrate, special

from contactfpga.design.cover import (
    Ball,
    Cover,
    CoverError,
    Ellipse,
    Load,
    Rectangle,
    Switch,
    hertz,
    medium,
    point,
)

SWITCH = Switch(force_n=1.0, area_m2=12.6e-6)
BALL = Ball(radius_m=0.038, modulus_pa=4.6e5)


# ---- a point force: reference values, to their printed digits


@pytest.mark.parametrize(
    ("offset_mm", "thickness_mm", "newtons", "digits"),
    [
        (0, 5, 4.15555, 5),
        (5 * math.sqrt(2), 5, 64.7785, 4),
        (5 * math.sqrt(2), 10, 45.8054, 4),
        (0, 10, 16.622, 3),
        (5 * math.sqrt(2), 8.6602540378, 44.7066, 4),
    ],
)
def test_force_that_closes_a_switch(offset_mm, thickness_mm, newtons, digits):
    assert round(point.force_n(SWITCH, offset_mm * 1e-3, thickness_mm * 1e-3), digits) == newtons


@pytest.mark.parametrize(
    ("newtons", "millimeters"), [(5, 1.3857), (12, 3.6344), (15, 4.0958), (30, 5.4885), (65, 7.0783), (15.789, 4.2002)]
)
def test_reach_of_a_force(newtons, millimeters):
    assert round(point.reach_m(SWITCH, newtons, 5e-3) * 1e3, 4) == millimeters


@pytest.mark.parametrize(
    ("ratio", "bonded", "frictionless"),
    [(0, 1.571, 1.723), (0.4, 1.443, 1.629), (0.8, 1.041, 1.300), (1, 0.758, 1.029), (1.414, 0.190, 0.291)],
)
def test_layers_over_the_half_space(ratio, bonded, frictionless):
    for name, expected in (("bonded", bonded), ("frictionless", frictionless)):
        for spread in (medium.spread, medium.exact_spread):
            assert round(float(spread(name, ratio) / medium.spread("halfspace", ratio)), 3) == expected


@given(
    st.floats(0.05, 1.5),
    st.floats(1e-3, 0.05),
    st.floats(0.01, 10),
    st.sampled_from(medium.MEDIA),
)
def test_reach_undoes_force(ratio, thickness, newtons, within):
    switch = Switch(force_n=newtons)
    force = point.force_n(switch, ratio * thickness, thickness, within)
    assert point.reach_m(switch, force, thickness, within) == pytest.approx(ratio * thickness, rel=1e-6)


# ---- the media


@pytest.mark.parametrize("base", ["bonded", "frictionless"])
@pytest.mark.parametrize("t", [0.01, 0.3, 1.0, 2.7, 9.0])
def test_transfer_against_the_boundary_problem(base, t):
    # W = (A + B s) cosh s + (C + D s) sinh s solves (D^2 - 1)^2 W = 0; each row is linear in (A, B, C, D).
    def derivatives(s):
        ch, sh = math.cosh(s), math.sinh(s)
        value = np.array([ch, s * ch, sh, s * sh])
        first = np.array([sh, ch + s * sh, ch, sh + s * ch])
        second = np.array([ch, 2 * sh + s * ch, sh, 2 * ch + s * sh])
        third = np.array([sh, 3 * ch + s * sh, ch, 3 * sh + s * ch])
        return value, first, second, third

    def shear(s):
        value, _, second, _ = derivatives(s)
        return second + value

    def normal(s):
        _, first, _, third = derivatives(s)
        return (3 * first - third) / 2

    value, first, _, _ = derivatives(t)
    held = first if base == "bonded" else shear(t)
    coefficients = np.linalg.solve(np.array([shear(0), normal(0), value, held]), [0, 1, 0, 0])
    assert medium.transfer(base, np.array([t]))[0] == pytest.approx(normal(t) @ coefficients, rel=1e-7)


@pytest.mark.parametrize("within", ["bonded", "frictionless"])
def test_spread_against_scipys_bessel_function(within):
    for s in (0.0, 0.3, 1.2, 1.671, 2.7, 6.0, 15.0):
        whole = integrate.quad(
            lambda t, s=s: t * medium.transfer(within, t) * special.j0(t * s), 0, 45, limit=400, epsabs=1e-13
        )[0]
        assert float(medium.exact_spread(within, s)) == pytest.approx(whole / (2 * np.pi), abs=2e-10)
        assert float(medium.spread(within, s)) == pytest.approx(whole / (2 * np.pi), abs=1e-7)


# ---- the Hertz patch


@pytest.mark.parametrize(("offset_mm", "pascals"), [(0, 53513), (4, 45636), (12, 5209)])
def test_stress_below_a_patch(offset_mm, pascals):
    assert round(float(hertz.stress_pa(12, BALL.patch_m(12), offset_mm * 1e-3, 5e-3))) == pascals


# ---- which switches close


def test_share_of_a_switchs_face():
    half = Rectangle(0.05, 0.05, x_m=0.05)  # covers all places with x above 0
    face = Switch(area_m2=4e-6)  # 2 mm by 2 mm
    x = np.array([-1.1e-3, -0.57e-3, -0.1e-3, 0.1e-3, 0.43e-3, 0.57e-3, 1.1e-3])
    for share, expected in ((0.25, [0, 0, 1, 1, 1, 1, 1]), (0.5, [0, 0, 0, 1, 1, 1, 1]), (0.75, [0, 0, 0, 0, 0, 1, 1])):
        closed = Cover(share=share, switch=face).under([Load((half,), 1.0)], x, np.zeros(7))
        assert closed.astype(int).tolist() == expected, share
    assert Cover().under([Load((half,), 1.0)], x, np.zeros(7)).astype(int).tolist() == [0, 0, 0, 1, 1, 1, 1]


def test_no_contact_closes_nothing():
    x = np.zeros((3, 4))
    closed = Cover().under([], x, x)
    assert (closed.shape, closed.any()) == ((3, 4), False)


# ---- input that cannot be


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Switch(force_n=0), r"force_n is 0; it must be a finite number above 0 N"),
        (lambda: Cover("rubber"), r"model is 'rubber'; it must be one of patch, foam, point"),
        (lambda: Cover(thickness_m=0), r"thickness_m is 0; it must be a finite number above 0 m"),
        (lambda: Cover(share=1.5), r"share is 1.5; it must lie above 0 and not above 1"),
        (lambda: Cover("point", share=0.5), r"share is 0.5; the model 'point' goes by stress, leave it out"),
        (lambda: Load((Ellipse(1, 1),), -2.0), r"force_n is -2.0; it must be a finite number, 0 N or above"),
        (lambda: Rectangle(0.01, 0.01, x_m="3"), r"x_m is '3'; it must be a finite number"),
        (lambda: medium.spread("sand", 1.0), r"medium is 'sand'; it must be one of halfspace, bonded, frictionless"),
        (lambda: hertz.stress_pa(-1.0, 0.01, 0.0, 0.005), r"force_n is -1.0; it must be a finite number, 0 N or above"),
    ],
)
def test_what_cannot_be_is_refused(make, message):
    with pytest.raises(CoverError, match=message):
        make()
