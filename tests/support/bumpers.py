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
