"""Random collisions of a forearm, reported by a sheet and by a momentum observer."""

from __future__ import annotations

import dataclasses
import functools
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from contactfpga_sim.lab.flips.campaign import wilson
from contactfpga_sim.lab.mujoco.observer import (
    CONTROL_S,
    DAMPING,
    FIRST_M,
    FRICTION_NM,
    MASS_KG,
    ROTOR,
    SECOND_M,
    Observer,
    Wrong,
)
from contactfpga_sim.lab.mujoco.sheets import Sheets
from contactfpga_sim.lab.mujoco.wear import wear
from contactfpga_sim.lab.writer import table_of

ROD_M = 0.02
SHEET_M = (0.06, 0.20)
"""Sheet's start and length on the forearm."""
RADIUS_M = 0.038
LEAD_S, AFTER_S = 0.15, 0.2
"""Times before and after the touch."""
SERVO = (30.0, 10.0)
"""Gain of the joints' controllers, Nm s/rad."""
LIMIT_NM = (40.0, 20.0)
GAINS = (20.0, 50.0, 100.0, 200.0)
SPRING = "0.1 0.1"
"""MuJoCo's ``solref``: about 10 N/mm on this arm, lightly damped."""
FREE_S = 3.0

SCENE = f"""<mujoco><option timestep="5e-4" gravity="0 0 0" integrator="implicitfast"/>
<default><geom contype="0" conaffinity="0" solref="{SPRING}"/></default><worldbody>
<body name="upper"><joint name="shoulder" axis="0 0 1" armature="{ROTOR[0]}" damping="{DAMPING[0]}"
frictionloss="{FRICTION_NM[0]}"/><inertial pos="{FIRST_M / 2} 0 0" mass="{MASS_KG[0]}"
diaginertia="1e-3 {MASS_KG[0] * FIRST_M**2 / 12} {MASS_KG[0] * FIRST_M**2 / 12}"/>
<body name="forearm" pos="{FIRST_M} 0 0"><joint name="elbow" axis="0 0 1" armature="{ROTOR[1]}" damping="{DAMPING[1]}"
frictionloss="{FRICTION_NM[1]}"/><inertial pos="{SECOND_M / 2} 0 0" mass="{MASS_KG[1]}"
diaginertia="1e-3 {MASS_KG[1] * SECOND_M**2 / 12} {MASS_KG[1] * SECOND_M**2 / 12}"/></body></body>
<body name="rod" mocap="true"><geom name="rod" type="capsule" fromto="0 0 -0.1 0 0 0.1" size="{ROD_M}" contype="2"
conaffinity="1" friction="0"/></body></worldbody>
<actuator><motor joint="shoulder"/><motor joint="elbow"/></actuator></mujoco>"""
SKIN = f"""rows = 20
columns = 24
closed = true
pitch_y_mm = 10.0
surface = "cylinder"
radius_mm = {1e3 * RADIUS_M}
[cover]
model = "foam"
thickness_m = 0.003
[cover.cap]
side_m = 0.0098
[cover.switch]
force_n = 0.3
hysteresis = 0.1
"""
ROBOT = f"""[[links]]
name = "sheet"
frame = "forearm"
skin = "skin.toml"
point_m = [{SHEET_M[0] + 0.005}, 0.0, 0.0]
rpy_rad = [0.0, {np.pi / 2}, 0.0]
"""


@dataclasses.dataclass(frozen=True)
class Collision:
    """A moving forearm and a rod in its way."""

    angles: tuple[float, float]
    speeds: tuple[float, float]
    place_m: float
    wrong: Wrong
    seed: int

    @classmethod
    def drawn(cls, seed: int) -> Collision:
        """Anywhere on the sheet but its last 20 mm, at 0.1 to 0.5 m/s."""
        rng = np.random.default_rng(seed)
        angles = rng.uniform(-1.0, 1.0, 2)
        place = rng.uniform(SHEET_M[0] + 0.02, sum(SHEET_M) - 0.02)
        way, share = rng.choice([-1, 1]), rng.uniform(0.5, 0.9)
        across = way * rng.uniform(0.1, 0.5)
        shoulder = share * across / (FIRST_M * np.cos(angles[1]) + place)
        elbow = (1 - share) * across / place
        return cls(tuple(angles.tolist()), (float(shoulder), float(elbow)), float(place), Wrong.drawn(rng), seed)


@dataclasses.dataclass(frozen=True)
class Heard:
    late_s: float | None
    """Time from MuJoCo's first contact to its detection; None: not within :data:`AFTER_S`."""
    early: bool
    """Whether it was reported before any contact."""
    off_m: float | None
    """Error of the most certain reported place along the forearm."""
    peak_n: float


class Arm:
    """The arm under speed controllers, sampled every ms."""

    def __init__(self, folder: Path):
        (folder / "skin.toml").write_text(SKIN)
        (folder / "robot.toml").write_text(ROBOT)
        self.robot = folder / "robot.toml"
        spec = mujoco.MjSpec.from_string(SCENE)
        wear(spec, self.robot)
        geom = spec.geom("sheet")
        geom.contype, geom.conaffinity, geom.friction, geom.solref = (
            1,
            2,
            [0, 0, 0],
            [float(one) for one in SPRING.split()],
        )
        self.model: Any = spec.compile()

    def meets(self, case: Collision) -> Any:
        """MuJoCo's data at the start of a collision."""
        data = mujoco.MjData(self.model)
        angles, speeds = np.array(case.angles), np.array(case.speeds)
        whole = angles.sum()
        along, side = np.array([np.cos(whole), np.sin(whole)]), np.array([-np.sin(whole), np.cos(whole)])
        elbow = FIRST_M * np.array([np.cos(angles[0]), np.sin(angles[0])])
        way = np.sign(speeds[1])
        data.mocap_pos[0, :2] = elbow + case.place_m * along + way * (RADIUS_M + ROD_M) * side
        data.qpos[:], data.qvel[:] = angles - LEAD_S * speeds, speeds
        mujoco.mj_forward(self.model, data)
        return data

    def drive(self, data: Any, wanted: np.ndarray) -> None:
        """Apply torques for (2,) speeds in rad/s."""
        forward = np.array(DAMPING) * wanted + np.array(FRICTION_NM) * np.sign(wanted)
        torque = forward + np.array(SERVO) * (wanted - data.qvel)
        data.ctrl[:] = np.clip(torque, -np.array(LIMIT_NM), LIMIT_NM)

    def force_n(self, data: Any) -> float:
        total, wrench = 0.0, np.zeros(6)
        for number in range(data.ncon):
            mujoco.mj_contactForce(self.model, data, number, wrench)
            total += wrench[0]
        return total

    def touched_m(self, data: Any) -> float:
        body = data.body("forearm")
        return float((body.xmat.reshape(3, 3).T @ (data.contact[0].pos - body.xpos))[0])


Detector = Callable[[Any], tuple[bool, float | None, float]]
"""Whether a contact is detected, its place along the forearm, and its certainty."""


def collide(
    arm: Arm, case: Collision, data: Any, step: Callable[[], None], says: Detector, reacts: bool = True
) -> Heard:
    """If ``reacts``, the arm reverses 1 ms after ``says`` reports the collision."""
    ahead = np.array(case.speeds)
    wanted, touched_s, known_s, off_m, best, peak, place = ahead, None, None, None, -1.0, 0.0, 0.0
    while data.time < LEAD_S + AFTER_S:
        arm.drive(data, wanted)
        for _ in range(round(CONTROL_S / arm.model.opt.timestep)):
            step()
            force = arm.force_n(data)
            if force > 0:
                peak, place = max(peak, force), arm.touched_m(data)
                touched_s = data.time if touched_s is None else touched_s
        says_so, where, sure = says(data)
        if says_so and known_s is None:
            known_s = data.time
        if known_s is not None:
            wanted = -ahead if reacts else ahead
            if touched_s is not None and where is not None and sure > best:
                best, off_m = sure, where - place
    early = known_s is not None and (touched_s is None or known_s < touched_s)
    late_s = None if known_s is None or touched_s is None or early else known_s - touched_s
    return Heard(late_s, early, off_m, peak)


def by_sheet(arm: Arm, case: Collision) -> Heard:
    """Detection by the first snapshot with a contact."""
    data = arm.meets(case)
    with Sheets(arm.model, data, arm.robot, golden=True, radius_m=ROD_M, seed=case.seed) as sheets:

        def says(_: Any) -> tuple[bool, float | None, float]:
            found = [one for one in sheets.snapshot().contacts("link") if one.point_m is not None]
            along_m = [one.point_m[0] for one in found if one.point_m is not None]
            area = sum(one.zone.area_cells for one in found)
            return bool(found), float(np.mean(along_m)) if found else None, float(area)

        return collide(arm, case, data, sheets.step, says)


def by_observer(arm: Arm, case: Collision, gain: float, limits_nm: np.ndarray, reacts: bool = True) -> Heard:
    """Detection by a residual beyond its limit; the largest residual gives the place."""
    data = arm.meets(case)
    observer = Observer(gain, case.wrong, np.random.default_rng(case.seed))

    def says(data: Any) -> tuple[bool, float | None, float]:
        residual = np.abs(observer.take(data.qpos, data.qvel, data.ctrl))
        return bool((residual > limits_nm).any()), observer.place_m(data.qpos[1]), float(residual[0])

    return collide(arm, case, data, lambda: mujoco.mj_step(arm.model, data), says, reacts)


def free(arm: Arm, seed: int) -> np.ndarray:
    """(gains, n, 2) absolute residuals in Nm of a free motion after 0.1 s."""
    rng = np.random.default_rng(seed)
    wrong = Wrong.drawn(rng)
    observers = [Observer(gain, wrong, np.random.default_rng(seed)) for gain in GAINS]
    data = mujoco.MjData(arm.model)
    data.mocap_pos[0] = [9, 9, 9]
    speeds, hertz, phases = rng.uniform(0.2, [1.0, 2.0]), rng.uniform(0.2, 1.0, 2), rng.uniform(0, 2 * np.pi, 2)
    found = []
    while data.time < FREE_S:
        arm.drive(data, speeds * np.sin(2 * np.pi * hertz * data.time + phases))
        for _ in range(round(CONTROL_S / arm.model.opt.timestep)):
            mujoco.mj_step(arm.model, data)
        found.append([one.take(data.qpos, data.qvel, data.ctrl).copy() for one in observers])
    return np.abs(np.array(found)[100:]).swapaxes(0, 1)


def tuned(arm: Arm, free_runs: int, cases: Sequence[Collision]) -> tuple[float, np.ndarray]:
    """Per gain the lowest limits without a false alarm; of these the gain with the least mean delay, missed or early
    ones counting as :data:`AFTER_S`."""
    limits = np.max([free(arm, seed).max(1) for seed in range(free_runs)], 0)

    def delay_s(number: int) -> float:
        found = [by_observer(arm, case, GAINS[number], limits[number]) for case in cases]
        return float(np.mean([AFTER_S if one.late_s is None else one.late_s for one in found]))

    best = min(range(len(GAINS)), key=delay_s)
    return GAINS[best], limits[best]


@dataclasses.dataclass(frozen=True)
class Compared:
    gain: float
    limits_nm: np.ndarray
    alarms: int
    """Runs among :attr:`free_runs`, not used in tuning, with a false alarm."""
    free_runs: int
    sheet: list[Heard]
    observer: list[Heard]
    none: list[Heard]
    """Collisions of an arm without reaction, which would bend the residuals."""


def compare(collisions: int = 200, free_runs: int = 100) -> Compared:
    """Tune on half of the seeds, judge on the rest."""
    with tempfile.TemporaryDirectory() as folder:
        arm = Arm(Path(folder))
        gain, limits = tuned(arm, free_runs, [Collision.drawn(10_000 + seed) for seed in range(collisions // 4)])
        alarms = sum(bool((free(arm, 5_000 + seed)[GAINS.index(gain)] > limits).any()) for seed in range(free_runs))
        cases = [Collision.drawn(seed) for seed in range(collisions)]
        heard = [
            [by(case) for case in cases]
            for by in (
                functools.partial(by_sheet, arm),
                lambda case: by_observer(arm, case, gain, limits),
                lambda case: by_observer(arm, case, gain, limits, reacts=False),
            )
        ]
        return Compared(gain, limits, alarms, free_runs, *heard)


def observer_table() -> str:
    found = compare()
    count = len(found.sheet)
    head = ["", "sheet", "observer", "neither"]
    both, placed = (found.sheet, found.observer), (found.sheet, found.none)
    rows = [
        ["felt", *(_share([one.late_s is not None for one in each]) for each in both), ""],
        ["felt before anything touched", *(_share([one.early for one in each]) for each in both), ""],
        [
            "delay, median, ms",
            *(_median([1e3 * one.late_s for one in each if one.late_s is not None]) for each in both),
            "",
        ],
        ["delay, 95 %, ms", *(f"{np.quantile(_late_ms(each), 0.95):.1f}" for each in both), ""],
        ["place along the forearm, median error, mm", *(_median(_off_mm(each)) for each in placed), ""],
        ["place, 95 %, mm", *(f"{np.quantile(_off_mm(each), 0.95):.1f}" for each in placed), ""],
        ["peak force, median, N", *(_median([one.peak_n for one in each]) for each in (*both, found.none))],
        ["peak force, worst, N", *(f"{max(one.peak_n for one in each):.0f}" for each in (*both, found.none))],
    ]
    free_s = found.free_runs * (FREE_S - 0.1)
    limits = " and ".join(f"{one:.2f}" for one in found.limits_nm)
    text = (
        f"{count} collisions. The observer's gain is {found.gain:.0f}/s, its limits {limits} Nm. "
        f"In {free_s:.0f} s of other free motions it gave a false alarm in {found.alarms} of {found.free_runs}."
    )
    return f"{table_of([head, *rows])}\n\n{text}"


def _late_ms(heard: Sequence[Heard]) -> list[float]:
    return [1e3 * (AFTER_S if one.late_s is None else one.late_s) for one in heard if not one.early]


def _off_mm(heard: Sequence[Heard]) -> list[float]:
    return [1e3 * abs(one.off_m) for one in heard if one.off_m is not None and not one.early]


def _share(flags: Sequence[bool]) -> str:
    low, high = wilson(sum(flags), len(flags))
    return f"{sum(flags)} ({100 * low:.0f} to {100 * high:.0f} %)"


def _median(values: Sequence[float]) -> str:
    ordered, count = sorted(values), len(values)
    reach = 0.98 * np.sqrt(count)
    low, high = max(0, int(count / 2 - reach)), min(count - 1, int(np.ceil(count / 2 + reach)))
    return f"{np.median(ordered):.1f} ({ordered[low]:.1f} to {ordered[high]:.1f})"
