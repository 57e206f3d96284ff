"""Force on the switches under faces and caps: closed forms, finite elements, and what must only rise."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import integrate, special

from contactfpga.design.cover import (
    BODIES,
    Bed,
    Cap,
    Cells,
    Cover,
    CoverError,
    Ellipse,
    Load,
    Rectangle,
    Switch,
    medium,
    point,
)
from contactfpga.design.cover.moving import MovingBody
from contactfpga.design.cover.press import read_cover, write_cover
from contactfpga_sim.lab.cover.elements import Block

PITCH = 10e-3


def cells(cover, count=8, pitch=PITCH, seed=0):
    return Cells(cover, count, count, pitch, pitch, seed)


def finger(x_mm, y_mm, force=2.0, half=(7.0, 6.0)):
    """At a place in mm from the sheet's corner."""
    return [Load((Ellipse(half[0] * 1e-3, half[1] * 1e-3, (x_mm - 5) * 1e-3, (y_mm - 5) * 1e-3),), force)]


def capped(thickness_mm, side_mm, stiffness=math.inf, proud=True, cut=False):
    switch = Switch(travel_m=0.0 if math.isinf(stiffness) else 1e-3 / stiffness)
    return Cover("foam", thickness_mm * 1e-3, switch, cap=Cap(side_mm * 1e-3, proud), cut=cut)


# ---- against finite elements


@pytest.mark.parametrize("stiffness", [math.inf, 2.0])
@pytest.mark.parametrize("middle", [0, 0.5])
@pytest.mark.parametrize(("thickness", "side", "pitch"), [(2, 5.8, 6.4), (2, 9, 10), (5, 6, 10)])
def test_proud_caps_carry_all_of_the_foam(thickness, side, pitch, middle, stiffness):
    """Foam glued to caps that stand or give way, over one and between four: the largest force, on which it depends
    whether a touch is felt, is off by at most a tenth."""
    middles = pitch * (middle + np.arange(3))
    planes = middles[:, None] + np.append(np.linspace(-side / 2, side / 2, 5), pitch / 2)
    planes = np.unique(np.maximum(0, np.append(planes, 0)).round(6))
    on = np.abs(planes[:, None] - middles) < side / 2 + 1e-9
    caps = np.where(np.outer(on.any(axis=1), on.any(axis=1)), 3 * on.argmax(axis=1)[:, None] + on.argmax(axis=1), -1)
    foam = Block(planes, planes, np.linspace(0, thickness, 4), medium.POISSON, (True, True), caps.ravel() >= 0)
    widths = (np.diff(planes, prepend=0) + np.diff(planes, append=planes[-1])) / 2
    load = np.sqrt(np.maximum(0, 1 - (foam.top_x / 7) ** 2 - (foam.top_y / 6) ** 2)) * np.outer(widths, widths).ravel()
    parts = np.outer(*[np.where(middles == 0, 0.5, 1)] * 2).ravel()  # of caps that the planes of symmetry cut
    springs = min(stiffness, 1e6) * parts
    carried = foam.on_plates(Cover().modulus_pa / 1e6, caps.ravel(), springs, load / load.sum() / 2)
    sheet = Cells(capped(thickness, side, stiffness), 9, 9, pitch * 1e-3, pitch * 1e-3)
    place = pitch * (4 - middle) + 5
    found = sheet.forces_n(finger(place, place))
    assert found.max() == pytest.approx((carried / parts).max(), rel=0.1)
    assert found.sum() == pytest.approx(4 * carried.sum(), rel=1e-5)


# ---- against closed forms


@pytest.mark.parametrize("offset_mm", [0.0, 3.0, 7.0])
def test_the_point_model_is_the_papers(offset_mm):
    cover = Cover("point", 5e-3, Switch())
    found = cells(cover).forces_n([Load((Ellipse(1e-3, 1e-3, 0.03 + offset_mm * 1e-3, 0.03),), 12.0)])
    stress = point.stress_pa(12.0, offset_mm * 1e-3, 5e-3)
    assert found[3, 3] == pytest.approx(float(stress) * 12.6e-6, rel=1e-12)


def test_a_face_takes_the_mean_of_the_stress_on_it():
    """The stress by superposed point forces, on a fine grid of the paper's face."""
    cover, patch = Cover("foam", 5e-3, Switch()), Ellipse(7e-3, 5e-3, 0.031, 0.032, 0.3)
    found = cells(cover).forces_n([Load((patch,), 10.0)])
    waves = np.linspace(0, 40, 8001)
    away = np.linspace(0, 4, 401)
    spread = integrate.trapezoid(waves * medium.foam(waves) * special.j0(np.outer(away, waves)), waves) / (2 * np.pi)
    inside = (np.arange(16) + 0.5) / 16 - 0.5
    at_x, at_y, shares = patch.pressure(5e-3)
    for row, column in ((3, 3), (3, 4), (2, 3)):
        x, y = (place * PITCH + inside * cover.side_m for place in (column, row))
        far = np.hypot(x[None, :, None] - at_x, y[:, None, None] - at_y) / 5e-3
        mean = 10 / 5e-3**2 * (np.interp(far, away, spread) @ shares).mean()
        assert found[row, column] == pytest.approx(mean * 12.6e-6, abs=6e-3)


def test_cut_foam_hands_each_tile_the_pressure_on_it():
    """A bar over two tiles and a half, flat: by area; a disc between four caps: a quarter each."""
    sheet = cells(capped(2.0, 9.0, cut=True))
    bar = [Load((Rectangle(12.5e-3, 4e-3, 0.0325, 0.03),), 10.0)]
    assert sheet.forces_n(bar)[3, 2:5] == pytest.approx([2.0, 4.0, 4.0], abs=1e-9)
    assert sheet.forces_n(finger(40, 40))[3:5, 3:5] == pytest.approx(np.full((2, 2), 0.5), abs=1e-9)


# ---- what must only rise, and what must not matter


@given(st.floats(20, 60), st.floats(20, 60), st.floats(1.0, 6.0), st.booleans(), st.floats(0.0, 3e-4))
def test_forces_add_up_and_scale(x, y, thickness, cut, travel):
    cover = Cover("foam", thickness * 1e-3, Switch(travel_m=travel), cap=Cap(8e-3), cut=cut)
    sheet = cells(cover)
    one, two = finger(x, y, 3.0), finger(80 - y, x, 5.0)
    assert sheet.forces_n(one + two) == pytest.approx(sheet.forces_n(one) + sheet.forces_n(two), abs=1e-9)
    assert sheet.forces_n(finger(x, y, 6.0)) == pytest.approx(2 * sheet.forces_n(one), abs=1e-9)
    assert sheet.forces_n(one).sum() == pytest.approx(3.0, rel=5e-3)  # foam near the edge passes some on beyond it


@pytest.mark.parametrize("swap", [True, False])
def test_a_sheet_turned_over_its_diagonal_takes_the_forces_turned(swap):
    cover = capped(3.0, 5.0, 4.0)
    upright, lying = Cells(cover, 6, 9, 7e-3, 11e-3), Cells(cover, 9, 6, 11e-3, 7e-3)
    load = Load((Ellipse(8e-3, 5e-3, 0.02, 0.05, 0.4),), 4.0)
    turned = Load((Ellipse(5e-3, 8e-3, 0.05, 0.02, -0.4),), 4.0)
    assert lying.forces_n([turned]) == pytest.approx(upright.forces_n([load]).T, abs=1e-9)


def test_what_lies_beside_the_sheet_presses_it_no_more_than_what_lies_on_it():
    sheet = cells(capped(5.0, 8.0))
    assert sheet.forces_n(finger(-40, 40)).sum() == 0
    assert 0 < sheet.forces_n(finger(0, 40)).sum() < 2


@pytest.mark.parametrize("cut", [True, False])
@pytest.mark.parametrize("closed", [True, False])
def test_a_body_that_moves_presses_as_one_that_stands(cut, closed):
    """Anywhere, on the edges and over the seam, at any force: to 3 % of the most pressed switch, 9 % where caps at an
    edge give way without neighbors."""
    cover, rng = Cover("foam", 2e-3, Switch(0.4, travel_m=2e-4), cap=Cap(5.8e-3), cut=cut), np.random.default_rng(5)
    body, parts, pitch, off = BODIES["finger"], (Ellipse(6e-3, 5e-3),), 6.4e-3, []
    sheet = Cells(cover, 10, 36, pitch, pitch)  # the sheet, and what is beyond its ends
    moving = MovingBody(cover, (10, 12), (pitch, pitch), parts, body, closed)
    for x, y, force in rng.uniform((-0.5, -0.5, -1), (11.5, 9.5, 1.3), (100, 3)).tolist():
        indentation = sheet.indentation(parts, body)
        pressed = indentation.parts_at(indentation.depth_m(10**force))
        load = Load(tuple(part.placed((x + 12) * pitch, y * pitch, 0.0) for part in pressed), 10**force)
        around = sheet.forces_n([load]).reshape(10, 3, 12)
        expected = around.sum(axis=1) if closed else around[:, 1]
        inside = cut or (1.5 < y < 7.5 and (closed or 1.5 < x < 9.5))
        error = np.abs(moving.forces_n(x * pitch, y * pitch, 10**force) - expected).max() / expected.max()
        off.append(error / (0.03 if inside else 0.09))
    assert 0.01 < max(off) < 1


# ---- thresholds


def test_closing_forces_are_drawn_once_for_a_seed():
    cover = Cover("foam", 2e-3, Switch(0.4, spread=0.1, preload_n=0.1), cap=Cap(8e-3))
    one, same, other = (Cells(cover, 40, 40, PITCH, PITCH, seed).thresholds_n for seed in (1, 1, 2))
    assert (one == same).all()
    assert (one != other).all()
    assert one.mean() == pytest.approx(0.3, abs=3 * 0.04 / 40)
    assert one.std() == pytest.approx(0.04, rel=0.08)
    assert 0.4 * 0.7 - 0.1 <= one.min() < one.max() <= 0.4 * 1.3 - 0.1


def test_a_closed_switch_opens_at_a_lower_force():
    cover = Cover("foam", 2e-3, Switch(0.5, hysteresis=0.2), cap=Cap(8e-3))
    sheet = cells(cover)
    peak = sheet.forces_n(finger(45, 45, 1.0)).max()
    closes, holds, opens = 0.501 / peak, 0.41 / peak, 0.399 / peak
    before = sheet.closed(finger(45, 45, closes))
    assert before.sum() == 1
    assert not sheet.closed(finger(45, 45, holds)).any()
    assert sheet.closed(finger(45, 45, holds), before).sum() == 1
    assert not sheet.closed(finger(45, 45, opens), before).any()


def test_false_presses_are_those_that_are_drawn():
    """Expected number against many drawn sheets, with the arm's own acceleration of 1 g on 20 g caps and foam."""
    cover = Cover("foam", 2e-3, Switch(0.5, spread=0.2, preload_n=0.1), cap=Cap(8e-3, mass_kg=0.02))
    weight = (0.02 + 300 * PITCH**2 * 2e-3) * 9.81
    drawn = [Cells(cover, 30, 30, PITCH, PITCH, seed).thresholds_n <= weight for seed in range(200)]
    expected = cells(cover, 30).false_presses(9.81, 300)
    assert 10 < expected == pytest.approx(np.mean([one.sum() for one in drawn]), rel=0.08)
    assert cells(Cover("foam", cap=Cap(8e-3)), 30).false_presses() == 0


# ---- files and refusals


def test_a_cover_with_caps_comes_back_from_its_file():
    import tomllib

    cover = Cover(
        *("foam", 2e-3, Switch(0.4, travel_m=2e-4, spread=0.1, hysteresis=0.2, preload_n=0.05)),
        cap=Cap(6e-3, mass_kg=1e-4),
        cut=True,
        bed=Bed(0.01, 1.6e-3, 0.08),
    )
    assert read_cover(tomllib.loads(write_cover(cover))["cover"]) == cover


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: cells(Cover()), r"model is 'patch', which knows no force"),
        (lambda: cells(capped(2.0, 11.0)), r"a cap is 0.011 m wide; the pitch is 0.01 m, take a smaller one"),
        (lambda: Cover("foam", cut=True), r"cut is true; foam is cut between caps, give \[cover.cap\] as well"),
        (lambda: Cover("point", cap=Cap(8e-3)), r"the model 'point' knows no cap; take 'foam'"),
        (lambda: Cover("foam", switch=Switch(travel_m=1e-4)), r"travel_m is 0.0001; only a switch under a proud cap"),
        (
            lambda: read_cover({"poisson": 0.3}),
            r"poisson in \[cover\] no longer exists; leave it out, the foam's is 0.2",
        ),
        (lambda: Cover("bonded"), r"model is 'bonded', which no longer exists; take 'foam'"),
        (lambda: Switch(spread=0.4), r"spread is 0.4; it must lie between 0 and 0.3"),
        (lambda: Switch(preload_n=1.0), r"preload_n is 1; the switch closes at 1 N, preload less"),
        (lambda: Cap(0.0), r"side_m is 0.0; it must be a finite number above 0 m"),
    ],
)
def test_what_no_sheet_can_have(make, words):
    with pytest.raises(CoverError, match=words):
        make()
