"""Speed and reaction time that keep a body region's limits: closed forms, and an integrator of the test's own that
knows two masses, a foam and a spring. All numbers of regions are made up."""

import dataclasses
import json
import math

import pytest

import contactfpga
from contactfpga.cover import Ball, CoverError
from contactfpga.design.cover.answer import NoSolution
from contactfpga.design.cover.region import Pressing, Region, limits_of, load_regions
from contactfpga.tools.cli import main

REGION = Region("forearm, made up", 2.0, 4e4, 120.0, 3e6, 60.0, 1.5e6)
BALL = Ball(0.019, 4.6e5)
ARM = Pressing(0.55, 6.0, 15.0, BALL, 0.009)
STIFFNESS = 4 / 3 * BALL.modulus_pa * math.sqrt(BALL.radius_m)
TABLE = """
[[region]]
name = "forearm, made up"
mass_kg = 2.0
spring_n_m = 40000.0
transient_n = 120.0
transient_pa = 3e6
quasistatic_n = 60.0
quasistatic_pa = 1.5e6
"""


def force_of(pressed_m, spring):
    """F of foam and spring in series, by bisection."""
    low, high = 0.0, STIFFNESS * max(pressed_m, 0.0) ** 1.5
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if (middle / STIFFNESS) ** (2 / 3) + middle / spring < pressed_m else (low, middle)
    return low


def peak_n(mass, other, spring, speed, push, brake, reaction_s, step=4e-5):
    """The largest force: the arm at ``speed``, a region of mass ``other`` at rest (None: clamped), by Runge and Kutta
    until they part."""

    def slopes(t, x, v, w):
        force = force_of(x, spring)
        drive = push if t < reaction_s else -brake
        return v - w, (drive - force) / mass, 0.0 if other is None else force / other, force

    t, x, v, w, most = 0.0, 0.0, speed, 0.0, 0.0
    while t < 0.2:
        # A step ends where the drive changes.
        h = min(step, reaction_s - t) if t < reaction_s else step
        a = slopes(t, x, v, w)
        b = slopes(t + h / 2 * (1 - 1e-9), x + h / 2 * a[0], v + h / 2 * a[1], w + h / 2 * a[2])
        c = slopes(t + h / 2 * (1 - 1e-9), x + h / 2 * b[0], v + h / 2 * b[1], w + h / 2 * b[2])
        d = slopes(t + h * (1 - 1e-9), x + h * c[0], v + h * c[1], w + h * c[2])
        x, v, w = (now + h / 6 * (a[k] + 2 * b[k] + 2 * c[k] + d[k]) for k, now in enumerate((x, v, w)))
        t, most = t + h, max(most, a[3])
        if v - w < 0:
            break
    return most


@pytest.mark.parametrize("other", [0.6, 2.0, 40.0])
def test_the_transient_speed_exerts_the_limit(other):
    region = dataclasses.replace(REGION, mass_kg=other)
    found = limits_of(ARM, region, 0.3, 0.0)
    peak = peak_n(ARM.mass_kg, other, region.spring_n_m, found.transient_m_s, 0.0, 0.0, 0.0)
    assert peak == pytest.approx(found.transient_n, rel=1e-4)


@pytest.mark.parametrize(("speed", "push"), [(0.3, 6.0), (0.45, 6.0), (0.2, 20.0), (0.1, 59.0)])
def test_a_reaction_at_the_longest_time_reaches_the_limit_and_no_more(speed, push):
    arm = dataclasses.replace(ARM, push_n=push)
    found = limits_of(arm, REGION, speed, 0.006)
    if math.isinf(found.reaction_s):
        assert peak_n(arm.mass_kg, None, REGION.spring_n_m, speed, push, push, 1.0) < found.quasistatic_n
        return
    for later, side in ((1.0, 1), (1.03, 1.0005), (0.97, 1 / 1.0005)):
        peak = peak_n(arm.mass_kg, None, REGION.spring_n_m, speed, push, arm.brake_n, later * found.reaction_s)
        if later == 1:
            assert peak == pytest.approx(found.quasistatic_n, rel=1e-3)
        else:
            assert (peak / found.quasistatic_n > side) == (later > 1)


@pytest.mark.parametrize("reaction_s", [0.0, 0.002, 0.006])
def test_the_speed_for_a_reaction_time_keeps_both_limits(reaction_s):
    found = limits_of(ARM, REGION, 0.3, reaction_s)
    peak = peak_n(ARM.mass_kg, None, REGION.spring_n_m, found.clamped_m_s, 6.0, 15.0, reaction_s)
    assert peak == pytest.approx(found.quasistatic_n, rel=1e-3)
    assert found.speed_m_s == min(found.transient_m_s, found.clamped_m_s)
    if reaction_s:
        assert limits_of(ARM, REGION, found.clamped_m_s, 0.0).reaction_s == pytest.approx(reaction_s, rel=1e-6)


def test_closed_forms_at_the_ends():
    """Hard foam: F = v sqrt(mu k), the standard's. A region that gives in nowhere and cannot move: Hertz's impact,
    W = 2/5 K_s delta^2.5. Pressure: 3/2 of the mean under Hertz's patch."""
    wide = dataclasses.replace(REGION, transient_pa=1e9, quasistatic_pa=1e9)
    hard = dataclasses.replace(ARM, ball=Ball(0.019, 1e13), deepest_m=1.0)
    reduced = 1 / (1 / 0.55 + 1 / 2.0)
    soft = dataclasses.replace(wide, transient_pa=1e12, quasistatic_pa=1e12)
    assert limits_of(hard, soft, 0.3, 0.0).transient_m_s == pytest.approx(120 / math.sqrt(reduced * 4e4), rel=1e-3)
    rigid = dataclasses.replace(wide, spring_n_m=1e12, mass_kg=1e12)
    depth = (60 / STIFFNESS) ** (2 / 3)
    found = limits_of(dataclasses.replace(ARM, deepest_m=1.0), rigid, 0.3, 0.0)
    assert found.transient_m_s == pytest.approx(
        math.sqrt(0.8 * STIFFNESS * (120 / STIFFNESS) ** (5 / 3) / 0.55), rel=1e-6
    )
    assert found.clamped_m_s == pytest.approx(math.sqrt(2 * (0.4 * 60 * depth + 15 * depth) / 0.55), rel=1e-6)
    low = dataclasses.replace(REGION, transient_pa=2e5)
    force = limits_of(ARM, low, 0.3, 0.0).transient_n
    assert 1.5 * force / (math.pi * BALL.patch_m(force) ** 2) == pytest.approx(2e5)
    flat = limits_of(dataclasses.replace(ARM, deepest_m=0.001), REGION, 0.3, 0.0)
    assert flat.transient_n == pytest.approx(STIFFNESS * 0.001**1.5)


def test_what_no_reaction_saves_and_what_needs_none():
    assert limits_of(ARM, REGION, 5.0, 0.006).reaction_s == 0.0
    assert math.isinf(limits_of(ARM, REGION, 0.01, 0.006).reaction_s)
    driven = limits_of(dataclasses.replace(ARM, push_n=200.0), REGION, 0.1, 0.2)
    assert isinstance(driven.clamped_m_s, NoSolution)
    assert driven.speed_m_s == 0.0


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "tables .*region"),
        (TABLE + "more = 1\n", "more"),
        (TABLE.replace("mass_kg = 2.0\n", ""), "mass_kg is missing"),
        (TABLE.replace("120.0", "nan"), "transient_n is nan"),
        (TABLE.replace("120.0", "1e300"), "transient_n is 1e\\+300"),
        (101 * TABLE, "at most 100"),
    ],
)
def test_a_table_that_cannot_be_is_refused(text, said, tmp_path):
    path = tmp_path / "regions.toml"
    path.write_text(text)
    with pytest.raises(CoverError, match=said) as error:
        load_regions(path)
    assert "\n" not in str(error.value)


def test_design_and_arm_take_the_table(tmp_path, capsys):
    (tmp_path / "regions.toml").write_text(TABLE)
    task = (contactfpga.examples() / "paper-first-design.toml").read_text()
    path = tmp_path / "task.toml"
    path.write_text(task.replace("[limits]\n", '[limits]\nregions = "regions.toml"\n'))
    main(["cover", "design", str(path), "--json"])
    first = json.loads(capsys.readouterr().out)["candidates"][0]
    (row,) = first["regions"]
    check = next(one for one in first["checks"] if one["name"] == "forearm, made up")
    assert check["limit"] == row["speed_m_s"]
    assert check["holds"] == (row["speed_m_s"] >= 0.4)
    ball = Ball(0.019, first["modulus_pa"] / 0.75)
    spring = 4 / 3 * ball.modulus_pa * math.sqrt(0.019)
    force = row["transient_n"]
    stored = 0.4 * force * (force / spring) ** (2 / 3) + force**2 / 8e4
    arm = (0.6 / 12 * (3 * 0.038**2 + 0.2**2) + 0.6 * 0.15**2) / 0.04
    assert row["transient_m_s"] == pytest.approx(math.sqrt(2 * stored * (1 / arm + 0.5)), rel=1e-6)
    main(["cover", "design", str(path)])
    assert "forearm, made up" in capsys.readouterr().out
    assert main(["study", "arm", "--regions", str(tmp_path / "regions.toml"), "--latency-us", "800", "--json"]) == 0
    (soon,) = json.loads(capsys.readouterr().out)
    main(["study", "arm", "--regions", str(tmp_path / "regions.toml"), "--json"])
    (late,) = json.loads(capsys.readouterr().out)
    assert soon["clamped_m_s"] > late["clamped_m_s"]
    assert soon["transient_m_s"] == late["transient_m_s"]
