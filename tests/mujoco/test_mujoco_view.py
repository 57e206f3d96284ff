"""`contactfpga view --mujoco`: the mouse pushes a simulated robot, and its reflex answers."""

import os
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("mujoco")
pytest.importorskip("viser")

import contactfpga
from contactfpga.tools.view import obstacle, opening
from contactfpga.tools.view.fingers import Finger
from contactfpga.tools.view.robot_source import ALL, BARE, KIT, LATE, NO_REFLEX, SimulatedSource, Sweep
from contactfpga_sim.lab import browser
from contactfpga_sim.lab.mujoco.clip import SteppedPace

HERE = contactfpga.examples() / "arm"
ROBOT, SCENE, REFLEXES = (str(HERE / name) for name in ("pushed.toml", "scene.xml", "reflexes.py"))
X_MM = 6 * 2 * np.pi * 38 / 24
"""A quarter of the way round the arm: a push there has a moment about the joint, against the arm's way or along it."""


def started(reflex, skin=KIT, angle=None):
    """The arm of the example at an angle, which goes on as far as it is told."""
    source = SimulatedSource(ROBOT, SCENE, REFLEXES)
    source.pace, source.reflex, source.skin = SteppedPace(0.0), reflex, skin
    source.restart()
    source.advance()
    for copy in source.copies if angle is not None else ():
        copy.sheets.data.qpos[0] = angle
    return source


def goes_on(source, seconds):
    source.pace.until_s += seconds
    while source.simulated_s < source.pace.until_s - 1e-9:
        source.advance()


def pushed(reflex, push_n, x_mm=X_MM):
    """The joint's speed at the end, the link's state, and the robot, of 0.2 s with a push from 0.1 s on."""
    source = started(reflex)
    goes_on(source, 0.1)
    if push_n:
        source.links["arm"].touch([Finger(x_mm, 120.0, 9.0, push_n)])
    goes_on(source, 0.1)
    (copy,) = source.copies
    state = copy.states()["arm"]
    source.close()
    assert not copy.sheets.data.qfrc_applied.any(), "a push is of its step alone"
    return float(copy.sheets.data.qvel[0]), state, copy


def test_it_goes_on_untouched_and_stops_where_a_finger_pushes():
    speed, state, _ = pushed("Stop", 0.0)
    assert speed == pytest.approx(0.8, rel=0.02)
    assert len(state.zones) == 0
    speed, state, copy = pushed("Stop", 5.0)
    assert abs(speed) < 0.05
    assert len(state.zones) == 1
    assert copy.pressed_by("arm") == "pressed by 5.0 N, most so far 5.0 N"


def test_without_a_reflex_it_pushes_on_and_the_push_is_physical():
    """The oracle is the servo: it is behind by the push's moment over its gain, 0.2 m of lever at the finger."""
    speeds = [pushed(NO_REFLEX, 10.0, x_mm)[0] for x_mm in (X_MM, 3 * X_MM)]
    assert abs(speeds[0] - speeds[1]) == pytest.approx(2 * 10.0 * 0.2 / 60.1, rel=0.02)
    assert sum(speeds) / 2 == pytest.approx(0.8, rel=0.02)


BEFORE_BAR = 0.5
"""An angle in rad from which the arm reaches the bar, at 0.54, within 0.1 s."""
FOAM_N = 4 / 3 * 3.45e5 / 0.75 * 0.02**0.5
"""Of the foam's spring, by m ** 1.5: its modulus and R* of docs/mujoco.md."""


def test_copies_differ_by_when_their_reflex_knows_and_by_nothing_else():
    """Until the first reflex acts all are the same to the bit. The reflex of the late one sees what was scanned 6 ms
    before, and is asked each ms. The oracle of the least force is the foam's spring on an arm that goes on as fast."""
    source = started("Stop", ALL, BEFORE_BAR)
    data = {copy.skin: copy.sheets.data for copy in source.copies}
    assert list(data) == [BARE, LATE, KIT]
    touched_s, acted_s = None, {}
    for _ in range(100):
        goes_on(source, 1e-3)
        time_s = data[KIT].time
        if touched_s is None and source.copies[-1].force_n("arm"):
            touched_s = time_s
        for skin, one in data.items():
            if one.ctrl[0] != 0.8:
                acted_s.setdefault(skin, time_s)
        if not acted_s:
            assert len({one.qpos[0] for one in data.values()}) == 1
    source.close()
    closed_s = acted_s[KIT] - touched_s
    assert set(acted_s) == {KIT, LATE}, "without skin no reflex acts"
    assert 0.001 < closed_s < 0.010, "foam first, then a switch, a scan, a USB frame and the host"
    assert 0.004 < acted_s[LATE] - acted_s[KIT] <= 0.006, "the kit takes 0.2 to 1.5 ms of the 6"
    most = {copy.skin: copy.most_n["arm"] for copy in source.copies}
    assert most[BARE] > 2 * most[LATE] > 2.5 * most[KIT]
    for skin, when_s in acted_s.items():
        depth_m = 0.8 * 0.24 * (when_s - touched_s)
        assert 0.7 * FOAM_N * depth_m**1.5 < most[skin] < 2.5 * FOAM_N * depth_m**1.5
    assert source.sweep.forces_n.shape == (3, 100)
    drawn = np.nanmax(source.sweep.forces_n, axis=1)
    assert drawn == pytest.approx(list(most.values())), "the chart misses no peak"


def test_a_sweep_begins_with_a_touch_and_stands_until_the_next_after_its_end():
    sweep = Sweep(2)
    forces = {0.01: (0, 1), 0.011: (3, 2), 0.012: (2, 0), 0.05: (0, 7)}
    for step in range(400):
        time_s = step / 1000
        sweep.add(time_s, forces.get(time_s, (0.0, 0.0)))
    assert sweep.forces_n[:, :3].tolist() == [[0, 3, 2], [1, 2, 0]]
    assert sweep.forces_n[:, 40].tolist() == [0, 7]
    assert np.isfinite(sweep.forces_n).all()
    sweep.add(0.5, (0, 4))
    assert sweep.forces_n[:, 0].tolist() == [0, 4]
    assert np.isnan(sweep.forces_n[:, 1:]).all()


@pytest.mark.parametrize(("kind", "half_mm"), [(obstacle.BALL, 1.0), (obstacle.HAND, 80.0)])
def test_an_obstacle_in_its_way_is_felt_and_stops_it(kind, half_mm):
    """0.2 m from the joint, where the arm would be after 0.4 rad; the sheet begins at 0.08 m, its rows are 10 mm."""
    source = started("Stop", angle=0.0)
    source.obstacle.put(kind, 0.2 * np.array([np.cos(0.4), np.sin(0.4), 0.0]))
    goes_on(source, 0.2)
    (copy,) = source.copies
    state = copy.states()["arm"]
    source.close()
    assert copy.sheets.data.ctrl[0] == 0.0
    assert len(state.zones) == 1
    assert 0 < copy.sheets.data.qpos[0] < 0.4
    along_mm = 200.0 * np.cos(0.4 - copy.sheets.data.qpos[0]) - 80.0
    assert abs(state.zones[0].y_mm - along_mm) < 5.0 + half_mm


def test_an_obstacle_follows_the_mouse_no_faster_than_a_hand():
    one = obstacle.Obstacle()
    one.put(obstacle.BALL, np.zeros(3))
    one.wanted_m = np.array([0.3, 0.0, 0.4])
    one.go_on(0.5)
    np.testing.assert_allclose(one.at_m, [0.15, 0.0, 0.2])
    one.go_on(9.0)
    assert one.at_m.tolist() == one.wanted_m.tolist()


@pytest.mark.parametrize(
    ("eye", "to", "wanted"),
    [
        # From above: the ray from (0, 0, 1) through (0.1, 0.2, 0.5) meets the plane z = 0.
        ((0.0, 0.0, 1.0), (0.1, 0.2, 0.5), (0.2, 0.4, 0.0)),
        # From the front: the plane x = 0.
        ((1.0, 0.0, 0.0), (0.5, 0.1, 0.2), (0.0, 0.2, 0.4)),
        # From the side, a little from above: the plane y = 0.
        ((0.0, -1.0, 0.1), (0.1, -0.5, 0.1), (0.2, 0.0, 0.1)),
        # Away from it, and nearly along the plane: it stays.
        ((0.0, 0.0, 1.0), (0.0, 0.1, 1.5), (0.0, 0.0, 0.0)),
        ((1.0, 0.0, 0.0), (0.99, 1.0, 0.0), (0.0, 0.0, 0.0)),
    ],
)
def test_a_drag_moves_an_obstacle_in_the_plane_that_faces_the_camera(eye, to, wanted):
    one = obstacle.Obstacle()
    one.put(obstacle.BALL, np.zeros(3))
    obstacle.Grip(one, np.array(eye), np.zeros(3)).drag(np.array(eye), np.array(to))
    np.testing.assert_allclose(one.wanted_m, wanted, atol=1e-12)


ARM = """<mujoco><asset><hfield name='h' nrow='2' ncol='3' size='1 2 0.3 0.1'/></asset>{before}<worldbody>
<geom type='hfield' hfield='h' pos='0 0 -9'/><body name='arm' {arm}><joint name='j' axis='1 0 0'/>
<geom size='0.1' pos='0 0.1 0'/></body>{beside}</worldbody></mujoco>"""
REPEATED = "<replicate count='11' offset='1 0 0'>" * 3 + "<geom size='0.1'/>" + "</replicate>" * 3
TENDON = (
    """<tendon><fixed name='t'><joint joint='j' coef='1'/></fixed></tendon><actuator><motor tendon='t'/></actuator>"""
)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"mujoco": "absent.xml"}, "absent.xml is no file"),
        ({"port": None}, "--mujoco needs ROBOT.toml"),
        ({"mujoco": ROBOT}, "MuJoCo says"),
        ({"reflex": "absent.py"}, "absent.py', no file"),
        ({"reflex": str(HERE / "arm.py")}, "has no class with __call__"),
        ({"mujoco": None}, "--reflex is for a robot of --mujoco"),
        ({"mujoco": "tendon.xml"}, "the first actuator of tendon.xml moves no hinge or slide"),
    ],
)
def test_bad_words_get_one_line(words, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("tendon.xml").write_text(ARM.format(before=TENDON, arm="", beside=""))
    named = opening.ViewRequest(**{"port": ROBOT, "mujoco": SCENE, "reflex": REFLEXES, **words})
    with pytest.raises(contactfpga.ContactFPGAError) as failed, opening.opened(named, http_port=0):
        pass
    assert said in str(failed.value)
    assert "\n" not in str(failed.value)


def run_model(seconds):
    source = SimulatedSource(ROBOT, "model.xml")
    source.pace = SteppedPace(0.0)
    assert "arm" in {one.link for one in source.solids()}, "terrain, of number 0 as well, is no mesh"
    goes_on(source, seconds)
    source.close()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"before": "<size nuserdata='2000000000'/>"}, "more than 2 GiB or 20 s of processor time to load"),
        ({"beside": REPEATED}, "ngeom is 1333; it must be 0 to 1000"),
        ({"before": "<option timestep='0'/>"}, "timestep is 0.0; it must be 1e-05 to 0.1"),
        ({"before": "<option iterations='100000'/>"}, "iterations is 100000; it must be 0 to 1000"),
        ({"arm": "pos='nan 0 0'"}, "body_pos"),
        ({"before": "<option gravity='0 0 1e30'/>"}, "MuJoCo says Nan, Inf or huge value in QACC"),
    ],
)
def test_a_model_beyond_a_limit_gets_one_line_with_its_name(words, said, tmp_path, monkeypatch):
    """Each in a folder that stays empty but for the model."""
    monkeypatch.chdir(tmp_path)
    Path("model.xml").write_text(ARM.format(**{"before": "", "arm": "", "beside": "", **words}))
    with pytest.raises(contactfpga.ContactFPGAError, match=rf"^model.xml.*{said}") as failed:
        run_model(0.1)
    assert "\n" not in str(failed.value)
    assert os.listdir() == ["model.xml"]


def test_all_forms_are_drawn_closed_and_as_large_as_they_are():
    """The volume inside the drawn faces is that of the form, less what corners cut off."""
    import mujoco

    from contactfpga.tools.view.solids import _form

    size = np.array([0.2, 0.3, 0.4])
    volumes = {
        mujoco.mjtGeom.mjGEOM_BOX: 8 * 0.024,
        mujoco.mjtGeom.mjGEOM_SPHERE: 4 / 3 * np.pi * 0.008,
        mujoco.mjtGeom.mjGEOM_ELLIPSOID: 4 / 3 * np.pi * 0.024,
        mujoco.mjtGeom.mjGEOM_CAPSULE: np.pi * 0.04 * 0.6 + 4 / 3 * np.pi * 0.008,
        mujoco.mjtGeom.mjGEOM_CYLINDER: np.pi * 0.04 * 0.6,
    }
    for kind, volume in volumes.items():
        vertices, faces = _form(kind, size)
        a, b, c = np.moveaxis(vertices[faces], 1, 0)
        assert np.einsum("ni,ni->", a, np.cross(b, c)) / 6 == pytest.approx(volume, rel=0.02)


def until(visitor, true):
    for _ in range(900):
        if true():
            return
        visitor.page.wait_for_timeout(100)
    raise AssertionError("not within 90 s")


@pytest.mark.campaign  # beside other browsers the page was seen not to notice the mouse for minutes
@pytest.mark.skipif(browser.program() is None, reason="no Chromium is installed")
def test_a_click_in_a_browser_stops_the_arm():
    """The arm goes on only while it is asked to, so that a page on a busy machine shows it where it is clicked."""
    pytest.importorskip("playwright")
    named = opening.ViewRequest(ROBOT, mujoco=SCENE, reflex=REFLEXES)
    with opening.opened(named, http_port=0) as shown, browser.visit(shown) as visitor:
        source = shown.source
        source.pace = pace = SteppedPace(0.0)

        def command():
            copies = source.copies  # none while it starts again
            return copies[0].sheets.data.ctrl[0] if copies else None

        visitor.page.get_by_role("button", name="Start again").click()
        pace.until_s = source.simulated_s + 0.05
        until(visitor, lambda: command() == 0.8)
        until(visitor, lambda: source.simulated_s > pace.until_s - 1e-9)
        visitor.click(2 * X_MM, 150.0, "arm")  # on top
        until(visitor, lambda: source.links["arm"].fingers)
        pace.until_s += 0.1
        until(visitor, lambda: command() == 0.0)
        visitor.page.wait_for_selector("text=1 contact")
        visitor.page.get_by_role("button", name="Start again").click()
        until(visitor, lambda: command() == 0.8 and not source.links["arm"].fingers)
