"""Answers for many frames at once, as arrays."""

from __future__ import annotations

import numpy as np

from contactfpga.robot.haptics.wrench import Cylinder, Noise, Plane, Surface
from contactfpga.surfaces.shapes import Floats


def centers(surface: Surface, wrenches: Floats) -> Floats:
    """(m, 3) centers of pressure of (m, 6) wrenches in N and Nm; NaN without push."""
    fx, fy, fz, mx, my, mz = np.asarray(wrenches, float).T
    with np.errstate(invalid="ignore", divide="ignore"):
        if isinstance(surface, Plane):
            h = surface.height_m
            found = np.stack([(h * fx - my) / fz, (h * fy + mx) / fz, np.full(len(fz), h)], axis=1)
            found[~(fz < 0)] = np.nan
            return found
        return _on_cylinder(surface, fx, fy, fz, mx, my, mz)


def _on_cylinder(surface: Cylinder, fx: Floats, fy: Floats, fz: Floats, mx: Floats, my: Floats, mz: Floats) -> Floats:
    radius = surface.radius_m
    across = mz / radius
    inward = fx * fx + fy * fy - across * across
    push = -np.sqrt(np.where(inward > 0, inward, np.nan))
    angle = np.arctan2(fy, fx) - np.arctan2(across, push)
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.stack([radius * cosine, radius * sine, (my * cosine - mx * sine + radius * fz) / push], axis=1)


def one(wrenches: Floats, points: Floats, noise: Noise | None = None) -> Floats:
    """(m, 3) forces of one contact for each of (m, 6) wrenches, at known (m, 3) points."""
    wrenches, points = np.asarray(wrenches, float), np.asarray(points, float)
    if noise is None:
        return wrenches[:, :3].copy()
    exerts = _exerts(points[:, None])
    weighted = exerts.transpose(0, 2, 1) @ noise.information
    return np.asarray(np.linalg.solve(weighted @ exerts, weighted @ wrenches[:, :, None])[:, :, 0])


def two(
    wrenches: Floats, points: Floats, normals: Floats, friction: float, noise: Noise | None = None
) -> tuple[Floats, Floats]:
    """(m, 2, 3) forces and (m, 2, 2) intervals of the pushes at two known points.

    ``points`` and outward unit ``normals`` are (m, 2, 3). Unbounded pushes are infinite; NaN stands where friction
    allows no forces. Intervals exclude the units' noise.
    """
    wrenches, points, normals = (np.asarray(each, float) for each in (wrenches, points, normals))
    away = points[:, 0] - points[:, 1]
    along = away / np.linalg.norm(away, axis=1)[:, None]
    starts = _least_norm(wrenches, points, along, noise)
    sides = np.stack([along, -along], axis=1)
    push, more = -(normals * starts).sum(axis=2), -(normals * sides).sum(axis=2)
    low, high = _allowed(starts, sides, push, more, friction)
    low, high = low.max(axis=1), high.min(axis=1)
    low, high = np.where(low <= high, low, np.nan), np.where(low <= high, high, np.nan)
    curve, slope = (1 - more * more).sum(axis=1), ((starts * sides).sum(axis=2) - push * more).sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        best = np.clip(-slope / curve, low, high)
        best = np.where(curve > 1e-9, best, np.where(more.sum(axis=1) > 0, low, high))
        ends = push[:, :, None] + more[:, :, None] * np.stack([low, high], axis=1)[:, None]
        ends = np.where((np.abs(more) > 1e-9)[:, :, None], ends, push[:, :, None])
    return starts + best[:, None, None] * sides, np.maximum(np.sort(ends, axis=2), 0.0)


def _exerts(points: Floats) -> Floats:
    """(m, 6, 3k): from forces at (m, k, 3) points to wrenches."""
    count, contacts = points.shape[:2]
    found = np.zeros((count, 6, contacts, 3))
    for axis in range(3):
        found[:, axis, :, axis] = 1.0
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    found[:, 3, :, 1], found[:, 3, :, 2] = -z, y
    found[:, 4, :, 0], found[:, 4, :, 2] = z, -x
    found[:, 5, :, 0], found[:, 5, :, 1] = -y, x
    return found.reshape(count, 6, 3 * contacts)


def _least_norm(wrenches: Floats, points: Floats, along: Floats, noise: Noise | None) -> Floats:
    if noise is None:
        center = points.mean(axis=1)
        wrenches = np.concatenate([wrenches[:, :3], wrenches[:, 3:] - np.cross(center, wrenches[:, :3])], axis=1)
        points = points - center[:, None]
        size = np.sqrt((points**2).sum(axis=(1, 2)) / 2)
        weight = np.zeros((len(points), 6, 6))
        weight[:, range(3), range(3)] = 1.0
        weight[:, range(3, 6), range(3, 6)] = 1 / size[:, None] ** 2
    else:
        weight = np.broadcast_to(noise.information, (len(points), 6, 6))
    exerts = _exerts(points)
    weighted = exerts.transpose(0, 2, 1) @ weight
    normal = weighted @ exerts
    null = np.concatenate([along, -along], axis=1) / np.sqrt(2)
    normal += normal[:, :1, :1] * null[:, :, None] * null[:, None]
    return np.asarray(np.linalg.solve(normal, weighted @ wrenches[:, :, None]).reshape(-1, 2, 3))


def _allowed(starts: Floats, sides: Floats, push: Floats, more: Floats, friction: float) -> tuple[Floats, Floats]:
    """(m, 2) least and largest squeezes that friction allows; NaN if none."""
    wide = 1 + friction**2
    square = 1 - wide * more**2
    square = np.where(np.abs(square) < 1e-12, 1e-12, square)
    slope = (starts * sides).sum(axis=2) - wide * push * more
    level = (starts**2).sum(axis=2) - wide * push**2
    under = slope**2 - square * level
    with np.errstate(invalid="ignore"):
        root = np.sqrt(np.where(np.abs(under) <= 1e-9 * (slope**2 + np.abs(square * level)), 0.0, under))
    low, high = (-slope - root) / square, (-slope + root) / square
    low, high = np.minimum(low, high), np.maximum(low, high)
    inside = (square > 0) & (push - more * slope / square >= -1e-9 * np.abs(push))
    upward = (square < 0) & (more > 0)
    downward = (square < 0) & (more <= 0)
    least = np.select([inside, upward, downward], [low, high, -np.inf], np.nan)
    most = np.select([inside, upward, downward], [high, np.inf, low], np.nan)
    return least, most
