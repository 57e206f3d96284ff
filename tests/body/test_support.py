"""Contact surfaces, centers of pressure, wrenches and margins, against points, directions and forces one by one. No
other test kills a polygon that contact sticks out of or that is grown by more than contact can, one that is cut at the
seam, a wrench that is not moved with its frame, a margin to the wrong edge, and a silent zone of two contacts."""

import dataclasses
import math

import numpy as np
import pytest
from bumpers import exerted, flat

from contactfpga import haptics, surfaces
from contactfpga.body import BodyError, ContactSurfaces, NoLinkData, margin_m
from contactfpga.cover import Cap, Cover, Switch
from contactfpga.robot.body.body import Body
from contactfpga.robot.body.kinematics import Pose
from contactfpga.robot.body.snapshot import Snapshot
from contactfpga.robot.body.state import LinkState
from contactfpga.robot.body.support import FIRM_PA, overhang_m
from contactfpga.skin import Skin
from contactfpga.wire.protocol import Frame, no_records
from contactfpga.zones.zone import Zones

PER = 12
"""Points per pitch along each axis: contact is drawn on them, so that sums over them are exact areas."""
ROWS, COLUMNS = 9, 11


def seen(skin, cells):
    """The frame of these cells, from a board that sends them or, of one zone, its extent."""
    cells = np.asarray(cells, bool)
    if skin.report == "cells":
        return Zones(Frame(0, 0, frozenset(), 0, 0, 0, int(cells.sum()), no_records(skin.sheet), cells), skin.sheet, 0)
    y, x = np.nonzero(cells)
    record, box = [[len(x), x.sum(), y.sum(), *[0] * skin.closed]], [[x.min(), x.max(), y.min(), y.max()]]
    frame = Frame(0, 0, frozenset(), 0, 0, 1, len(x), np.array(record), None, extents=np.array(box))
    return Zones(frame, skin.sheet, 0)


def tiles(force_n, pitch_m=4e-3):
    return Cover("foam", 2e-3, Switch(force_n, travel_m=0.0), cap=Cap(0.9 * pitch_m), cut=True)


def contact(rng, closed):
    """(ROWS * PER, COLUMNS * PER) bool: a square of one pitch on a random way over the sheet."""
    found = np.zeros((ROWS * PER, COLUMNS * PER), bool)
    y, x = rng.randrange((ROWS - 1) * PER), rng.randrange((COLUMNS - 1) * PER)
    for _ in range(rng.randrange(1, 6)):
        right, down = rng.choice([(1, 0), (0, 1), (1, 1), (-1, 1), (2, 1)])
        for _ in range(rng.randrange(1, 2 * PER)):
            found[y : y + PER, np.arange(x, x + PER) % found.shape[1]] = True
            x = (x + right) % found.shape[1] if closed else min(max(x + right, 0), (COLUMNS - 1) * PER)
            y = min(max(y + down, 0), (ROWS - 1) * PER)
    return found


def beyond(corners, points):
    """How far points lie beyond a convex polygon, along the direction of 720 in which they do so most."""
    angles = np.linspace(0, 2 * math.pi, 720, endpoint=False)
    ways = np.stack([np.cos(angles), np.sin(angles)])
    return ((points @ ways) - (corners @ ways).max(axis=0)).max(axis=1)


@pytest.mark.parametrize("report", ["cells", "moments"])
@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("connectivity", [4, 8])
def test_firm_contact_is_held_and_the_polygon_grows_by_no_more_than_it_may_stick_out(rng, report, closed, connectivity):
    pitch_x, pitch_y = (2 * math.pi * 20 / COLUMNS, 4.0) if closed else (5.0, 4.0)
    shape = {"surface": "cylinder", "radius_mm": 20.0, "closed": True} if closed else {"pitch_x_mm": pitch_x}
    skin = Skin(rows=ROWS, columns=COLUMNS, pitch_y_mm=pitch_y, report=report, extent=report != "cells", **shape)
    point_m2, most = 1e-6 * pitch_x * pitch_y / PER**2, 0.0
    place = [pitch * ((np.arange(n * PER) + 0.5) / PER - 0.5) for n, pitch in ((ROWS, pitch_y), (COLUMNS, pitch_x))]
    for _ in range(60):
        there = contact(rng, closed)
        force = rng.choice([0.06, 0.5, 1.0]) * FIRM_PA * 1e-6 * pitch_x * pitch_y / 4  # of which 1 is the limit
        forces = FIRM_PA * point_m2 * there.reshape(ROWS, PER, COLUMNS, PER).sum(axis=(1, 3))
        finder = ContactSurfaces(skin.replace(connectivity=connectivity).sheet, tiles(force))
        if report != "cells" and closed and (forces >= force * (1 - 1e-9)).any(axis=0)[[0, -1]].all():
            continue  # its extent would have to be counted over the seam
        (support,) = finder.supports(seen(skin, forces >= force * (1 - 1e-9)))
        corners = 1e3 * support.corners_m[:, :2]
        if closed:
            around = np.unwrap(np.arctan2(corners[:, 1], corners[:, 0])) * 20
            corners = np.stack([around, 1e3 * support.corners_m[:, 2]], axis=1)
        y, x = np.nonzero(there)
        points = np.stack([place[1][x], place[0][y]], axis=1)
        turns = 2 * math.pi * 20 * np.arange(-2, 3) if closed else [0]
        out = np.min([beyond(corners, points + (turn, 0)) for turn in turns], axis=0)
        assert out.max() < 1e-6
        if not closed and force > 0.9 * FIRM_PA * 1e-6 * pitch_x * pitch_y / 4:
            most = max(most, out.max())
    assert closed or report != "cells" or most > -0.2 * pitch_x  # hence a polygon grown by less does not hold it


def test_overhang_is_half_a_pitch_on_a_bare_sheet_and_follows_force_and_pressure_on_tiles():
    assert overhang_m(None, 4e-3, 6e-3) == (2e-3, 3e-3)
    assert overhang_m(tiles(0.1), 4e-3, 5e-3) == pytest.approx((2 * 0.1 / FIRM_PA / 5e-3, 2 * 0.1 / FIRM_PA / 4e-3))
    whole = Cover("foam", 2e-3, Switch(0.4), cap=Cap(5.8e-3))
    assert overhang_m(tiles(0.4), 6.4e-3, 6.4e-3)[0] < overhang_m(whole, 6.4e-3, 6.4e-3)[0] < 3.2e-3
    with pytest.raises(BodyError, match=r"10 kPa on a quarter of a cell may not close it"):
        overhang_m(tiles(0.1), 4e-3, 4e-3, 10e3)


def test_what_is_doubtful_is_said():
    skin = Skin(rows=12, columns=12, report="cells")
    y, x = np.mgrid[:12, :12]
    finder = ContactSurfaces(skin.sheet)

    def doubts(cells):
        return [one.doubts for one in finder.supports(seen(skin, cells))]

    assert doubts((y - 5) ** 2 + (x - 5) ** 2 < 10) == [()]
    dumbbell = (np.abs(y - 5) < 3) & ((np.abs(x - 2.5) < 1) | (np.abs(x - 8.5) < 1)) | ((y == 5) & (x > 2) & (x < 8))
    assert doubts(dumbbell) == [("16 of 40 cells in it are not pressed: it may be two contacts",)]
    assert doubts((y == 0) & (x == 4)) == [("it ends at the edge of the sheet: the contact may go on beyond",)]
    near = ((x == 3) | (x == 5)) & (y > 3) & (y < 7)
    assert doubts(near) == [(f"zone {n} is less than a pitch away: both may be one contact",) for n in (1, 0)]
    assert doubts(((x == 3) | (x == 7)) & (y > 3) & (y < 7)) == [(), ()]


@pytest.mark.parametrize("sigma_m", [1e-2, 1e-5])
def test_center_and_wrench_lie_in_region_and_interval_as_often_as_stated(rng, sigma_m):
    """30 N press straight down within two cells, on units with noise and on a link that is turned. As the forces'
    place has this standard deviation, they fit nearly always, or nearly never."""
    skin, draw, hits, alarms = Skin(report="cells"), np.random.default_rng(rng.getrandbits(32)), [], []
    pose, force = Pose.of((0.3, -0.2, 0.5), (0.4, -0.8, 1.1)), np.array([0, 0, -30.0])
    cells = np.zeros((16, 16), bool)
    cells[5, 5:7] = True
    zones, finder, units = seen(skin, cells), ContactSurfaces(skin.sheet), flat(sigma_n=0.3)
    known = haptics.Touch((0.055, 0.05, 0.0), (0.0, 0.0, 1.0), 0.5, sigma_m)
    for noise in draw.multivariate_normal(np.zeros(6), units.noise.covariance, 1500):
        truth = np.append(draw.uniform((0.046, 0.046), (0.064, 0.054)), 0)
        six = np.concatenate([force, np.cross(truth, force)]) + noise
        forces = haptics.contacts(haptics.Wrench(tuple(six[:3]), tuple(six[3:]), units.noise), [known])
        alarms.append(forces.alarm)
        (support,) = finder.supports(zones, forces, haptics.Plane())
        assert beyond(1e3 * support.corners_m[:, :2], 1e3 * support.region_m[:, :2]).max() < 1e-6
        low, high = support.moved(pose, "base").wrench_interval.T
        true = np.concatenate([pose.turn(force), np.cross(pose.apply(truth), pose.turn(force))])
        hits.append([beyond(support.region_m[:, :2], truth[None, :2])[0] < 1e-9, *(low <= true) & (true <= high)])
    assert (np.mean(alarms) > 0.5) == (sigma_m < 1e-3)
    assert np.abs(np.mean(hits, axis=0) - 0.95).max() < 4 * math.sqrt(0.95 * 0.05 / len(hits))


def test_of_a_unit_at_its_limit_and_of_a_center_elsewhere_nothing_is_made():
    skin, cells, units = Skin(report="cells"), np.zeros((16, 16), bool), flat(sigma_n=0.05)
    cells[3:5, 3:6] = True
    there = haptics.Touch((0.12, 0.12, 0.0), (0.0, 0.0, 1.0))
    for limits, why in ({"saturated": (2,)}, "limit"), ({"lifted": (1,)}, "limit"), ({}, "elsewhere"):
        wrench = dataclasses.replace(exerted([there.point_m], [(0, 0, -20)], units.noise), **limits)
        forces = haptics.contacts(wrench, [there])
        (support,) = ContactSurfaces(skin.sheet).supports(seen(skin, cells), forces, haptics.Plane())
        assert why in " ".join(support.doubts)
        assert (support.force_n is None) == (support.wrench_interval is None) == bool(limits)
        assert support.center_m == pytest.approx([0.04, 0.035, 0])
        assert np.array_equal(support.region_m, support.corners_m)


def test_the_wrench_interval_of_one_of_several_is_that_of_all_forces_in_the_cone(rng):
    skin, cells = Skin(report="cells"), np.zeros((16, 16), bool)
    cells[3:5, 3:6] = cells[9:12, 10] = True
    touches = [haptics.Touch((x, y, 0.0), (0.0, 0.0, 1.0), 0.5, 0.01) for x, y in ((0.04, 0.035), (0.1, 0.1))]
    units = flat(sigma_n=0.05)
    forces = haptics.contacts(
        exerted([one.point_m for one in touches], [(0, 0, -20), (0, 0, -9)], units.noise), touches
    )
    draw, pose = np.random.default_rng(rng.getrandbits(32)), Pose.of((0.1, 0.2, 0.3), (1.0, 0.5, -0.3))
    support = ContactSurfaces(skin.sheet, pose=pose).supports(seen(skin, cells), forces)[0]
    low, high = support.wrench_interval.T
    least, most = support.felt.interval_n
    corners = support.region_m
    weights = draw.dirichlet(np.full(len(corners), 0.2), 20_000)
    angle, push = draw.uniform(0, 2 * math.pi, 20_000), draw.choice([least, most], 20_000)
    force = pose.turn(np.stack([0.5 * push * np.cos(angle), 0.5 * push * np.sin(angle), -push], axis=1))
    six = np.concatenate([force, np.cross(weights @ corners, force)], axis=1)
    assert (low <= six.min(axis=0) + 1e-9).all()
    assert (six.max(axis=0) <= high + 1e-9).all()
    assert (six.max(axis=0) - six.min(axis=0) > 0.8 * (high - low)).all()


def test_the_margin_is_that_of_some_hull_that_touches_each_cell(rng):
    skin, draw = Skin(report="cells"), np.random.default_rng(rng.getrandbits(32))
    cells = draw.random((16, 16)) < 0.2
    supports = ContactSurfaces(skin.sheet, pose=Pose.of((0, 0, 0), (0.3, 0, 0))).supports(seen(skin, cells))
    up, rows = np.array([0, 0, 2.0]), np.argwhere(cells)
    angles = np.linspace(0, 2 * math.pi, 3600)
    ways = np.stack([np.cos(angles), np.sin(angles)])
    for _ in range(20):
        point = draw.uniform((-0.02, -0.02, -1), (0.17, 0.17, 1))
        least, most = margin_m(supports, point, up)
        outer = np.concatenate([one.corners_m[:, :2] for one in supports])
        assert most == pytest.approx(((outer @ ways).max(axis=0) - point[:2] @ ways).min(), abs=1e-4)
        flat_m = 0.01 * (rows[:, ::-1] + draw.choice([-0.5, 0.5], rows.shape))
        touched = Pose.of((0, 0, 0), (0.3, 0, 0)).apply(np.pad(flat_m, ((0, 0), (0, 1))))[:, :2]
        assert least <= ((touched @ ways).max(axis=0) - point[:2] @ ways).min() + 1e-9
    with pytest.raises(BodyError, match="no support"):
        margin_m([], (0, 0, 0))


def test_a_link_has_its_supports_in_the_base_frame_and_without_data_none(robot):
    body = Body.load(robot)
    plan = body.links["chest"]
    skin = Skin(extent=True)
    object.__setattr__(plan, "skin", skin)
    cells = np.zeros((16, 16), bool)
    cells[2, 4] = True
    state = LinkState(seen(skin, cells), 0.0, "ok", frame_s=0.0)
    (support,) = Snapshot(body, 0.0, {"chest": state}, lambda _: {"elbow": 0.3}).supports()
    assert (support.link, support.frame, support.force_n) == ("chest", "base", None)
    assert support.center_m == pytest.approx([0.15 - 0.04, 0.02, 0])  # mirrored: columns count from the other end
    assert 1e6 * support.area_m2 == pytest.approx(400)
    late = LinkState(None, None, "silent")
    with pytest.raises(NoLinkData):
        Snapshot(body, 0.0, {"chest": late}).supports()
    with pytest.raises(BodyError, match=r"extent = true or report = .cells."):
        ContactSurfaces(Skin().sheet).supports(
            Zones(Frame(0, 0, frozenset(), 0, 0, 1, 1, np.array([[1, 4, 2]]), None), Skin().sheet, 0)
        )


def test_on_a_cylinder_points_lie_on_it_and_levels_weigh_the_center():
    skin = Skin(surface="cylinder", radius_mm=40.0, report="cells")
    cells = np.zeros((16, 16), bool)
    cells[4, 2:8] = True
    (support,) = ContactSurfaces(skin.sheet).supports(seen(skin, cells), pressures=np.where(np.arange(16) == 6, 1.0, 0))
    assert np.hypot(support.corners_m[:, 0], support.corners_m[:, 1]) == pytest.approx(0.04)
    assert np.linalg.norm(np.diff(support.corners_m, axis=0), axis=1).max() <= 0.0101
    assert support.center_m == pytest.approx(1e-3 * np.array(surfaces.CylinderSurface(40.0).place(60.0, 40.0)[0]))
