"""The momentum observer that is set beside the sheet: right where it is told the truth."""

import numpy as np
import pytest

pytest.importorskip("mujoco")

import mujoco

from contactfpga_sim.lab.mujoco.collisions import AFTER_S, Arm, Collision, by_observer, by_sheet
from contactfpga_sim.lab.mujoco.observer import CONTROL_S, Observer, Wrong

TRUE = Wrong((1.0, 1.0), (1.0, 1.0), torque_nm=0.0, speed_rad_s=0.0)


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    return Arm(tmp_path_factory.mktemp("arm"))


def residuals(arm, pushed_nm, wrong=TRUE, seconds=1.0):
    """(n, 2) of a free motion in which these torques push from 0.5 s on."""
    data, observer, found = mujoco.MjData(arm.model), Observer(100.0, wrong, np.random.default_rng(0)), []
    data.mocap_pos[0] = [9, 9, 9]
    while data.time < seconds:
        if data.time >= 0.5:
            data.qfrc_applied[:] = pushed_nm
        arm.drive(data, np.array([0.8, -1.2]) * np.sin(4 * data.time + 1))
        for _ in range(round(CONTROL_S / arm.model.opt.timestep)):
            mujoco.mj_step(arm.model, data)
        found.append(observer.take(data.qpos, data.qvel, data.ctrl).copy())
    return np.array(found)


def test_told_the_truth_its_residual_is_the_torque_that_pushes(arm):
    """The oracle is what is applied. The joints do not turn back in the last 0.1 s."""
    found = residuals(arm, [1.5, -0.7])
    assert found[-100:] == pytest.approx(np.broadcast_to([1.5, -0.7], (100, 2)), abs=2e-3)


def test_a_wrong_mass_shows_where_nothing_pushes(arm):
    right, wrong = (
        np.abs(residuals(arm, [0.0, 0.0], Wrong((mass, mass), (1.0, 1.0), 0.0, 0.0))[-100:]).max()
        for mass in (1.0, 1.3)
    )
    assert right < 2e-3
    assert wrong > 0.02


def test_its_place_is_where_the_rod_is_and_the_sheets_too(arm):
    """One collision, the observer told the truth."""
    drawn = Collision.drawn(3)
    case = Collision(drawn.angles, drawn.speeds, drawn.place_m, TRUE, 3)
    limits = np.array([0.3, 0.3])
    none = by_observer(arm, case, 100.0, limits, reacts=False)
    observed, felt = by_observer(arm, case, 100.0, limits), by_sheet(arm, case)
    assert abs(none.off_m) < 0.01
    assert abs(felt.off_m) < 0.005
    assert 0 <= felt.late_s <= observed.late_s < 0.01 < AFTER_S
    assert felt.peak_n <= observed.peak_n < none.peak_n / 2
