"""All sheets of a robot in lockstep with MuJoCo."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

import mujoco
import numpy as np

from contactfpga.boards import ICEBREAKER
from contactfpga.design.cover import BODIES, Cover, load_cover
from contactfpga.driver import driver
from contactfpga.inputs import tomlfile
from contactfpga.inputs.values import shown
from contactfpga.robot.body import Body, BodyError, JointHistory, Snapshot
from contactfpga.robot.body.plan import Plan
from contactfpga.robot.body.reader import States
from contactfpga.surfaces.shapes import Floats
from contactfpga_sim.apps.latency.usb import BridgeSettings
from contactfpga_sim.apps.mujoco.touch import SheetTouch, by_finger, of_solver, on_sheet
from contactfpga_sim.apps.mujoco.worn import SteppedPort, WornSheet

LEAD_S = 0.01
"""Time from the boards' power-up to MuJoCo's first step."""
LOOK_S = 2.5e-4
"""Boards' step before MuJoCo's first."""

COVER = Cover("foam")
"""Cover of a Skin file without ``[cover]``."""


class Sheets(Mapping[str, WornSheet]):
    """The sheets of ``robot.toml`` on the bodies of a MuJoCo model, by the links' names.

    A link's ``frame`` names the body that wears it. The sheet is on the geom with the link's name (:func:`wear` makes
    one), else on every geom of that body. :meth:`step` replaces ``mj_step``. The robot goes on while a program waits,
    as in ``sheets["arm"].board.next()``.

    Args:
      model, data: of MuJoCo; ``data`` is stepped here alone.
      robot: the file, whose ports play no part.
      radius_m, body: R* in m and kind of what touches, one of :data:`contactfpga.cover.BODIES`, by which a contact's
        patch grows with its force (:mod:`contactfpga.design.cover.layers`).
      foam: the layers of cover and body are the spring between the bodies. MuJoCo's own contact should begin below
        it, with ``margin`` = -thickness and ``gap`` = thickness on the geoms.
      golden: zones by the golden model in the place of the gateware.
      bridge: the board's USB chip and its settings; by default that of the iCEBreaker as the driver sets it.
      seed: of the switches' closing forces and the units' noise.

    Raises BodyError for a link that the model lacks, and OSError; with ``foam`` :meth:`step` raises BodyError where a
    soft body (flex) touches a sheet.
    """

    def __init__(
        self,
        model: Any,
        data: Any,
        robot: str | Path,
        *,
        radius_m: float = 0.02,
        body: str = "rigid",
        foam: bool = False,
        golden: bool = False,
        bridge: BridgeSettings | None = None,
        seed: int = 0,
    ):
        self.model, self.data = model, data
        self.body = Body.load(robot)
        if model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4:
            raise BodyError("integrator is RK4, which asks for forces four times a step; take implicitfast")
        covers = _covers(Path(robot))
        bridge = bridge or BridgeSettings(ICEBREAKER.bridge)
        self._worn = {
            name: WornSheet(plan, covers[name], radius_m, BODIES[body], bridge, golden, seed + number)
            for number, (name, plan) in enumerate(self.body.links.items())
        }
        self._bodies = [_body(model, plan) for plan in self.body.links.values()]
        self._owner = _owners(model, self.body, self._bodies)
        self._springs = [worn.indentation for worn in self._worn.values()] if foam else []
        self._steps, self._still_s = 0, LEAD_S
        self._joints, self._history = _joints(model, self.body), JointHistory()
        self._every = max(1, round(1e-3 / model.opt.timestep))
        self._open(seed)

    def _open(self, seed: int) -> None:
        ports = {name: SteppedPort(worn, self.step, seed) for name, worn in self._worn.items()}
        for name, port in ports.items():
            self._worn[name].board = driver.open(port, self._worn[name].skin)
        self._wait()
        for port in ports.values():
            port.still = False

    def _wait(self) -> None:
        """Runs the boards up to :meth:`clock` in small steps, as frames go on coming."""
        for worn in self._worn.values():
            while worn.clock() < self.clock():
                worn.run(min(self.clock(), worn.clock() + LOOK_S))

    # ---- time

    def clock(self) -> float:
        """Seconds since the boards' power-up: LEAD_S at MuJoCo's first step, and more with each :meth:`settle`."""
        return self._still_s + self._steps * float(self.model.opt.timestep)

    def step(self) -> None:
        """Take MuJoCo's next step."""
        model, data = self.model, self.data
        mujoco.mj_step1(model, data)
        if self._steps % self._every == 0:
            self._note_joints()
        self._advance(mujoco.mj_step2)
        self._steps += 1
        for worn in self._worn.values():
            worn.run(self.clock())

    def _advance(self, go: Callable[[Any, Any], None]) -> None:
        """Calls ``go`` with the pushes of foam and fingers in ``qfrc_applied``, which is then the caller's again."""
        data, pushed = self.data, np.zeros(self.model.nv)
        foam = self._push(pushed) if self._springs else {}
        fingers = [self._point(number, pushed) for number in range(len(self._bodies))]
        applied = data.qfrc_applied.copy()
        data.qfrc_applied += pushed
        go(self.model, data)
        data.qfrc_applied[:] = applied
        self._press(foam, fingers)

    def reset(self, key: int = -1) -> None:
        """Reset MuJoCo's state, to the keyframe of this number if there is one, and :meth:`settle`."""
        mujoco.mj_resetDataKeyframe(self.model, self.data, key)
        self.settle()

    def settle(self) -> None:
        """Hold the robot still while the boards run, until programs know what touches now and nothing older.

        Call it after a state of your own, such as ``data.qpos[:] = ...``. MuJoCo's time stands still.
        """
        mujoco.mj_forward(self.model, self.data)
        self._advance(mujoco.mj_forward)
        # Every frame from before is late then, that of a board that has gone silent, too.
        plans = self.body.links.values()
        bounce_us = max(one.skin.debounce_press_us + one.skin.debounce_release_us for one in plans)
        still_s = LEAD_S + 1e-6 * bounce_us + max(one.late_s for one in plans)
        self._history = JointHistory(gap_s=2 * still_s, ahead_s=2 * still_s)
        self._note_joints()
        self._still_s += still_s
        self._wait()

    def _press(self, foam: Mapping[tuple[int, int], Floats], touches: list[list[SheetTouch]]) -> None:
        data, plans = self.data, list(self.body.links.values())
        for number, second, owner in self._contacts():
            one = of_solver(self.model, data, number, second)
            one = one._replace(force_n=one.force_n + foam.get((number, owner), 0.0))
            if one.force_n @ one.inward > 0:
                body = self._bodies[owner]
                touches[owner].append(on_sheet(plans[owner], data.xpos[body], data.xmat[body].reshape(3, 3), one))
        for worn, mine in zip(self._worn.values(), touches):
            worn.press(mine)

    def _contacts(self) -> Iterator[tuple[int, bool, int]]:
        """(contact number, whether the link's geom is second, link number)."""
        if self.data.ncon:
            owners = self._owner[self.data.contact.geom]
            for number, side in np.argwhere(owners >= 0).tolist():
                yield number, side == 1, int(owners[number, side])

    def _point(self, owner: int, pushed: Floats) -> list[SheetTouch]:
        """Adds the fingers' pushes to (nv,) ``pushed``."""
        worn, number, found = list(self._worn.values())[owner], self._bodies[owner], []
        position, rotation = self.data.xpos[number], self.data.xmat[number].reshape(3, 3)
        for one in worn.fingers:
            touch = by_finger(worn.plan, one)
            force, point = rotation @ touch.force_n, position + rotation @ touch.point_m
            mujoco.mj_applyFT(self.model, self.data, force, np.zeros(3), point, number, pushed)
            found.append(touch)
        return found

    def _push(self, pushed: Floats) -> dict[tuple[int, int], Floats]:
        """Adds the foam's push to (nv,) ``pushed``; returns N by contact and link."""
        model, data = self.model, self.data
        found: dict[tuple[int, int], Floats] = {}
        for number, second, owner in self._contacts():
            contact = data.contact[number]
            outward = (-1.0 if second else 1.0) * contact.frame[:3]
            force = -self._springs[owner].force_n(-contact.dist) * outward
            found[number, owner] = force
            if contact.geom.min() < 0:  # a flex, whose force its corners would share
                raise BodyError("a soft body touches a sheet, and foam=True pushes rigid ones alone; take foam=False")
            mine, other = contact.geom[int(second)], contact.geom[int(not second)]
            for geom, sign in ((mine, 1.0), (other, -1.0)):
                mujoco.mj_applyFT(
                    model, data, sign * force, np.zeros(3), contact.pos, int(model.geom_bodyid[geom]), pushed
                )
        return found

    def _note_joints(self) -> None:
        if self._joints:
            angles = {name: float(self.data.qpos[address]) for name, address in self._joints.items()}
            self._history.add(self.clock(), angles)

    # ---- what the host knows

    def snapshot(self) -> Snapshot:
        """All links as a program knows them now, like :meth:`contactfpga.body.OpenBody.latest`: touches at the scan of
        the newest frames."""
        observed = {name: worn.observe() for name, worn in self._worn.items()}
        states = States(self.body.links, observed, self.clock())
        return Snapshot(self.body, self.clock(), states, self._history if self._joints else None)

    def __getitem__(self, name: str) -> WornSheet:
        return self._worn[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._worn)

    def __len__(self) -> int:
        return len(self._worn)

    # ---- its end

    def __enter__(self) -> Sheets:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close every board; may be called twice."""
        for worn in self._worn.values():
            worn.board.close()


def _covers(path: Path) -> dict[str, Cover]:
    links = tomlfile.load(path, BodyError)["links"]
    return {one["name"]: load_cover(path.parent / one["skin"]) or COVER for one in links}


def _body(model: Any, plan: Plan) -> int:
    number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, plan.frame)
    if number < 0:
        raise BodyError(f"link {shown(plan.name)}: frame is {shown(plan.frame)}; the model has no such body")
    return int(number)


def _owners(model: Any, body: Body, bodies: list[int]) -> Floats:
    """Link number by geom, -1 for none; the last is for contacts without a geom."""
    owner = np.full(model.ngeom + 1, -1)
    for number, (name, of) in enumerate(zip(body.links, bodies)):
        geom = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name)
        wearing = [geom] if geom >= 0 else np.flatnonzero(model.geom_bodyid == of)
        if not len(wearing):
            raise BodyError(f"link {shown(name)}: its body has no geom; wear(spec, body) makes one")
        owner[wearing] = number
    return owner


def _joints(model: Any, body: Body) -> dict[str, int]:
    """Index in ``qpos`` by URDF joint; empty without a URDF."""
    found: dict[str, int] = {}
    for name in body.kinematics.joint_names if body.kinematics else ():
        number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
        if number < 0:
            raise BodyError(f"the URDF's joint {shown(name)} is not in the model")
        found[name] = int(model.jnt_qposadr[number])
    return found
