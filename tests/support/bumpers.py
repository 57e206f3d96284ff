"""Bumpers and loads of the tests of contactfpga.robot.haptics, written without its code."""

import numpy as np

from contactfpga.robot.haptics import LoadCells, Touch, Unit, Wrench, contacts
from contactfpga.wire.protocol import Frame
from contactfpga.zones.units import UnitSamples
from contactfpga.zones.zone import Zones

DEGREE = np.pi / 180


def hexapod(tilt_degrees, z_m=0.0, radius_m=0.03, sigma_n=0.05):
    """(points, axes) of six units, and the LoadCells made of them."""
    turn = 60 * DEGREE * np.arange(6)
    points = np.stack([radius_m * np.cos(turn), radius_m * np.sin(turn), np.full(6, z_m)], axis=1)
    along = np.stack([-np.sin(turn), np.cos(turn), 0 * turn], axis=1)
    sign = np.array([1, -1, 1, -1, 1, -1])[:, None]
    tilt = tilt_degrees * DEGREE
    axes = sign * np.cos(tilt) * along + np.sin(tilt) * np.array([0, 0, 1.0])
    return LoadCells(units(points, axes, sigma_n))


def flat(radius_m=0.075, sigma_n=0.05, **more):
    """Three units along z at 90, 210 and 330 degrees."""
    turn = np.array([90, 210, 330]) * DEGREE
    points = np.stack([radius_m * np.cos(turn), radius_m * np.sin(turn), 0 * turn], axis=1)
    return LoadCells(units(points, np.tile([0, 0, 1.0], (3, 1)), sigma_n, **more))


def units(points, axes, sigma_n=0.05, **more):
    return [Unit(tuple(map(float, p)), tuple(map(float, a)), sigma_n=sigma_n, **more) for p, a in zip(points, axes)]


def exerted(points, forces, noise=None):
    """The wrench of forces at points."""
    points, forces = np.reshape(points, (-1, 3)), np.reshape(forces, (-1, 3))
    return wrench([*forces.sum(axis=0), *np.cross(points, forces).sum(axis=0)], noise)


def wrench(six, noise=None):
    fx, fy, fz, mx, my, mz = map(float, six)
    return Wrench((fx, fy, fz), (mx, my, mz), noise)


def touch(point, normal, friction=0.5, sigma=0.0):
    return Touch(tuple(map(float, point)), tuple(map(float, normal)), friction, sigma)


def on_cylinder(degrees, z_m, radius_m=0.038):
    """Point and normal."""
    normal = np.array([np.cos(degrees * DEGREE), np.sin(degrees * DEGREE), 0.0])
    return radius_m * normal + np.array([0, 0, z_m]), normal


def shown(skin, cells, number, push_n):
    """A frame of one zone of these (row, column), whose columns count on over a seam, with a push shared by three
    units; None: without their readings."""
    columns = skin.columns
    bitmap = np.zeros((skin.rows, columns), bool)
    for row, column in cells:
        bitmap[row, column % columns] = True
    past = sum(column >= columns for _, column in cells) if any(column < columns for _, column in cells) else 0
    sums = [len(cells), sum(column % columns for _, column in cells), sum(row for row, _ in cells)]
    sums += [past] if skin.closed else []
    records = np.array([sums] if cells and skin.report == "moments" else [], np.int64).reshape(-1, len(sums))
    sent = Frame(number, number, frozenset(), 0, 0, 1, len(cells), records, bitmap if skin.report == "cells" else None)
    zones = Zones(sent, skin.sheet, 1000 * number)
    if push_n is not None:
        zones._units = UnitSamples(1000 * number, (push_n / 3,) * 3, (0.0,) * 3, (False,) * 3)
    return zones


def direction(rng):
    vector = rng.standard_normal(3)
    return vector / np.linalg.norm(vector)


def in_cone(rng, normal, friction, push):
    """A random force that pushes and stays within friction's cone."""
    across = np.cross(normal, direction(rng))
    across /= np.linalg.norm(across)
    return -push * normal + friction * push * np.sqrt(rng.random()) * across


def random_bumper(rng, count=7):
    points = rng.normal(0, 0.05, (count, 3))
    return LoadCells(units(points, [direction(rng) for _ in range(count)], 0.03))


def scattered(rng, count):
    """Places on a cylinder, not too near to each other, with their normals."""
    while True:
        places = [on_cylinder(rng.uniform(0, 360), rng.uniform(0, 0.15)) for _ in range(count)]
        points, normals = np.array([p for p, _ in places]), np.array([n for _, n in places])
        gaps = np.linalg.norm(points[:, None] - points, axis=2) + np.eye(count)
        if gaps.min() > 0.01:
            return points, normals


def placed(rng, count, kind):
    """Places with their normals: "scattered" over a cylinder, in a "line", "near" to each other down to 1 um, with
    "parallel" or "opposed" normals, or "stacked" along their common normal."""
    points, normals = scattered(rng, count)
    if kind in ("line", "near", "stacked"):
        way = {"line": direction(rng), "near": rng.standard_normal((count, 3)), "stacked": normals[0]}[kind]
        away = (np.arange(count) + rng.uniform(0, 0.5, count)) * 10 ** rng.uniform(-6, -1.5)
        points = points[0] + away[:, None] * way
    if kind in ("parallel", "opposed", "stacked"):
        normals = normals[0] * np.where((rng.random(count) < 0.5) & (kind == "opposed"), -1, 1)[:, None]
    return points, normals


def solved(points, normals, loaded, friction=0.5, **how):
    """The contacts at these places, with one friction or with one each."""
    each = zip(points, normals, np.broadcast_to(friction, len(points)).tolist())
    return contacts(loaded, [touch(*one) for one in each], **how)


def clarabel_cones(points, normals, friction):
    """(6, 3k) matrix from forces to the wrench, k times (3k,) pushes, and Clarabel's cones of friction (one, or one
    each; None: of any) with their rows."""
    import clarabel

    count = len(points)
    matrix = np.hstack([np.vstack([np.eye(3), np.cross(p, np.eye(3)).T]) for p in points])
    pushes = [-np.ravel(np.eye(count)[at][:, None] * normals) for at in range(count)]
    rows, cones = [], []
    for normal, push, at, mu in zip(normals, pushes, np.eye(count), np.broadcast_to(friction, count)):
        sides = np.kron(at, np.eye(3) - np.outer(normal, normal))
        rows += [push[None] * (mu or 1), *([] if mu is None else [sides])]
        pushing = [clarabel.NonnegativeConeT(1), *([] if mu is None else [clarabel.ZeroConeT(3)])]
        cones += [clarabel.SecondOrderConeT(4)] if mu else pushing
    return matrix, pushes, rows, cones


def clarabel_least(square, slope, rows, start, cones):
    """Clarabel's solution with the least x square x / 2 + slope x, of those with rows x + start in the cones."""
    import clarabel
    from scipy import sparse

    settings, sides = clarabel.DefaultSettings(), sparse.csc_matrix(-np.vstack(rows))
    settings.verbose, settings.tol_gap_abs, settings.tol_gap_rel, settings.tol_feas = False, 1e-10, 1e-10, 1e-10
    square = sparse.csc_matrix(np.triu(square))
    return clarabel.DefaultSolver(square, slope, sides, np.array(start), cones, settings).solve()


def programmed(points, normals, loaded, friction, chi2=3.841458820694124):
    """Least and largest push of each contact by Clarabel, None where there is no largest one: of forces in friction's
    cones (None: of any friction) whose misfit exceeds its least by ``chi2``, or is 0 without noise."""
    import clarabel

    matrix, pushes, rows, cones = clarabel_cones(points, normals, friction)
    six, start, none = loaded.array, [0.0] * sum(map(len, rows)), np.zeros((3 * len(points),) * 2)
    if loaded.noise is None:
        rows, start, cones = [*rows, -matrix], [*start, *six], [*cones, clarabel.ZeroConeT(6)]
    else:
        weigh = np.linalg.inv(np.linalg.cholesky(loaded.noise.covariance))
        matrix, six = weigh @ matrix, weigh @ six
        best = matrix @ clarabel_least(matrix.T @ matrix, -six @ matrix, rows, start, cones).x - six
        rows, cones = [*rows, 0 * pushes[0][None], -matrix], [*cones, clarabel.SecondOrderConeT(7)]
        start = [*start, np.sqrt(best @ best + chi2), *six]
    found = [clarabel_least(none, sign * push, rows, start, cones) for push in pushes for sign in (1, -1)]
    ends = [None if "DualInfeasible" in str(one.status) else one.obj_val for one in found]
    return [(low, None if high is None else -high) for low, high in zip(ends[::2], ends[1::2])]


def least_sideways(points, normals, loaded, friction, push=0.03):
    """(k, 3) forces within friction's cones that exert the wrench with the least sum of squares, in which pushes count
    ``push``, by Clarabel; None without any."""
    import clarabel

    matrix, pushes, rows, cones = clarabel_cones(points, normals, friction)
    square = np.eye(matrix.shape[1]) - (1 - push) * sum(np.outer(one, one) for one in pushes)
    start = [0.0] * sum(map(len, rows))
    given = [*rows, -matrix], [*start, *loaded.array], [*cones, clarabel.ZeroConeT(6)]
    found = clarabel_least(square, np.zeros(len(square)), *given)
    return None if "Infeasible" in str(found.status) else np.reshape(found.x, (-1, 3))
