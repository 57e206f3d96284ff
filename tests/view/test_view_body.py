"""A robot in the view: links, sheets on them and the mouse's rays move with the joints."""

import threading
import time

import numpy as np
import pytest

pytest.importorskip("viser")

from contactfpga.driver import driver
from contactfpga.errors import PortNotFound
from contactfpga.robot.body import Body, BodyError
from contactfpga.tools.view import robot_stage
from contactfpga.tools.view import server as serving
from contactfpga.tools.view.bodies import BodySource

URDF = """<robot name="arm">
  <link name="base"/>
  <link name="arm">
    <visual><origin xyz="0.1 0 0" rpy="0 0 1.5707963"/>
      <geometry><mesh filename="arm.stl" scale="2 1 1"/></geometry></visual>
    <visual><geometry><box size="1 1 1"/></geometry></visual>
    <visual><geometry><mesh filename="not there.stl"/></geometry></visual>
  </link>
  <joint name="elbow" type="revolute"><parent link="base"/><child link="arm"/><origin xyz="0 0 1"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
</robot>"""
TETRAHEDRON = "solid a\n" + "".join(
    f"facet normal 0 0 0\nouter loop\n{''.join(f'vertex {x} {y} {z}' + chr(10) for x, y, z in face)}endloop\nendfacet\n"
    for face in (
        ((0, 0, 0), (1, 0, 0), (0, 1, 0)),
        ((0, 0, 0), (0, 1, 0), (0, 0, 1)),
        ((0, 0, 0), (0, 0, 1), (1, 0, 0)),
        ((1, 0, 0), (0, 0, 1), (0, 1, 0)),
    )
)
TABLE = """urdf = "arm.urdf"
[[links]]
name = "sheet"
frame = "arm"
skin = "skin.toml"
port = "sim://"
point_m = [0.0, 0.0, 0.5]
mirrored = {mirrored}
"""


@pytest.fixture(params=[False, True], ids=["as it is", "mirrored"])
def stage(request, tmp_path):
    (tmp_path / "arm.urdf").write_text(URDF)
    (tmp_path / "arm.stl").write_text(TETRAHEDRON + "endsolid a\n")
    (tmp_path / "skin.toml").write_text("rows = 8\ncolumns = 4\n")
    (tmp_path / "robot.toml").write_text(TABLE.format(mirrored=str(request.param).lower()))
    server, _ = serving.serve(port=0)
    yield robot_stage.RobotStage(server, Body.load(tmp_path / "robot.toml")), request.param
    serving.stop(server)


def test_meshes_are_found_with_their_places(tmp_path, stage):
    found, _ = robot_stage.visuals(tmp_path / "arm.urdf")
    assert (found.link, found.name, found.scale) == ("arm", "arm.stl", (2.0, 1.0, 1.0))
    np.testing.assert_allclose(found.pose.apply(np.array([1.0, 0.0, 0.0])), [0.1, 1.0, 0.0], atol=1e-6)


def test_the_mouse_meets_a_sheet_where_the_joints_put_it(stage):
    """By hand: the arm begins 1 m up; turned by 90 degrees about y its z is the base's x, and the sheet 0.5 m along."""
    moved, mirrored = stage
    moved.move({"elbow": np.pi / 2})
    sheet = moved.stages["sheet"]
    x_mm = 30.0 - 10.0 if mirrored else 10.0
    # Place (10, 30) mm of the unmirrored sheet: x runs along the base's -z, y along its y.
    onto = np.array([0.5, 0.03, 1.0 - 0.01])
    assert sheet._met(onto + [1.0, 0, 0], np.array([-1.0, 0.0, 0.0])) == pytest.approx((x_mm, 30.0))
    moved.move({"elbow": 0.0})
    assert sheet._met(onto + [1.0, 0, 0], np.array([-1.0, 0.0, 0.0])) is None
    assert sheet._met([0.01, 0.03, 9.0], np.array([0.0, 0.0, -1.0])) == pytest.approx((x_mm, 30.0))


def test_meshes_that_are_not_drawn_are_told(tmp_path, stage):
    (tmp_path / "broken.stl").write_text(TETRAHEDRON.replace("1", "nan") + "endsolid a\n")
    mesh = '<visual><geometry><mesh filename="{}.stl"/></geometry></visual>'
    meshes = "".join(map(mesh.format, ("broken", "package://nobodys_description/a", "b", "c", "c", "d")))
    world = '<joint name="f" type="floating"><parent link="w"/><child link="base"/></joint>'
    world += f'<link name="w">{mesh.format("arm")}</link></robot>'
    (tmp_path / "arm.urdf").write_text(URDF.replace("</link>", f"{meshes}</link>").replace("</robot>", world))
    shown = robot_stage.RobotStage(stage[0]._server, Body.load(tmp_path / "robot.toml"), node="/other")
    missing = "'not there.stl', 'package://nobodys_description/a.stl', 'b.stl', ..."
    rest = "1 unreadable: 'broken.stl'; lines between joints are drawn"
    assert shown.left_out() == f"5 {robot_stage.MISSING}: {missing}; {rest}"
    shown.move({"elbow": 0.0})
    assert np.isfinite(shown.points_m()).all()


@pytest.mark.parametrize(("old", "new"), [('xyz="0.1 0 0"', 'xyz="0.1 0"'), ('scale="2 1 1"', 'scale="big"')])
def test_a_mesh_without_a_place_is_refused_in_one_line(tmp_path, old, new):
    path = tmp_path / "arm.urdf"
    path.write_text(URDF.replace(old, new))
    (tmp_path / "arm.stl").write_text(TETRAHEDRON)
    name, _, value = new.partition("=")
    with pytest.raises(
        BodyError, match=rf"^{path}: {name} of a mesh of link 'arm' is {value[1:-1]!r}; it must be three"
    ):
        robot_stage.visuals(path)


def test_only_one_link_at_a_time_is_searched_for(tmp_path, monkeypatch):
    """Two searches would each find the ports that the other one listens to taken."""
    (tmp_path / "skin.toml").write_text("rows = 8\ncolumns = 4\n")
    table = '[[links]]\nname = "{name}"\nskin = "skin.toml"\n'
    (tmp_path / "robot.toml").write_text("".join(table.format(name=name) for name in "abc"))
    lock, inside, most = threading.Lock(), [], []

    def search(port, skin, timeout, trust):
        with lock:
            inside.append(port)
            most.append(len(inside))
        time.sleep(0.05)
        with lock:
            inside.pop()
        raise PortNotFound("no board answers")

    monkeypatch.setattr(driver, "open", search)
    source = BodySource(tmp_path / "robot.toml")
    assert {state.status for state in source.states().values()} == {"lost"}
    source.close()
    assert len(most) >= 3
    assert max(most) == 1


def test_a_robot_without_joints_is_shown(tmp_path):
    (tmp_path / "arm.urdf").write_text('<robot name="one"><link name="arm"/></robot>')
    (tmp_path / "skin.toml").write_text("rows = 8\ncolumns = 4\n")
    (tmp_path / "robot.toml").write_text(TABLE.format(mirrored="false"))
    server, _ = serving.serve(port=0)
    try:
        shown = robot_stage.RobotStage(server, Body.load(tmp_path / "robot.toml"))
        shown.move({})
        assert shown.points_m()[:, 2] == pytest.approx(0.5)
        np.testing.assert_allclose(shown.stages["sheet"].point_m, [0.0, 0.0, 0.5])
    finally:
        serving.stop(server)


def test_meshes_beyond_a_limit_are_left_out_and_told(tmp_path, stage, monkeypatch):
    shown, _ = stage
    monkeypatch.setattr(robot_stage, "MAX_MESHES", 2)
    visual, _ = robot_stage.visuals(tmp_path / "arm.urdf")
    shown._add_mesh(visual)
    assert robot_stage.REST not in shown.left_out()
    shown._add_mesh(visual)
    assert f"1 {robot_stage.REST}: 'arm.stl'" in shown.left_out()
