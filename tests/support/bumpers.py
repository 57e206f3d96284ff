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


def solved(points, normals, loaded, friction=0.5, **how):
    """The contacts at these places."""
    return contacts(loaded, [touch(*pair, friction) for pair in zip(points, normals)], **how)


def programmed(points, normals, loaded, friction, chi2=3.841458820694124):
    """Least and largest push of each contact by Clarabel, None where there is no largest one: of forces in friction's
    cones (None: of any friction) whose misfit exceeds its least by ``chi2``, or is 0 without noise."""
    import clarabel
    from scipy import sparse

    count, six = len(points), loaded.array
    matrix = np.hstack([np.vstack([np.eye(3), np.cross(p, np.eye(3)).T]) for p in points])
    pushes = [-np.ravel(np.eye(count)[at][:, None] * normals) for at in range(count)]
    rows, cones = [], []
    for normal, push, at in zip(normals, pushes, np.eye(count)):
        sides = np.kron(at, np.eye(3) - np.outer(normal, normal))
        rows += [push[None]] if friction is None else [friction * push[None], sides]
        cones.append(clarabel.NonnegativeConeT(1) if friction is None else clarabel.SecondOrderConeT(4))
    settings, start, none = clarabel.DefaultSettings(), np.zeros(sum(map(len, rows))), np.zeros((3 * count,) * 2)
    settings.verbose, settings.tol_gap_abs, settings.tol_gap_rel, settings.tol_feas = False, 1e-10, 1e-10, 1e-10

    def least(square, slope):
        sides = sparse.csc_matrix(-np.vstack(rows))
        return clarabel.DefaultSolver(sparse.csc_matrix(np.triu(square)), slope, sides, start, cones, settings).solve()

    if loaded.noise is None:
        rows, start, cones = [*rows, -matrix], [*start, *six], [*cones, clarabel.ZeroConeT(6)]
    else:
        weigh = np.linalg.inv(np.linalg.cholesky(loaded.noise.covariance))
        matrix, six = weigh @ matrix, weigh @ six
        best = matrix @ least(matrix.T @ matrix, -six @ matrix).x - six
        rows, cones = [*rows, np.zeros((1, 3 * count)), -matrix], [*cones, clarabel.SecondOrderConeT(7)]
        start = [*start, np.sqrt(best @ best + chi2), *six]
    found = [least(none, sign * push) for push in pushes for sign in (1, -1)]
    ends = [None if "DualInfeasible" in str(one.status) else one.obj_val for one in found]
    return [(low, None if high is None else -high) for low, high in zip(ends[::2], ends[1::2])]
