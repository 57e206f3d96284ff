"""`contactfpga view --mujoco`: the mouse pushes a simulated robot, and its reflex answers."""

import numpy as np
import pytest

pytest.importorskip("mujoco")
pytest.importorskip("viser")

import contactfpga
from contactfpga.tools.view import opening
from contactfpga.tools.view.fingers import Finger
from contactfpga.tools.view.simulated import NO_REFLEX, SimulatedSource
from contactfpga_sim.lab.view import browser

HERE = contactfpga.examples() / "arm"
ROBOT, SCENE, REFLEXES = (str(HERE / name) for name in ("pushed.toml", "scene.xml", "reflexes.py"))
X_MM = 6 * 2 * np.pi * 38 / 24
"""A quarter of the way round the arm: a push there has a moment about the joint, against the arm's way or along it."""


def pushed(monkeypatch, reflex, push_n, x_mm=X_MM):
    """The joint's speed at the end, and the link's state, of 0.2 s with a push from 0.1 s on."""
    source = SimulatedSource(ROBOT, SCENE, REFLEXES)
    source.reflex = reflex
    source.restart()
    monkeypatch.setattr(source._pace, "due", lambda simulated_s: 0.02)
    monkeypatch.setattr(type(source._pace), "most_s", 0.02)
    for moment in range(10):
        if moment == 5 and push_n:
            source.virtual["arm"].touch([Finger(x_mm, 120.0, 9.0, push_n)])
        states = source.states()
    source.close()
    return float(source.sheets.data.qvel[0]), states["arm"], source


def test_it_goes_on_untouched_and_stops_where_a_finger_pushes(monkeypatch):
    speed, state, _ = pushed(monkeypatch, "Stop", 0.0)
    assert speed == pytest.approx(0.4, rel=0.02)
    assert len(state.zones) == 0
    speed, state, source = pushed(monkeypatch, "Stop", 5.0)
    assert abs(speed) < 0.05
    assert len(state.zones) == 1
    assert source.told("arm") == "pressed by 5.0 N, most so far 5.0 N"


def test_without_a_reflex_it_pushes_on_and_the_push_is_physical(monkeypatch):
    """The oracle is the servo: it is behind by the push's moment over its gain, 0.2 m of lever at the finger."""
    speeds = [pushed(monkeypatch, NO_REFLEX, 10.0, x_mm)[0] for x_mm in (X_MM, 3 * X_MM)]
    assert abs(speeds[0] - speeds[1]) == pytest.approx(2 * 10.0 * 0.2 / 60.1, rel=0.02)
    assert sum(speeds) / 2 == pytest.approx(0.4, rel=0.02)


def test_follow_gives_way(monkeypatch):
    speeds = [pushed(monkeypatch, "Follow", 5.0, x_mm)[0] for x_mm in (X_MM, 3 * X_MM)]
    assert sorted(speeds) == pytest.approx([-0.4, 0.4], abs=0.05)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"mujoco": "absent.xml"}, "absent.xml is no file"),
        ({"port": None}, "--mujoco needs ROBOT.toml"),
        ({"mujoco": ROBOT}, "MuJoCo says"),
        ({"reflex": "absent.py"}, "absent.py', no file"),
        ({"reflex": str(HERE / "arm.py")}, "has no class with __call__"),
        ({"mujoco": None}, "--reflex is for a robot of --mujoco"),
    ],
)
def test_bad_words_get_one_line(words, said):
    named = opening.ViewRequest(**{"port": ROBOT, "mujoco": SCENE, "reflex": REFLEXES, **words})
    with pytest.raises(contactfpga.ContactFPGAError) as failed, opening.opened(named, http_port=0):
        pass
    assert said in str(failed.value)
    assert "\n" not in str(failed.value)


def test_all_forms_are_drawn_closed_and_as_large_as_they_are():
    """The volume inside the drawn faces is that of the form, less what corners cut off."""
    import mujoco

    from contactfpga.tools.view.simulated import _form

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
    for _ in range(200):
        if true():
            return
        visitor.page.wait_for_timeout(100)
    raise AssertionError("not within 20 s")


@pytest.mark.slow  # 20 s
@pytest.mark.skipif(browser.program() is None, reason="no Chromium is installed")
def test_a_click_in_a_browser_stops_the_arm():
    pytest.importorskip("playwright")
    named = opening.ViewRequest(ROBOT, mujoco=SCENE, reflex=REFLEXES)
    with opening.opened(named, http_port=0) as shown, browser.visit(shown) as visitor:
        data, worn = shown.source.sheets.data, shown.source.sheets["arm"]
        visitor.page.locator(".mantine-Notification-closeButton").click()  # it covers the arm
        visitor.page.get_by_role("button", name="Start again").click()
        until(visitor, lambda: data.ctrl[0] == 0.4)
        visitor.click(2 * X_MM, 150.0, "arm")  # on top
        until(visitor, lambda: data.ctrl[0] == 0.0)
        assert worn.fingers, "it is the mouse that stopped it, not the bar"
        visitor.page.wait_for_selector("text=1 contact")
        visitor.page.get_by_role("button", name="Start again").click()
        until(visitor, lambda: data.ctrl[0] == 0.4 and not worn.fingers)
