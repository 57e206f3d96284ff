"""JVRC-1 leans with its left forearm on a table or a rail and is pushed from behind.

Legs, trunk and right arm are stiff. They turn about the ankles, whose torque is at most what the feet can take, and
four joints of the left arm have their torques of the URDF. One controller asks for a moment about the ankles and shares
it out between ankles and forces on the table. The ways differ only in the places at which it may exert these forces.
"""

from __future__ import annotations

import copy
import functools
import itertools
import math
import tempfile
from pathlib import Path

import mujoco
import numpy as np
from scipy.optimize import nnls

from contactfpga.design.cover import Cells
from contactfpga.robot.body import Body, ContactSurfaces, polygons
from contactfpga.robot.body.kinematics import rotation_about
from contactfpga.surfaces.shapes import Floats
from contactfpga_sim.apps import pool
from contactfpga_sim.lab.body.folding import frame_of
from contactfpga_sim.lab.support import compute
from contactfpga_sim.lab.support.bed import COVER, FOAM_M, LINKS, PITCH_MM, Bed, Thing, humanoid, write_robot

WAYS = ("without skin", "barycenter", "rectangle", "polygon")
DIRECTIONS_DEG, POINTS_M = (-40.0, 0.0, 40.0), ((-0.1, 0.2), (0.0, 0.2), (0.0, 0.4))
"""Directions of pushes, to the left of straight ahead, and the points of the trunk on which they act: y, and z above
the waist's joint. The left arm braces, so the first direction is away from it."""
PUSHES = len(DIRECTIONS_DEG) * len(POINTS_M)
IMPULSES_NS = tuple(10.0 * number for number in range(16))
SEEDS = 45
"""Robots on a table or a rail of their own; each direction and point has as many."""

STEP_S, CONTROL_STEPS = 2e-3, 5
SETTLED_S, PUSH_S, AFTER_S = 0.5, 0.1, 3.0
UPRIGHT = 0.8
LEAN_RAD, SHOULDER_RAD, ANKLE_M = 0.2, -0.5, (0.02, 0.0, -0.746)
ARM = ("L_SHOULDER_P", "L_SHOULDER_R", "L_SHOULDER_Y", "L_ELBOW_P")
ANKLE_NM, ARM_NM = 50.0, 100.0
"""Largest torques: 62 kg on feet of 8 cm to each side of the ankles, and of the URDF."""
BALANCE, POSTURE = (300.0, 210.0), (30.0, 3.0)
"""Stiffness in Nm/rad and damping in Nms/rad of the wanted moment, and of the arm's joints."""
FRICTION, TRUSTED_FRICTION = 0.5, 0.3
BRISTLE_N_M, BRISTLE_NS_M, FOAM_NS_M = 2e3, 5.0, 8.0
"""For each place of the bed: stiffness and damping of friction, and damping of the foam."""
BELOW = 0.4
"""Least cosine between straight down and the normal of what may touch the table, in the forearm that leans."""
SPREADS, SEARCH_N = 1e-3, 15.0
"""Weight of the squared forces in N2 beside squared moments in Nm2, and push where no contact is known."""
RAYS = np.array([[TRUSTED_FRICTION, 0, -TRUSTED_FRICTION, 0], [0, TRUSTED_FRICTION, 0, -TRUSTED_FRICTION], [1.0] * 4])
"""(3, 4): the forces, as columns, of which the controller adds up what the table exerts at a place."""


@functools.cache
def _model() -> tuple[mujoco.MjModel, Bed, Floats]:
    """The robot, the bed of its forearm, and the angles in which it leans."""
    with tempfile.TemporaryDirectory() as folder:
        body = Body.load(write_robot(Path(folder), ["forearm"], units=False))
    spec = humanoid(body)
    for coupling in spec.equalities:
        spec.delete(coupling)
    for joint in spec.joints:
        if joint.name not in ARM:
            spec.delete(joint)
    for name, axis in (("pitch", [0, 1, 0]), ("roll", [1, 0, 0])):
        spec.body("base_link").add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis, pos=ANKLE_M)
    spec.option.timestep = STEP_S
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model = spec.compile()
    angles = {"pitch": LEAN_RAD, "L_SHOULDER_P": SHOULDER_RAD, "L_ELBOW_P": -math.pi / 2 - LEAN_RAD - SHOULDER_RAD}
    rest = np.array([angles.get(model.joint(number).name, 0.0) for number in range(model.nq)])
    bed = Bed(body.links["forearm"], 2)
    bed.keep(-bed.normals[:, 0] > BELOW)
    return model, bed, rest


def _turning(vector: Floats) -> Floats:
    """(3, 3): the matrix whose product with another vector is the cross product."""
    x, y, z = vector.tolist()
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


class Braced:
    """One robot on its table."""

    def __init__(self, way: str, seed: int):
        self.way, rng = way, np.random.default_rng([57, seed])
        self.model, self.bed, self.rest = _model()
        self.data = mujoco.MjData(self.model)
        self.data.qpos[:] = self.rest
        mujoco.mj_forward(self.model, self.data)
        self.plan = self.bed.plan
        self.link = self.data.body(self.plan.frame)
        self.lines = self.plan.skin.rows
        self.closes_n = Cells(COVER, self.lines, self.lines, 1e-3 * PITCH_MM, 1e-3 * PITCH_MM, seed).thresholds_n
        self.cells = np.zeros((self.lines, self.lines), bool)
        self.slid_m = np.zeros((len(self.bed.points_m), 3))
        self.tips_m = self.bed.points_m + FOAM_M * self.bed.normals
        self.top_m = float(self.link.xpos[2]) - 1e-3 * LINKS["forearm"][1] + 5e-4
        self.thing = self._table(rng)
        middle = 1e-3 * (self.lines - 1) / 2 * PITCH_MM
        ends = np.array([[x, y] for x in (-0.01, 0.01) for y in (0.0, 2 * middle)])
        self.planned = np.array([self.plan.place(1e3 * (middle + x), 1e3 * y)[0] for x, y in ends])
        self.known = b"", np.zeros((0, 3))
        self.surfaces = ContactSurfaces(self.plan.skin.sheet, COVER, surface=self.plan.laid, pose=self.plan.pose)
        self.linear, self.angular = np.zeros((3, self.model.nv)), np.zeros((3, self.model.nv))
        self.head_m = self._head()
        for _ in range(round(SETTLED_S / STEP_S)):
            self._step()
        self.settled = copy.copy(self.data), self.slid_m.copy()

    def _table(self, rng: np.random.Generator) -> Thing:
        """A table whose edge crosses the forearm, or a rail across it, at a random place and angle."""
        edge = rng.random() < 0.5
        half = np.array([0.4 if edge else rng.uniform(0.015, 0.04), 0.6, 0.1])
        along = rng.uniform(0.02, 0.15) + half[0] if edge else rng.uniform(0.05, 0.17)
        turn = rotation_about((0, 0, 1), rng.uniform(-0.7, 0.7))
        crossing = self.link.xpos + [along - half[0] if edge else along, 0, 0]
        away = turn @ [half[0] if edge else 0.0, 0, 0]
        return Thing(tuple(half.tolist()), turn, np.array([*(crossing + away)[:2], self.top_m - half[2]]))

    def _head(self) -> float:
        """Height of the head above the ankles."""
        head = self.data.body("NECK_P_S")
        return float((head.xpos + head.xmat.reshape(3, 3) @ [0, 0, 0.2])[2] - ANKLE_M[2])

    # ---- the table

    def press(self) -> None:
        """Push the forearm by the bed and by friction, and close the cells."""
        bed, rotation = self.bed, self.link.xmat.reshape(3, 3)
        near = np.flatnonzero(self.tips_m @ rotation[2] + self.link.xpos[2] < self.top_m)
        force = bed.forces_n(bed.depths_m([self.thing], self.link.xpos, rotation, near))
        at, force = near[force > 0], force[force > 0]
        arms, normals = bed.points_m[at] @ rotation.T, bed.normals[at] @ rotation.T
        moves = self.linear @ self.data.qvel + arms @ _turning(self.angular @ self.data.qvel).T
        inward = (moves * normals).sum(axis=1)
        push = np.maximum(force + FOAM_NS_M * inward, 0.0)
        aside = moves - inward[:, None] * normals
        slid = self.slid_m[at] + STEP_S * aside
        drag = -BRISTLE_N_M * slid - BRISTLE_NS_M * aside
        size = np.linalg.norm(drag, axis=1)
        holds = np.minimum(1.0, FRICTION * push / np.maximum(size, 1e-9))
        self.slid_m[:] = 0.0
        self.slid_m[at] = slid * holds[:, None]
        each = drag * holds[:, None] - push[:, None] * normals
        moments = (arms + self.link.xpos - self.link.xipos).T @ each
        turn = moments - moments.T
        self.link.xfrc_applied[:] = [*each.sum(axis=0), turn[1, 2], turn[2, 0], turn[0, 1]]
        self.cells = bed.cells_n(force, at) >= self.closes_n

    # ---- the controller

    def places(self) -> Floats:
        """(n, 3): where forces may act, in the link's frame; (0, 3) if the skin feels nothing."""
        if self.way == "without skin":
            return self.planned
        if self.cells.tobytes() != self.known[0]:
            zones = frame_of(self.cells, self.plan.skin.sheet)
            if self.way == "rectangle":
                zones = compute.extents_of(self.cells, PITCH_MM)
            supports = self.surfaces.supports(zones)
            found = [one.center_m[None] if self.way == "barycenter" else one.corners_m for one in supports]
            self.known = self.cells.tobytes(), np.concatenate([np.zeros((0, 3)), *found])
        return self.known[1]

    def control(self) -> Floats:
        """(nv,): torques."""
        data, rotation = self.data, self.link.xmat.reshape(3, 3)
        off, bias = self.rest - data.qpos, data.qfrc_bias
        body, arm = ([self.model.joint(name).dofadr[0] for name in names] for names in (("pitch", "roll"), ARM))
        wanted = bias[body] + BALANCE[0] * off[body] - BALANCE[1] * data.qvel[body]
        places = self.places()
        known = len(places) > 0
        arms = (places if known else self.planned.mean(axis=0)[None]) @ rotation.T
        corners = polygons.hull((x, y) for x, y, _ in arms.tolist())
        at = np.column_stack([corners, np.full(len(corners), arms[:, 2].mean())])
        exerts = np.concatenate([self.linear.T @ RAYS + self.angular.T @ _turning(one) @ RAYS for one in at], axis=1)
        rest = wanted - np.clip(wanted, -ANKLE_NM / 2, ANKLE_NM / 2)
        if known:
            spread = math.sqrt(SPREADS) * np.eye(exerts.shape[1])
            share, _ = nnls(np.vstack([exerts[body], spread]), np.concatenate([rest, np.zeros(len(spread))]))
        else:
            share = np.full(exerts.shape[1], SEARCH_N / exerts.shape[1])
        torque, asked = bias + POSTURE[0] * off - POSTURE[1] * data.qvel, exerts @ share
        # Beyond the arm's torques all forces shrink together. Cut one by one, the rest would push elsewhere.
        room = (ARM_NM + np.sign(asked) * torque)[arm] / np.maximum(np.abs(asked[arm]), 1e-9)
        asked *= np.clip(room.min(), 0.0, 1.0)
        torque = np.clip(torque - asked, -ARM_NM, ARM_NM)
        torque[body] = np.clip(wanted - asked[body], -ANKLE_NM, ANKLE_NM)
        return torque

    def _step(self) -> None:
        model, data = self.model, self.data
        mujoco.mj_step1(model, data)
        mujoco.mj_jac(model, data, self.linear, self.angular, self.link.xpos, self.link.id)
        self.press()
        if round(data.time / STEP_S) % CONTROL_STEPS == 0:
            data.qfrc_applied[:] = self.control()
        mujoco.mj_step2(model, data)

    def stands(self, impulse_ns: float, direction_deg: float, point_m: tuple[float, float]) -> bool:
        """Whether the robot, once it has settled, is upright from the push on until :data:`AFTER_S` after it."""
        trunk, angle = self.data.body("WAIST_R_S"), math.radians(direction_deg)
        mujoco.mj_copyData(self.data, self.model, self.settled[0])
        self.slid_m[:] = self.settled[1]
        force = impulse_ns / PUSH_S * np.array([math.cos(angle), math.sin(angle), 0.0])
        for step in range(round((PUSH_S + AFTER_S) / STEP_S)):
            arm = trunk.xmat.reshape(3, 3) @ [0.0, *point_m] + trunk.xpos - trunk.xipos
            trunk.xfrc_applied[:] = [*force, *np.cross(arm, force)] if step * STEP_S < PUSH_S else 0.0
            self._step()
            if not self._head() > UPRIGHT * self.head_m:
                return False
        return True


def survived(way: str, seed: int) -> float:
    """The largest of :data:`IMPULSES_NS` that this robot stands, by halving: it falls at all that are larger than one
    at which it falls. -1 if it does not stand at all."""
    direction, point = list(itertools.product(DIRECTIONS_DEG, POINTS_M))[seed % PUSHES]
    braced, low, high = Braced(way, seed), -1, len(IMPULSES_NS)
    while high - low > 1:
        middle = (low + high) // 2
        stands = braced.stands(IMPULSES_NS[middle], direction, point)
        low, high = (middle, high) if stands else (low, middle)
    return IMPULSES_NS[low] if low >= 0 else -1.0


def survive_all() -> dict[str, list[float]]:
    """:func:`survived` of all seeds by way."""
    robots = itertools.product(WAYS, range(SEEDS))
    with pool.executor() as workers:
        found = iter(list(workers.map(survived, *zip(*robots))))
    return {way: [next(found) for _ in range(SEEDS)] for way in WAYS}
