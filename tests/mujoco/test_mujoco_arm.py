"""The paper's arm in MuJoCo: equal to `contactfpga study arm`; its reflexes, and what ends in a stop."""

import random
import sys

import pytest

pytest.importorskip("mujoco")

import mujoco

import contactfpga
from contactfpga.mujoco import Sheets
from contactfpga_sim.lab.arm import run as study
from contactfpga_sim.lab.arm.case import Case

HERE = contactfpga.examples() / "arm"
sys.path.insert(0, str(HERE))
import arm  # noqa: E402
import reflexes  # noqa: E402

WAYS = {"torque": ("torque",), "latency": ("switch", 6e-3), "uart": ("usb",), "pin": ("pin",)}


@pytest.mark.parametrize("way", WAYS)
def test_the_arm_is_that_of_the_study(way):
    """Its equations are integrated by another program, and its foam, contact, sheet and host are these. Within 3 %."""
    force_n, _ = arm.run(*WAYS[way])
    assert force_n == pytest.approx(study.run(Case.load("paper"), way, to_peak=True).outcome.peak_force_n, rel=0.03)


ARM = """<mujoco><option timestep="2.5e-4" gravity="0 0 0" integrator="implicitfast"/>
<worldbody><body name="arm" euler="0 0 -1.3"><joint name="joint" axis="0 0 1" armature="0.015" damping="0.1"/>
<inertial pos="0.15 0 0" mass="0.6" diaginertia="1e-4 0.0022166 0.0022166"/>
<geom type="capsule" fromto="0.03 0 0 0.3 0 0" size="0.038" margin="-0.005" gap="0.005"/></body>
<body name="hand" pos="0.2 0.076 0"><joint name="hand" type="slide" axis="0 1 0" damping="{damping}"/>
<geom type="capsule" fromto="0 0 -0.2 0 0 0.2" size="0.038" mass="1" margin="-0.005" gap="0.005"/></body></worldbody>
<actuator><velocity joint="joint" kv="60" forcerange="-3 3"/><motor joint="hand"/></actuator></mujoco>"""
FIXED, FREE = 1e7, 5.0


class Run:
    """A reflex at 1 kHz; ``course`` is (time in s, angle, speed, force in N) each ms. ``fault``, at ``at_s``, is a
    function of the sheet."""

    def __init__(
        self,
        reflex,
        seconds=0.12,
        damping=FIXED,
        push_n=0.0,
        fault=None,
        at_s=0.0,
        golden=True,
        robot=HERE / "robot.toml",
    ):
        model = mujoco.MjModel.from_xml_string(ARM.format(damping=damping))
        data = mujoco.MjData(model)
        data.ctrl[1] = -push_n
        self.course = []
        with Sheets(model, data, robot, radius_m=0.038, foam=True, golden=golden) as sheets:
            while data.time < seconds:
                if fault is not None and data.time >= at_s:
                    fault(sheets["arm"])
                    fault = None
                data.ctrl[0] = reflex(sheets.snapshot(), data.qpos[0])
                for _ in range(4):
                    sheets.step()
                force = sum(touch.push_n for touch in sheets["arm"].touches)
                self.course.append((data.time, data.qpos[0], data.qvel[0], force))
            self.touched = any(step[3] for step in self.course)


def test_stop_stops_at_the_contact():
    run = Run(reflexes.Stop(1.0), golden=False)
    assert run.touched
    assert max(force for *_, force in run.course) < 15
    assert abs(run.course[-1][2]) < 0.03, "what the foam gives back still turns it"


def test_back_off_lets_go_again_and_rests():
    run = Run(reflexes.BackOff(1.0), 0.2, golden=False)
    assert run.touched
    assert run.course[-1][3] == 0
    assert abs(run.course[-1][2]) < 1e-3
    assert -0.06 < run.course[-1][1] - max(angle for _, angle, *_ in run.course) < -0.04


@pytest.mark.slow  # 7 s
def test_follow_gives_way_to_a_hand_as_far_as_it_goes():
    pushed = Run(reflexes.Follow(1.0), 0.3, FREE, push_n=12.0)
    held = Run(lambda snapshot, angle: 0.0, 0.3, FREE, push_n=12.0)
    assert pushed.course[-1][1] < -0.2 < -0.1 < held.course[-1][1]
    left = Run(reflexes.Follow(1.0), 0.1, FREE)
    assert abs(left.course[-1][1]) < 1e-3


def die(sheet):
    sheet.dead = True


def pull(sheet):
    def gone(data):
        raise contactfpga.PortLost("the plug was pulled")

    sheet.line = gone


def lose_all(sheet):
    sheet.line = lambda data: b""


@pytest.mark.parametrize("fault", [die, pull, lose_all])
@pytest.mark.parametrize("reflex", [reflexes.Stop, reflexes.BackOff, reflexes.Follow])
def test_without_frames_the_arm_stops_before_it_touches(reflex, fault):
    """It would have touched after some 25 ms; the fault comes at 5 ms, and the stop 5 ms later. One that follows is
    pushed by a hand meanwhile, and holds from then on."""
    made = reflex(1.0)
    if reflex is reflexes.Follow:
        hand = {"damping": FREE, "push_n": 12.0}
        run = Run(made, 0.25, fault=fault, at_s=0.1, **hand)
        assert run.course[99][1] < -0.03
        assert made.speed == 0
        assert abs(run.course[-1][1] - run.course[179][1]) < 0.01, "70 ms in which it would have gone on by 0.07"
        return
    run = Run(made, fault=fault, at_s=0.005)
    assert not run.touched
    assert all(abs(speed) < 1e-3 for time, _, speed, _ in run.course if time > 0.06)


def test_with_a_third_of_all_packets_lost_it_goes_on_and_still_stops():
    rng = random.Random(1)

    def lose_some(sheet):
        sheet.line = lambda data: data if rng.random() > 1 / 3 else b""

    run = Run(reflexes.Stop(1.0), fault=lose_some, at_s=0.0)
    assert run.touched
    assert max(force for *_, force in run.course) < 20
    assert abs(run.course[-1][2]) < 0.03


def guarded(folder):
    """The arm's robot.toml, with guard lines."""
    (folder / "robot.toml").write_text((HERE / "robot.toml").read_text())
    (folder / "skin.toml").write_text("guard = true\n" + (HERE / "skin.toml").read_text())
    return folder / "robot.toml"


CUTS = {
    "row at the board": ({8: 0}, {}),
    "row after 12 columns": ({3: 12}, {}),
    "column at the board": ({}, {8: 0}),
    "column after 15 rows": ({}, {0: 15}),
}


@pytest.mark.slow  # 15 s, and the build of a guarded board
@pytest.mark.parametrize("where", CUTS)
@pytest.mark.parametrize("reflex", [reflexes.Stop, reflexes.BackOff, reflexes.Follow])
def test_a_line_that_is_cut_stops_the_arm_before_it_touches_on_a_guarded_sheet(reflex, where, tmp_path):
    """The arm would touch after some 25 ms at switch (8, 8); the break comes at 5 ms."""
    made, told = reflex(1.0), []

    def asked(snapshot, angle):
        speed = made(snapshot, angle)
        told.append(set(snapshot.links["arm"].zones.faults))
        return speed

    run = Run(
        asked, 0.05, fault=lambda sheet: sheet.cut(*CUTS[where]), at_s=0.005, golden=False, robot=guarded(tmp_path)
    )
    assert not told[4]
    assert told[-1], "the break is named"
    assert not run.touched
    assert made.speed == 0
    assert abs(run.course[-1][2]) < 0.01


@pytest.mark.slow  # 3 s
def test_without_guard_lines_a_cut_row_is_not_felt_as_the_page_says():
    """docs/faults.md: a broken wire looks like an untouched sheet."""
    run = Run(reflexes.Stop(1.0), 0.06, fault=lambda sheet: sheet.cut({8: 0}), at_s=0.005, golden=False)
    assert run.touched
    assert max(force for *_, force in run.course) > 15
