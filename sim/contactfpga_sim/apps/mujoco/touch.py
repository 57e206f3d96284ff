"""MuJoCo's contacts as places on the sheet laid flat, with forces."""

from __future__ import annotations

from typing import Any, NamedTuple

import mujoco
import numpy as np

from contactfpga.robot.body.plan import Plan
from contactfpga.surfaces.shapes import Floats, Vector, vector
from contactfpga.tools.view.fingers import Finger

SLANT = 0.5
"""Least cosine between contact and sheet normals at which the cover is pressed, not another side."""


class SheetTouch(NamedTuple):
    """A contact point on a link that wears a sheet."""

    contact: int
    """Index in ``data.contact``; -1 for a finger."""
    point_m: Vector
    """Point in the link's frame."""
    force_n: Vector
    """Force on the link in its frame, with friction."""
    push_n: float
    """Force along the normal, 0 or above."""
    x_mm: float | None
    """Place on the flat sheet; None beside it."""
    y_mm: float | None


class ContactForce(NamedTuple):
    """Force of a contact on the link, in the world's frame."""

    contact: int
    point_m: Floats
    inward: Floats
    """Unit normal into the link."""
    force_n: Floats


def of_solver(model: Any, data: Any, number: int, second: bool) -> ContactForce:
    """The solver's force; ``second``: on the contact's second geom."""
    contact, wrench = data.contact[number], np.zeros(6)
    mujoco.mj_contactForce(model, data, number, wrench)
    frame, sign = contact.frame.reshape(3, 3), 1.0 if second else -1.0
    return ContactForce(number, contact.pos.copy(), sign * frame[0], sign * (frame.T @ wrench[:3]))


def on_sheet(plan: Plan, position_m: Floats, rotation: Floats, one: ContactForce) -> SheetTouch:
    """A contact on a link at ``position_m``, turned by (3, 3) ``rotation``."""
    point, force = rotation.T @ (one.point_m - position_m), rotation.T @ one.force_n
    push = float(one.force_n @ one.inward)
    place = _place(plan, point, rotation.T @ one.inward)
    return SheetTouch(one.contact, vector(point), vector(force), push, *(place or (None, None)))


def by_finger(plan: Plan, finger: Finger) -> SheetTouch:
    """A finger that pushes the link along the sheet's normal."""
    point, normal = plan.place(finger.x_mm, finger.y_mm)
    force = vector(-finger.force_n * np.array(normal))
    return SheetTouch(-1, vector(np.array(point)), force, finger.force_n, finger.x_mm, finger.y_mm)


def _place(plan: Plan, point_m: Floats, inward: Floats) -> tuple[float, float] | None:
    """Place in mm on the flat sheet; None beside it, or on its wearer's other sides."""
    skin, pose = plan.skin, plan.pose
    x, y = plan.laid.flat(vector(1e3 * ((point_m - pose.point_m) @ pose.rotation)))
    width, height = skin.columns * skin.pitch_x_mm, skin.rows * skin.pitch_y_mm
    if around := _around_mm(plan):
        x = (x + skin.pitch_x_mm / 2) % around - skin.pitch_x_mm / 2
    if not (0 <= x + skin.pitch_x_mm / 2 <= width and 0 <= y + skin.pitch_y_mm / 2 <= height):
        return None
    _, normal = plan.place(x, y)
    return (x, y) if -float(inward @ np.array(normal)) >= SLANT else None


def _around_mm(plan: Plan) -> float:
    """Circumference of a cylinder with an open turn; else 0."""
    skin = plan.skin
    if skin.closed:
        return skin.columns * skin.pitch_x_mm
    radius = getattr(plan.surface, "radius_mm", None)
    return 2 * np.pi * radius if radius and not hasattr(plan.surface, "slope") else 0.0
