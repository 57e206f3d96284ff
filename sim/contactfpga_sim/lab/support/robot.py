"""JVRC-1 leans its forearm, thigh and shin on edges, corners, plates and bars.

MuJoCo moves the robot, whose joints are springs, against the bed of its foam. The compiled gateware scans the switches
that the foam closes, its bytes go to the driver by the USB chip's model, and the supports are those of a snapshot.
"""

from __future__ import annotations

import contextlib
import dataclasses
import math
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
from scipy import ndimage

from contactfpga.errors import ReadTimeout
from contactfpga.mujoco import Sheets, wear
from contactfpga.robot.body import Body, ContactSurfaces, LinkState, Snapshot, Support
from contactfpga.robot.body.kinematics import Pose, rotation_about
from contactfpga.robot.body.plan import Plan
from contactfpga.surfaces.shapes import Floats
from contactfpga.tools.view.fingers import Finger
from contactfpga.zones.zone import Zones
from contactfpga_sim.apps import pool
from contactfpga_sim.lab.benchmark.pressed import Patches
from contactfpga_sim.lab.support import compute
from contactfpga_sim.lab.support.bed import COVER, LINKS, PITCH_MM, Bed, Thing, humanoid, write_robot

KINDS = ("edge", "corner", "plate", "bar")
POSES, PIECE = 200, 10
"""Poses, in each of which all links lean, and poses per piece of work."""
PER, SETTLING = 3, 12
"""Places of the bed per pitch, and steps of 1 ms in which robot and foam move."""
STIFF_NM, DAMPED_NMS = 3e3, 100.0
"""Springs and dampers of the joints, per rad."""
FORCE_N, APART_MM = (60.0, 300.0), 60.0
STALE_S, READ_S = 2e-3, 15e-3
"""Time after a touch in which frames may be older, and time of reading."""


class Lean(NamedTuple):
    """One link that leans."""

    link: str
    kind: str
    """One of :data:`KINDS`, or ``several``."""
    outcome: compute.Outcome
    alone: list[bool]
    """For each component of the wrench of a zone that is the only one: whether it is within its interval. Without
    zones whose wrench is not known."""
    among: list[bool]
    """The same of several zones, each with the force on the cells nearest to it."""


def thing(kind: str, rng: np.random.Generator, point_m: Floats, normal: Floats) -> Thing:
    """A thing that touches a place on the sheet from outside, turned at random."""
    aside = np.cross(normal, [0.0, 0.0, 1.0])
    frame = np.stack([np.cross(aside, normal), aside, normal], axis=1) @ rotation_about(
        (0, 0, 1), rng.uniform(0, 2 * math.pi)
    )
    if kind == "bar":
        radius = float(rng.uniform(8e-3, 20e-3))
        return Thing(radius, frame, point_m + radius * normal)
    if kind == "edge":
        frame = frame @ rotation_about((1, 0, 0), rng.uniform(0.35, 1.2))
        half, toward = np.array([0.2, 0.05, 0.05]), (0, -1, -1)
    else:
        tilt = rotation_about((1, 0, 0), rng.uniform(-0.05, 0.05)) @ rotation_about((0, 1, 0), rng.uniform(-0.05, 0.05))
        frame = frame @ tilt
        half = np.append(rng.uniform(0.02, 0.04, 2) if kind == "plate" else (0.1, 0.1), 0.02)
        toward = (0, 0, -1) if kind == "plate" else (-1, -1, -1)
    return Thing(tuple(half.tolist()), frame, point_m - frame @ (half * toward))


def pressed(one: Thing, bed: Bed, normal: Floats, force_n: float) -> Thing:
    """The thing, moved along the normal until it presses with this force on a link at the origin."""

    def moved(by_m: float) -> Thing:
        return dataclasses.replace(one, point_m=one.point_m - by_m * normal)

    low, high = -0.03, 0.01
    for _ in range(18):
        middle = (low + high) / 2
        force = bed.forces_n(bed.depths_m([moved(middle)], np.zeros(3), np.eye(3))).sum()
        low, high = (middle, high) if force < force_n else (low, middle)
    return moved(low)


def drawn(plan: Plan, bed: Bed, rng: np.random.Generator) -> tuple[str, list[Thing]]:
    """Things in the link's frame, one or several, and their kind."""
    count = int(rng.choice([1, 1, 2, 3]))
    kinds, places = rng.choice(KINDS, count), np.zeros((0, 2))
    while len(places) < count:
        place = rng.uniform(4 * PITCH_MM, (plan.skin.columns - 5) * PITCH_MM, 2)
        if (np.hypot(*(places - place).T) > APART_MM).all():
            places = np.append(places, place[None], axis=0)
    found = []
    for kind, (x, y) in zip(kinds, places.tolist()):
        point, normal = (np.array(each) for each in plan.place(x, y))
        found.append(pressed(thing(kind, rng, point, normal), bed, normal, rng.uniform(*FORCE_N) / count))
    return str(kinds[0]) if count == 1 else "several", found


class Stand:
    """JVRC-1 in MuJoCo, its pelvis held, with sheets on some of :data:`LINKS`."""

    def __init__(self, folder: Path, names: Sequence[str], seed: int):
        """``seed``: of the switches' forces and the units' noise."""
        path = write_robot(folder, names, units=True)
        self.plans = Body.load(path).links
        spec = humanoid(Body.load(path))
        spec.option.timestep = 1e-3
        wear(spec, path)
        self.model = spec.compile()
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT  # the bed presses in their place
        self.data = mujoco.MjData(self.model)
        self.model.jnt_stiffness[:], self.model.dof_damping[:] = STIFF_NM, DAMPED_NMS
        self.sheets = Sheets(self.model, self.data, path, radius_m=1e-4, seed=seed)
        self.beds = {name: Bed(plan, PER) for name, plan in self.plans.items()}

    def lean(self, number: int) -> list[Lean]:
        """All links lean on things drawn with this number."""
        rng, data = np.random.default_rng([56, number]), self.data
        data.qpos[:] = self.model.qpos_spring[:] = rng.uniform(-0.3, 0.3, self.model.nq)
        data.qvel[:] = 0
        mujoco.mj_kinematics(self.model, data)
        kinds, things = {}, {}
        for name, plan in self.plans.items():
            kinds[name], found = drawn(plan, self.beds[name], rng)
            pose = self._pose(plan)
            things[name] = [Thing(one.half_m, pose.turn(one.rotation.T).T, pose.apply(one.point_m)) for one in found]
        data.qfrc_applied[:] = 0
        for name in things:
            self._press(name, things[name])
        mujoco.mj_forward(self.model, data)
        pushed = np.zeros(self.model.nv)
        for plan in self.plans.values():
            link = data.body(plan.frame)
            mujoco.mj_applyFT(self.model, data, *np.split(link.xfrc_applied, 2), link.xipos, link.id, pushed)
        data.qfrc_applied[:] = data.qfrc_bias - pushed  # the motors carry weight and support
        for _ in range(SETTLING):
            there = {name: self._press(name, things[name]) for name in things}
            mujoco.mj_step(self.model, data)
        data.xfrc_applied[:] = 0
        for name in things:
            self.sheets[name].touch(_fingers(there[name]))
        self.sheets.step()
        frames = {name: self._read(name) for name in things}
        states = {name: LinkState(zones, 0.0, "ok", frame_s=0.0) for name, zones in frames.items()}
        snapshot = Snapshot(self.sheets.body, 0.0, states)
        leant = []
        for name, zones in frames.items():
            if not there[name].force_n.any():
                continue  # the link sprang off
            supports, cells = snapshot.supports("link", [name]), zones.cells
            assert cells is not None
            flat = [flattened(one, self.plans[name]) for one in supports]
            extents = compute.extents_of(cells, PITCH_MM)
            rectangles = ContactSurfaces(extents.sheet, COVER).supports(extents)
            judged = compute.outcome(compute.Drawn(there[name], cells, flat, rectangles), PITCH_MM)
            leant.append(Lean(name, kinds[name], judged, *self._wrenches(name, cells, supports, zones)))
        return leant

    def _pose(self, plan: Plan) -> Pose:
        return Pose(self.data.body(plan.frame).xmat.reshape(3, 3).copy(), self.data.body(plan.frame).xpos.copy())

    def _press(self, name: str, things: list[Thing]) -> Patches:
        """Let the bed push the link in the next step."""
        bed, plan = self.beds[name], self.plans[name]
        pose = self._pose(plan)
        force = bed.forces_n(bed.depths_m(things, pose.point_m, pose.rotation))
        at = force > 0
        each = -force[at, None] * pose.turn(bed.normals[at])
        body = self.data.body(plan.frame)
        arms = pose.apply(bed.points_m[at]) - body.xipos
        body.xfrc_applied[:] = [*each.sum(axis=0), *np.cross(arms, each).sum(axis=0)]
        return Patches(force.reshape(len(bed.y_mm), -1), bed.x_mm, bed.y_mm, PER)

    def _read(self, name: str) -> Zones:
        """The newest frame with readings, all of it from after the touch."""
        worn = self.sheets[name]
        from_us = 1e6 * (worn.clock() + STALE_S)
        worn.run(worn.clock() + READ_S)
        found = None
        with contextlib.suppress(ReadTimeout):
            while True:
                zones = worn.board.next(0)
                if zones.units and min(zones.time_us, zones.units.time_us) > from_us:
                    found = zones
        assert found is not None
        return found

    def _wrenches(
        self, name: str, cells: np.ndarray, supports: list[Support], zones: Zones
    ) -> tuple[list[bool], list[bool]]:
        """The components of :attr:`Lean.alone` and :attr:`Lean.among`."""
        labels = ndimage.label(cells)[0]
        nearest = ndimage.distance_transform_edt(labels == 0, return_distances=False, return_indices=True)
        shares: dict[int, Floats] = {}
        for touch in self.sheets[name].touches:
            row, column = (
                min(max(round(place / PITCH_MM), 0), len(cells) - 1) for place in (touch.y_mm or 0.0, touch.x_mm or 0.0)
            )
            label = int(labels[nearest[0, row, column], nearest[1, row, column]])
            six = np.concatenate([touch.force_n, np.cross(touch.point_m, touch.force_n)])
            shares[label] = shares.get(label, np.zeros(6)) + six
        hits = []
        for one in supports:
            true, between = shares[int(labels[zones.cells_of(one.zone)].max())], one.wrench_interval
            if between is None:
                continue  # a unit is at its limit
            hits += [bool(low <= value <= high) for value, (low, high) in zip(true, between)]
        return (hits, []) if len(supports) == 1 else ([], hits)


def _fingers(there: Patches) -> list[Finger]:
    """A finger for each cell, at the center of what presses there."""
    force = there.cells_n
    at = force > 0
    places = [
        there._replace(force_n=there.force_n * places).cells_n[at] / force[at]
        for places in (there.x_mm, there.y_mm[:, None])
    ]
    return [Finger(x, y, 0.0, push) for x, y, push in np.stack([*places, force[at]], axis=1).tolist()]


def flattened(support: Support, plan: Plan) -> Support:
    """The support with its polygon on the sheet laid flat."""
    own = (support.corners_m - plan.pose.point_m) @ plan.pose.rotation
    radius = 1e-3 * float(plan.skin.radius_mm or 0.0)
    middle = 5e-4 * (plan.skin.columns - 1) * plan.skin.pitch_x_mm / radius
    angle = (np.arctan2(own[:, 1], own[:, 0]) - middle + math.pi) % (2 * math.pi) - math.pi + middle
    return dataclasses.replace(support, corners_m=np.stack([radius * angle, own[:, 2], 0 * angle], axis=1))


def leans(first: int) -> list[Lean]:
    """The leans of a piece of work, whose first pose has this number, on sheets of its own."""
    with tempfile.TemporaryDirectory() as folder:
        stand = Stand(Path(folder), list(LINKS), first)
    with stand.sheets:
        return [one for number in range(first, first + PIECE) for one in stand.lean(number)]


def lean_all() -> list[Lean]:
    """All leans of :data:`POSES`."""
    with pool.executor() as workers:
        return [one for piece in workers.map(leans, range(0, POSES, PIECE)) for one in piece]
