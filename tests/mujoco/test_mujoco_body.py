"""JVRC-1 in MuJoCo with sheets on its links: random touches against MuJoCo's own contacts."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

pytest.importorskip("mujoco")
pytest.importorskip("jvrc_description")

import mujoco
from mujoco_rig import TILES, compiled, random_touches

import contactfpga
from contactfpga.mujoco import Sheets, wear
from contactfpga.robot.body import Body

EXAMPLES = contactfpga.examples()
SIDES = {"forearm.toml": 0.0098, "chest.toml": 0.0098}


@pytest.fixture
def robot(tmp_path):
    """examples/robot.toml, its sheets under tiles."""
    for name, side in SIDES.items():
        (tmp_path / name).write_text((EXAMPLES / name).read_text() + TILES.format(side=side))
    (tmp_path / "robot.toml").write_text((EXAMPLES / "robot.toml").read_text())
    return tmp_path / "robot.toml"


def with_units(robot):
    """Three pressure units under the chest, on a ring of 75 mm around its middle, and no other link."""
    text = robot.read_text()
    head, *links = text.split("[[links]]")
    chest = next(link for link in links if '"chest"' in link)
    robot.write_text(f'{head}[[links]]{chest}\nunits = "units.toml"\n')
    skin = robot.parent / "chest.toml"
    units = "units = 3\nunit_sums = [[1, 1, 1]]\nbaud = 6000000\n"
    skin.write_text(units + skin.read_text())
    (robot.parent / "units.toml").write_text("")
    link = Body.load(_without_units(robot)).links["chest"]
    tables = ['frame = "chest"\n']
    for angle in np.radians([90, 210, 330]):
        point, normal = link.place(75 + 75 * float(np.cos(angle)), 75 + 75 * float(np.sin(angle)))
        tables.append(
            f"[[unit]]\npoint_m = {list(point)}\naxis = {list(normal)}\n"
            "gain_n = 0.02\nzero = 1000\nsigma_n = 0.05\nrange = [0, 4095]\n"
        )
    (robot.parent / "units.toml").write_text("".join(tables))
    return robot


def _without_units(robot):
    bare = robot.parent / "bare.toml"
    bare.write_text(robot.read_text().replace('units = "units.toml"\n', ""))
    return bare


def standing(robot, touches):
    """JVRC-1 fixed in space, its joints turned by some angles and held, and balls that press."""
    body = Body.load(robot)
    tree = ET.parse(body.urdf).getroot()
    for link in tree.iter("link"):
        for part in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(part)
    ET.SubElement(ET.SubElement(tree, "mujoco"), "compiler", fusestatic="false", discardvisual="true")
    spec = mujoco.MjSpec.from_string(ET.tostring(tree, encoding="unicode"))
    spec.option.timestep, spec.option.gravity = 5e-4, [0, 0, 0]
    wear(spec, robot)
    bare = spec.compile()
    data = mujoco.MjData(bare)
    data.qpos[:] = np.random.default_rng(3).uniform(-0.3, 0.3, bare.nq)
    mujoco.mj_kinematics(bare, data)

    def pose(plan):
        return data.body(plan.frame).xpos, data.body(plan.frame).xmat.reshape(3, 3)

    model, found = compiled(spec, body.links, touches, pose=pose)
    found.qpos[: bare.nq] = data.qpos
    model.dof_damping[: bare.nv] = 1e4
    return model, found


def test_frames_are_those_of_pinocchio(robot):
    """Each link of JVRC-1 that MuJoCo has, at five random postures."""
    pinocchio = pytest.importorskip("pinocchio")
    body = Body.load(robot)
    other = pinocchio.buildModelFromUrdf(str(body.urdf))
    theirs, rng, compared = other.createData(), np.random.default_rng(5), 0
    model, data = standing(robot, [])
    for _ in range(5):
        data.qpos[:] = rng.uniform(-1, 1, model.nq)
        mujoco.mj_kinematics(model, data)
        q = np.zeros(other.nq)
        for joint in range(model.njnt):
            q[other.joints[other.getJointId(model.joint(joint).name)].idx_q] = data.qpos[model.jnt_qposadr[joint]]
        pinocchio.framesForwardKinematics(other, theirs, q)
        for number in range(1, model.nbody):
            frame = theirs.oMf[other.getFrameId(model.body(number).name)]
            assert data.xpos[number] == pytest.approx(frame.translation, abs=1e-9)
            assert data.xmat[number].reshape(3, 3) == pytest.approx(frame.rotation, abs=1e-9)
            compared += 1
    assert compared == 5 * (model.nbody - 1) > 200


def heard(robot, touches, golden, seconds=0.06):
    """The contacts of a snapshot in the base frame, and those of MuJoCo: point, normal out of the link, force in N."""
    model, data = standing(robot, touches)
    with Sheets(model, data, robot, golden=golden, radius_m=0.005) as sheets:
        while data.time < seconds:
            sheets.step()
        if golden:
            sheets.settle()
        contacts = sheets.snapshot().contacts()
        true = []
        for number in range(data.ncon):
            force = np.zeros(6)
            mujoco.mj_contactForce(model, data, number, force)
            contact = data.contact[number]
            ball_first = "ball" in model.body(model.geom_bodyid[contact.geom1]).name
            true.append((contact.pos.copy(), contact.frame[:3] * (-1 if ball_first else 1), force[0]))
        return contacts, true


def paired(contacts, true):
    """Each contact with MuJoCo's nearest."""
    return [(one, min(true, key=lambda other: np.linalg.norm(other[0] - one.point_m))) for one in contacts]


def felt(robot, seed, poses):
    """Errors in mm, standard deviations that are stated, and cosines between normals, of two touches on each of four
    links, in the robot's base frame through its joints: as many contacts as MuJoCo has, each at another place."""
    rng, links = np.random.default_rng(seed), Body.load(robot).links
    found = []
    for _ in range(poses):
        touches = [one for name, plan in links.items() for one in random_touches(rng, 2, name, plan.skin.pitch_x_mm)]
        contacts, true = heard(robot, touches, golden=True)
        pairs = paired(contacts, true)
        assert len(contacts) == len(true) == len({id(other) for _, other in pairs}) == 8
        for one, other in pairs:
            stated = 1e3 * np.sqrt(np.trace(one.covariance_m2))
            found.append((1e3 * np.linalg.norm(other[0] - one.point_m), stated, np.dot(one.normal, other[1])))
    return np.transpose(found)


def test_each_touch_of_four_links_is_where_mujoco_has_it(robot):
    """The place as its covariance states, and never beyond the corner of a cell; the normal."""
    errors, stated, normals = felt(robot, 0, 2)
    assert 0.5 < np.linalg.norm(errors) / np.linalg.norm(stated) < 1.1
    assert errors.max() < np.hypot(10.0, 17.7) / 2
    assert normals.min() > 0.98


@pytest.mark.campaign
@pytest.mark.timeout(3600)
def test_the_places_of_480_touches_are_as_the_page_says(robot):
    """docs/collisions.md: 60 poses."""
    errors, stated, normals = felt(robot, 100, 60)
    rms = [float(np.sqrt(np.mean(each**2))) for each in (errors, stated)]
    turned = np.degrees(np.arccos(np.minimum(1.0, normals)))
    found = [np.mean(errors), np.quantile(errors, 0.95), errors.max(), *rms, turned.max()]
    assert found == pytest.approx([3.6, 5.7, 6.7, 3.7, 5.1, 8.3], abs=0.051)


def test_the_forces_of_units_are_mujocos(robot):
    """One push, and two, on the chest: each within 10 %, by what the units' noise and the places leave open."""
    rng, skin = np.random.default_rng(1), Body.load(with_units(robot)).links["chest"].skin
    shares = []
    for count in (1, 2):
        contacts, true = heard(robot, random_touches(rng, count, "chest", skin.pitch_x_mm), golden=False)
        assert len(contacts) == len(true) == count
        shares += [one.normal_n / other[2] - 1 for one, other in paired(contacts, true)]
    assert np.abs(shares).max() < 0.1
