"""A robot in MuJoCo that wears sheets, in real time.

Copies with different skins run in lockstep.
"""

from __future__ import annotations

import collections
import inspect
import runpy
import time
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from contactfpga.driver.pace import Pace
from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.values import shortened, shown
from contactfpga.robot.body import Body, LinkState, Snapshot
from contactfpga.robot.body.kinematics import Pose
from contactfpga.tools.view import model_file, obstacle, solids
from contactfpga.tools.view.fingers import Finger
from contactfpga.tools.view.sources import MAX_LAG_S

REFLEX_S = 1e-3
NO_REFLEX = "none"
BARE, LATE, KIT = SKINS = ("without skin", "6 ms late", "with the kit")
ALL = "side by side"
LATE_S = 6e-3
"""Delay from the sheet's scan to the reflex: the paper's time for screening the sensors and computing (section
IV A).
"""
SWEEP_S, SWEEP_STEPS = 0.1, 100

Reflex = Callable[[Snapshot, float], float]
"""From the felt contacts and the joint's angle to a joint speed."""


class RobotCopy:
    """One robot with its skin and reflex."""

    def __init__(self, skin: str, sheets: Any, acts: Reflex | None):
        """``skin``: one of :data:`SKINS`; without one ``acts`` is never called."""
        self.skin, self.sheets = skin, sheets
        self.most_n = dict.fromkeys(sheets, 0.0)
        """Largest force in N since the start, by link."""
        self._acts = None if skin == BARE else acts
        self._asked = 0
        self._coming: collections.deque[tuple[float, Snapshot]] = collections.deque()
        for worn in sheets.values():
            worn.dead = skin == BARE

    def step(self, fingers: Mapping[str, Sequence[Finger]]) -> None:
        """MuJoCo's next step, with these fingers on its links."""
        sheets, data = self.sheets, self.sheets.data
        if self._acts is not None and (tick := int(data.time / REFLEX_S + 1e-6)) > self._asked:
            self._asked = tick
            if (seen := self._seen()) is not None:
                data.ctrl[0] = self._acts(seen, self._angle())
        for name, worn in sheets.items():
            worn.touch(fingers[name])
        sheets.step()
        for name in sheets:
            self.most_n[name] = max(self.most_n[name], self.force_n(name))

    def _seen(self) -> Snapshot | None:
        now: Snapshot = self.sheets.snapshot()
        if self.skin != LATE:
            return now
        age_s = min((state.age_s for state in now.links.values() if state.age_s is not None), default=0.0)
        coming = self._coming
        coming.append((now.host_time_s - age_s + LATE_S, now))
        while len(coming) > 1 and coming[1][0] <= now.host_time_s:
            coming.popleft()
        due_s, seen = coming[0]
        return seen if due_s <= now.host_time_s else None

    def _angle(self) -> float:
        model = self.sheets.model
        return float(self.sheets.data.qpos[model.jnt_qposadr[model.actuator_trnid[0, 0]]])

    def force_n(self, link: str) -> float:
        return float(sum(touch.push_n for touch in self.sheets[link].touches))

    def pressed_by(self, link: str) -> str:
        return f"pressed by {self.force_n(link):.1f} N, most so far {self.most_n[link]:.1f} N"

    def states(self) -> dict[str, LinkState]:
        links: dict[str, LinkState] = self.sheets.snapshot().links
        return links

    def poses(self) -> dict[str, Pose]:
        model, data = self.sheets.model, self.sheets.data
        return {
            solids.named(model, number): Pose(data.xmat[number].reshape(3, 3).copy(), data.xpos[number].copy())
            for number in range(model.nbody)
        }


class Sweep:
    """The largest forces of each copy since a touch, restarted by the first touch after :data:`SWEEP_S`."""

    def __init__(self, copies: int):
        self.forces_n = np.full((copies, SWEEP_STEPS), np.nan)
        """(copies, SWEEP_STEPS) in N; nan for future times, or before a touch."""
        self._began_s: float | None = None
        self._before = np.zeros(copies)

    def add(self, seconds: float, forces_n: Sequence[float]) -> None:
        forces = np.array(forces_n)
        ended = self._began_s is None or seconds - self._began_s >= SWEEP_S - 1e-9
        if ended and ((forces > 0) & (self._before == 0)).any():
            self._began_s = seconds
            self.forces_n[:] = np.nan
        self._before = forces
        if self._began_s is not None:
            step = int((seconds - self._began_s) / SWEEP_S * SWEEP_STEPS + 1e-6)
            if step < SWEEP_STEPS:
                self.forces_n[:, step] = np.fmax(self.forces_n[:, step], forces)


class SharedLink:
    by_force = True

    def __init__(self) -> None:
        self.fingers: tuple[Finger, ...] = ()

    def touch(self, fingers: Sequence[Finger]) -> None:
        self.fingers = tuple(fingers)


class SimulatedSource:
    """A robot of MuJoCo in real time, or slower on a slow machine."""

    def __init__(self, robot: str, model: str, reflex: str | None = None, gateware: bool = False):
        """``model``: MJCF or URDF, starting at its first keyframe. ``reflex``: a Python file, whose classes with
        ``__call__(snapshot, angle)`` can each set the first actuator.

        Raises :class:`~contactfpga.ContactFPGAError` for an unreadable model, the errors of
        :class:`contactfpga.mujoco.Sheets`, and :class:`~contactfpga.MissingExtra`.
        """
        self._parts: Any = import_module("contactfpga.mujoco")
        self._robot, self._gateware = robot, gateware
        self.title = model
        self.reflexes = _reflexes(reflex)
        """Makers of reflexes by name, taking a speed; without :data:`NO_REFLEX`."""
        self.reflex = next(iter(self.reflexes), NO_REFLEX)
        """Name of the acting reflex; :data:`NO_REFLEX`: the model's first command stays."""
        self.skin = KIT
        self.body = Body.load(robot)
        self._model = _compiled(self._parts, model, robot, self.body)
        if self.reflexes and not _turns_a_joint(self._model):
            raise ContactFPGAError(f"the first actuator of {model} moves no hinge or slide, and --reflex commands it")
        self.copies: list[RobotCopy] = []
        self.links = {name: SharedLink() for name in self.body.links}
        self.obstacle = obstacle.Obstacle()
        self.simulated_s = 0.0
        self.pace = Pace(self.simulated_s, most_lag_s=MAX_LAG_S)
        self._restart()

    def restart(self) -> None:
        """Put the robot and its reflex back to their start before the next moment."""
        self._stale = True

    def _restart(self) -> None:
        self.close()
        self._stale = False
        self.copies = []
        for skin in SKINS if self.skin == ALL else (self.skin,):
            self.copies.append(self._copy(skin))
        self.sweep = Sweep(len(self.copies))

    def _copy(self, skin: str) -> RobotCopy:
        import mujoco

        model, data = self._model, mujoco.MjData(self._model)
        if model.nkey:
            mujoco.mj_resetDataKeyframe(model, data, 0)
        self.obstacle.place(model, data)
        mujoco.mj_forward(model, data)
        # The foam is a spring where the model leaves room for it.
        foam = bool((model.geom_gap > 0).any())
        sheets = self._parts.Sheets(model, data, self._robot, foam=foam, golden=not self._gateware)
        made = self.reflexes.get(self.reflex)
        return RobotCopy(skin, sheets, None if made is None else made(float(data.ctrl[0])))

    def advance(self) -> None:
        if self._stale:
            self._restart()
        pace = self.pace
        began_s, began = self.simulated_s, time.monotonic()
        until_s = began_s + min(pace.due(began_s), pace.most_s)
        while self.simulated_s < until_s - 1e-9:
            self._step()
        if self.simulated_s > began_s:
            pace.ran(self.simulated_s - began_s, time.monotonic() - began)

    def _step(self) -> None:
        step_s = float(self._model.opt.timestep)
        fingers = {name: link.fingers for name, link in self.links.items()}
        self.obstacle.go_on(step_s)
        for copy in self.copies:
            self.obstacle.place(self._model, copy.sheets.data)
            copy.step(fingers)
            self._check(copy.sheets.data)
        self.simulated_s += step_s
        self.sweep.add(self.simulated_s, [max(map(copy.force_n, copy.sheets)) for copy in self.copies])

    def _check(self, data: Any) -> None:
        """Raises :class:`~contactfpga.ContactFPGAError` after a warning of MuJoCo, which may have reset its state."""
        import mujoco

        if (warned := np.flatnonzero(data.warning.number)).size:
            said = mujoco.mju_warningText(int(warned[0]), int(data.warning.lastinfo[warned[0]]))
            raise ContactFPGAError(f"{self.title}: MuJoCo says {said}")

    @property
    def share(self) -> float:
        """Share of real time reached."""
        return self.pace.share

    def solids(self) -> list[solids.Solid]:
        return solids.solids_of(self._model, self.body.links)

    def close(self) -> None:
        for copy in self.copies:
            copy.sheets.close()


def _compiled(parts: Any, path: str, robot: str, body: Body) -> Any:
    import mujoco

    if not Path(path).is_file():
        raise ContactFPGAError(f"{path} is no file; --mujoco takes the MJCF or URDF of a robot")
    model_file.check(path)
    mujoco.set_mju_user_warning(lambda text: None)  # its own way is a file, MUJOCO_LOG.TXT; a step looks for them
    try:
        spec = mujoco.MjSpec.from_file(path)
        bodies = [spec.body(plan.frame) for plan in body.links.values()]
        if any(body is None or not len(body.geoms) for body in bodies):
            parts.wear(spec, robot)
        obstacle.add(spec)
        return spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        if isinstance(error, ContactFPGAError):
            raise
        raise ContactFPGAError(f"{path}: MuJoCo says {shortened(' '.join(str(error).split()))}") from None


def _turns_a_joint(model: Any) -> bool:
    """Whether the first actuator has a joint with one angle or way."""
    from mujoco import mjtJoint, mjtTrn

    joints = (mjtTrn.mjTRN_JOINT, mjtTrn.mjTRN_JOINTINPARENT)
    moved = model.actuator_trnid[:1, 0] if model.nu and int(model.actuator_trntype[0]) in joints else []
    return any(int(model.jnt_type[one]) in (mjtJoint.mjJNT_HINGE, mjtJoint.mjJNT_SLIDE) for one in moved)


def _reflexes(path: str | None) -> dict[str, Callable[[float], Reflex]]:
    """The reflex classes of a file, which is run like `python FILE`."""
    if path is None:
        return {}
    if not Path(path).is_file():
        raise ContactFPGAError(f"--reflex is {shown(path)}, no file; name one as examples/arm/reflexes.py")
    names = runpy.run_path(path, run_name="reflex")
    found: dict[str, Any] = {
        name: one
        for name, one in names.items()
        if inspect.isclass(one) and one.__module__ == "reflex" and "__call__" in vars(one)
    }
    if not found:
        raise ContactFPGAError(f"--reflex {path} has no class with __call__(snapshot, angle)")
    return found
