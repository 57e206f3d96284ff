"""The study of supports on JVRC-1: the bed, the way to the driver, and the plant of the brace. No other test kills foam
that is pressed beside a thing or too deep, a polygon that is laid flat on the wrong side of a link, a wrench that is
judged by the wrong cells, a table that pushes without friction or sideways, a push that nothing resists, and an arm
whose limits turn its force."""

import dataclasses
import math

import numpy as np
import pytest

pytest.importorskip("mujoco")
pytest.importorskip("jvrc_description")

from contactfpga.robot.body.kinematics import Pose
from contactfpga_sim.lab.support import brace, compute, robot
from contactfpga_sim.lab.support.bed import PITCH_MM, Thing
from contactfpga_sim.lab.support.tables import braces_table, leans_table


@pytest.mark.parametrize("half", [(0.02, 0.03, 0.01), 0.012])
def test_the_depth_in_the_foam_is_that_of_points_along_its_columns(rng, half):
    draw, most = np.random.default_rng(rng.getrandbits(32)), 0.002
    pose = Pose.of(tuple(draw.uniform(-0.01, 0.01, 3)), tuple(draw.uniform(-3, 3, 3)))
    points, normals = draw.uniform(-0.03, 0.03, (3000, 3)), draw.standard_normal((3000, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    found = Thing(half, pose.rotation, pose.point_m).depth_m(points, normals, most)
    along = (np.arange(200) + 0.5) / 200 * most
    own = (points[:, None] - along[:, None] * normals[:, None] - pose.point_m) @ pose.rotation
    inside = (np.abs(own) <= half).all(axis=2) if isinstance(half, tuple) else half >= np.hypot(*own.T[1:]).T
    deepest = np.where(inside.any(axis=1), along[199 - inside[:, ::-1].argmax(axis=1)], 0.0)
    assert np.abs(found - deepest).max() <= most / 200
    assert ((found > 0) & (found < most)).sum() > 20


@pytest.fixture(scope="module")
def leant(tmp_path_factory):
    """Two poses of the forearm, twice."""
    found = []
    for turn in "ab":
        stand = robot.Stand(tmp_path_factory.mktemp(turn), ["forearm"], 3)
        with stand.sheets:
            found.append([one for number in (3, 4) for one in stand.lean(number)])
    return found


def test_a_sample_of_the_leans_comes_by_gateware_and_driver_and_comes_again(leant):
    once, again = leant
    assert once == again
    zones = [zone for one in once for zone in one.outcome.zones]
    assert zones
    assert all(zone.center for zone in zones)
    assert all(0.2 < zone.area <= zone.rectangle * 1.001 for zone in zones)
    hits = [hit for one in once for hit in (*one.alone, *one.among)]
    assert len(hits) == 6 * len(zones)
    assert np.mean(hits) > 0.7
    assert "forearm" in str(leans_table(once))


def test_a_polygon_that_is_a_pitch_too_small_is_seen():
    found = compute.drawn("6.4 mm, 0.4 N", "model", "bar", 0)
    small = [
        dataclasses.replace(
            one,
            corners_m=(middle := one.corners_m.mean(axis=0))
            + (one.corners_m - middle) * (1 - 1e-3 * PITCH_MM / np.linalg.norm(one.corners_m - middle, axis=1).min()),
        )
        for one in found.supports
    ]
    assert compute.outcome(found, PITCH_MM).held == [True]
    assert compute.outcome(found._replace(supports=small), PITCH_MM).held == [False]


def test_the_table_carries_what_the_arm_presses_and_friction_holds_it():
    """At rest the table pushes up by what the ankles cannot hold, and at most friction aside."""
    braced = brace.Braced("polygon", 1)
    assert braced.stands(0.0, 0.0, (0.0, 0.2))
    force = braced.link.xfrc_applied[:3]
    weight = 9.81 * braced.model.body_mass.sum()
    assert 20 < force[2] < weight
    assert math.hypot(*force[:2]) <= brace.FRICTION * force[2] * 1.05
    assert np.abs(braced.data.qvel[:2]).max() < 0.05


def test_without_its_arm_the_robot_falls_and_a_huge_push_fells_it(monkeypatch):
    assert not brace.Braced("polygon", 1).stands(1000.0, 0.0, (0.0, 0.2))
    monkeypatch.setattr(brace, "ARM_NM", 1.0)
    assert not brace.Braced("polygon", 1).stands(0.0, 0.0, (0.0, 0.2))


@pytest.mark.parametrize("way", brace.WAYS)
def test_forces_act_where_the_way_says(way):
    """All lie on the forearm; the skin's on what it feels, and the rectangle holds the polygon."""
    braced = brace.Braced(way, 1)
    braced.cells[:] = False
    braced.cells[8:12, 15:18] = True
    braced.cells[8, 15] = braced.cells[11, 17] = False
    flat = (braced.places() - braced.plan.pose.point_m) @ braced.plan.pose.rotation
    assert np.hypot(flat[:, 0], flat[:, 1]) == pytest.approx(0.045, abs=1e-6)
    middle = np.array([16.0, 9.5]) * PITCH_MM
    away = 1e3 * np.stack([0.045 * np.unwrap(np.arctan2(flat[:, 1], flat[:, 0])), flat[:, 2]], axis=1) - middle
    reach = np.abs(away).max(axis=0)
    grown = 1e3 * np.array(braced.plan.contact_surfaces.overhang_m) + PITCH_MM / 2
    if way == "without skin":
        assert reach[1] > 80
    elif way == "barycenter":
        assert reach == pytest.approx([0, 0], abs=1e-6)
    else:
        assert reach == pytest.approx(np.array([1, 1.5]) * PITCH_MM + grown, abs=1e-6)
        corners = (np.abs(np.abs(away) - reach) < 1e-6).all(axis=1)
        assert corners.sum() == (4 if way == "rectangle" else 2)
    braced.cells[:] = False
    assert len(braced.places()) == (4 if way == "without skin" else 0)


def test_the_table_of_braces_has_the_worst_way_first_and_compares_seeds():
    """Of nine pushes the first three are away from the arm."""
    text = braces_table({"without skin": [50.0] * 9, "polygon": [-1.0, 30.0, 30.0, *[80.0] * 5, 50.0]})
    assert text.index("| without skin | 50 ") < text.index("| polygon | 80 ")
    cells = text[text.index("| polygon") :].split(" | ")[1:]
    assert [cell.split(" (")[0] for cell in cells[:5]] == ["80", "30", "0, 3 of 3", "80", "5, 0 of 6"]
    assert cells[5].startswith("1 of 9")


def test_beyond_the_arms_torques_its_forces_shrink_together(monkeypatch):
    """Without limits the same forces are asked for, and without a contact none."""
    braced = brace.Braced("polygon", 1)
    braced.data.qvel[:2] = 1.5, 0.5
    cut = braced.control()[2:]
    monkeypatch.setattr(brace, "ARM_NM", 1e6)
    asked = braced.control()[2:]
    braced.cells[:] = False
    monkeypatch.setattr(brace, "SEARCH_N", 0.0)
    rest = braced.control()[2:]
    shares = (cut - rest) / (asked - rest)
    assert np.abs(cut).max() == pytest.approx(100)
    assert shares == pytest.approx(np.full(4, shares[0]))
    assert 0.05 < shares[0] < 0.95
