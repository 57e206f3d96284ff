"""A robot in MuJoCo that wears sheets: which switch a ball closes, with what force, and what the driver says of it."""

import contextlib
import runpy
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco")

import mujoco
from mujoco_rig import pressed, robot

import contactfpga
from contactfpga.mujoco import Sheets, wear
from contactfpga.robot.body import Body, BodyError

CYLINDER = 'surface = "cylinder"\nradius_mm = 40.0\n'
CLOSED = 'rows = 16\ncolumns = 16\nclosed = true\npitch_y_mm = 10.0\nsurface = "cylinder"\nradius_mm = 45.0\n'
TURNED = "point_m = [0.1, -0.2, 0.3]\nrpy_rad = [0.4, -0.7, 2.0]\n"
SHAPES = {
    "plane": ("", TURNED, (3, 12)),
    "mirrored": ("", TURNED + "mirrored = true\n", (3, 12)),
    "cylinder": (CYLINDER, TURNED, (9, 14)),
    "closed": (CLOSED, TURNED, (5, 15)),
    "cone": ("", TURNED + "surface = {radius_mm = 60.0, slope = 0.1}\n", (8, 4)),
}


def settled(sheets, seconds=0.05):
    while sheets.data.time < seconds:
        sheets.step()
    return sheets["link"]


@pytest.mark.parametrize("shape", SHAPES)
def test_a_ball_closes_the_switch_below_it_and_the_driver_says_where(shape, tmp_path):
    skin, link, (row, column) = SHAPES[shape]
    toml = robot(tmp_path, skin, link)
    plan = Body.load(toml).links["link"]
    x, y = column * plan.skin.pitch_x_mm, row * plan.skin.pitch_y_mm
    model, data = pressed(toml, [("link", x, y, 2.0)])
    with Sheets(model, data, toml, golden=True, radius_m=0.005) as sheets:
        worn = settled(sheets)
        assert np.unravel_index(worn.forces_n.argmax(), worn.forces_n.shape) == (row, column)
        (contact,) = sheets.snapshot().contacts("link")
    here, normal = (np.array(each) for each in plan.place(x, y))
    assert contact.point_m == pytest.approx(here, abs=2e-3)
    assert contact.normal == pytest.approx(normal, abs=0.05)


@pytest.mark.parametrize("shape", ["plane", "closed"])
def test_the_forces_on_all_switches_add_up_to_what_presses(shape, tmp_path):
    """The oracle is the motor behind the ball: where nothing moves any more, the contact carries its force. On the
    closed sheet the first one presses on the seam."""
    skin, link, _ = SHAPES[shape]
    toml = robot(tmp_path, skin, link)
    touches = [("link", 273.0 if shape == "closed" else 42.0, 77.0, 3.0), ("link", 96.0, 51.0, 4.5)]
    model, data = pressed(toml, touches)
    with Sheets(model, data, toml, golden=True, radius_m=0.01) as sheets:
        worn = settled(sheets, 0.2)
        assert [touch.push_n for touch in worn.touches] == pytest.approx([3.0, 4.5], rel=2e-3)
        assert worn.forces_n.sum() == pytest.approx(7.5, rel=0.01)
        assert len(sheets.snapshot().contacts("link")) == 2


def test_a_box_that_lies_flat_presses_at_each_of_its_corners(tmp_path):
    """On a plane that the model brings, on which MuJoCo finds several points for one thing that touches."""
    toml = robot(tmp_path, link="point_m = [-0.075, -0.075, 0.0]\n")
    model = mujoco.MjModel.from_xml_string(
        """<mujoco><worldbody><body name="link"><geom type="plane" size="1 1 1"/></body>
        <body pos="0.013 -0.02 0.0301"><freejoint/><geom type="box" size="0.03 0.03 0.03" mass="0.5"/></body>
        </worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    with Sheets(model, data, toml, golden=True, radius_m=0.005) as sheets:
        worn = settled(sheets, 0.3)
        assert len(worn.touches) == 4
        assert worn.forces_n.sum() == pytest.approx(0.5 * 9.81, rel=0.01)
        assert sum(touch.x_mm for touch in worn.touches) / 4 == pytest.approx(75 + 13, abs=0.5)
        assert len(sheets.snapshot().contacts("link")) == 4


def test_beside_the_sheet_and_from_behind_nothing_is_pressed(tmp_path):
    toml = robot(tmp_path)
    for x, behind in ((-14.0, False), (75.0, True)):
        model, data = pressed(toml, [("link", x, 75.0, 2.0)])
        if behind:
            model.body_pos[-1] *= [1, 1, -1]
            model.body_pos[-1][2] -= 0.01
            model.body_quat[-1] = [1, 0, 0, 0]
        with Sheets(model, data, toml, golden=True) as sheets:
            worn = settled(sheets)
            assert not worn.forces_n.any()
            assert [touch.x_mm for touch in worn.touches] == [None]


def course(toml, golden=False, seed=0, milliseconds=60):
    """Bytes that came, and the frames, while two balls press and one of them lets go."""
    model, data = pressed(toml, [("link", 40.0, 70.0, 3.0), ("link", 100.0, 52.0, 0.7)])
    data_bytes, frames = b"", []

    def noted(data):
        nonlocal data_bytes
        data_bytes += data
        return data

    with Sheets(model, data, toml, golden=golden, seed=seed) as sheets:
        sheets["link"].line = noted
        while data.time < 1e-3 * milliseconds:
            data.ctrl[0] = 3.0 if data.time < 0.03 else -1.0
            sheets.step()
            zones = sheets.snapshot().links["link"].zones
            rested = zones is not None and sorted((one.area_cells, one.x_mm, one.y_mm) for one in zones)
            frames.append((sheets["link"].closed.sum(), rested))
    return data_bytes, frames


def test_the_same_seed_gives_the_same_bytes_and_another_one_others(tmp_path):
    toml = robot(tmp_path)
    skin = tmp_path / "skin.toml"
    skin.write_text(skin.read_text() + "spread = 0.3\n")
    first, again, other = (course(toml, seed=seed)[0] for seed in (0, 0, 1))
    assert len(first) > 1000
    assert first == again
    assert first != other


def test_golden_zones_are_those_of_the_gateware(tmp_path):
    """Where the switches have rested for 3 ms, so that all frames before are with the host."""
    toml = robot(tmp_path)
    found = [course(toml, golden)[1] for golden in (False, True)]
    rests = [
        index for index in range(6, len(found[0])) if len({cells for cells, _ in found[0][index - 6 : index + 1]}) == 1
    ]
    assert len(rests) > 50
    assert {len(found[0][index][1]) for index in rests} == {1, 2}
    for index in rests:
        assert found[0][index] == found[1][index]


def test_a_link_that_the_model_lacks_is_refused_by_name(tmp_path):
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    with pytest.raises(BodyError, match=r"frame is 'link'; the model has no such body"):
        Sheets(model, mujoco.MjData(model), robot(tmp_path))


def environment(*pressed_robot):
    """The example's, which the caller closes."""
    names = runpy.run_path(str(Path(__file__).parents[2] / "examples/arm/tactile_environment.py"))
    env = names["TactileEnvironment"](*pressed(*pressed_robot), pressed_robot[0], "link")
    return contextlib.closing(env.sheets), env


def test_the_wrapper_feels_begins_each_episode_untouched_and_says_that_a_board_is_dead(tmp_path):
    closing, env = environment(robot(tmp_path), [("link", 40.0, 70.0, 3.0)])
    with closing as sheets:
        for _ in range(2):
            assert not env.reset()[-12:].any()
            assert not sheets["link"].contact
            for _ in range(100):
                seen = env.step([3.0])
            assert seen[-12:-10] == pytest.approx([40.0, 70.0], abs=2)
            assert sheets["link"].contact
        sheets["link"].dead = True
        with pytest.raises(contactfpga.NoData, match="no data of link"):
            env.reset()


def test_the_wrapper_knows_a_grip_all_round_by_its_x(tmp_path):
    places_mm = np.arange(16) * 2 * np.pi * 45 / 16
    closing, env = environment(robot(tmp_path, CLOSED), [("link", x, 70.0, 3.0) for x in places_mm.tolist()])
    with closing:
        for _ in range(100):
            seen = env.step([3.0] * 16)
    assert seen[-12:].tolist() == [-1.0, 70.0, 16.0, *[0.0] * 9]


SOFT = """<mujoco><worldbody><body name="link"/><body name="soft" pos="0.075 0.075 0.01"><flexcomp name="soft" dim="3"
type="grid" count="3 3 2" spacing="0.02 0.02 0.02" mass="0.5"><edge equality="true"/></flexcomp></body>
</worldbody></mujoco>"""


@pytest.mark.parametrize("foam", [False, True])
def test_a_soft_body_presses_and_is_refused_under_foam(foam, tmp_path):
    """Its contacts have no geom, whose number is -1; the foam's reaction would push the body of the last one."""
    toml, spec = robot(tmp_path), mujoco.MjSpec.from_string(SOFT)
    wear(spec, toml)
    model = spec.compile()
    refused = pytest.raises(BodyError, match="a soft body touches a sheet") if foam else contextlib.nullcontext()
    with Sheets(model, mujoco.MjData(model), toml, golden=True, foam=foam) as sheets, refused:
        assert settled(sheets).touches
