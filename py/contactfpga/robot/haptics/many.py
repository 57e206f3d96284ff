"""Pushes along known normals, and three contacts or more: non-negative least squares; needs scipy from three on."""

from __future__ import annotations

import math

import numpy as np

from contactfpga.errors import MissingExtra
from contactfpga.robot.haptics import cones
from contactfpga.robot.haptics.answer import Floats, Vector
from contactfpga.robot.haptics.contact import PURE_FORCE, PURE_FORCE_WITH_KNOWN_DIRECTION, Interval, Solution
from contactfpga.robot.haptics.system import System
from contactfpga.robot.haptics.wrench import ALARM
from contactfpga.surfaces.shapes import vector

EDGES = 12
"""Of the pyramid that stands for friction's cone, inside of it."""

SMALL = 1e-6
"""Share of the wrench that pushes alone may leave over where no noise is known."""


def pushes(system: System) -> Solution:
    """Only pushes along the normals, for contacts without friction and for units that do not see it."""
    found = _along_normals(system)
    if system.places_widen(np.ravel(found)):
        found = _along_normals(system)
    return _solution(system, found, PURE_FORCE_WITH_KNOWN_DIRECTION, frictionless=True)


def many(system: System) -> Solution:
    """Pushes along the normals if these exert the wrench to within its noise, else forces within friction's cones."""
    forces = _along_normals(system)
    if system.places_widen(np.ravel(forces)):
        forces = _along_normals(system)
    if _suffice(system, forces):
        return _solution(system, forces, PURE_FORCE_WITH_KNOWN_DIRECTION)
    return _solution(system, _along_edges(system), PURE_FORCE)


def within_cones(system: System) -> Solution:
    """The forces within friction's cones that come nearest to the wrench. Raises
    :class:`~contactfpga.MissingExtra` without Clarabel."""
    forces = cones.nearest(system)
    if system.places_widen(forces):
        forces = cones.nearest(system)
    return _solution(system, [vector(force) for force in forces.reshape(-1, 3)], PURE_FORCE)


def _along_normals(system: System) -> list[Vector]:
    matrix = system.pushes()
    if matrix.shape[1] <= 2:
        amounts = _few(matrix, system)
    else:
        amounts = _least_squares(system.root @ matrix, system.root @ system.wrench).tolist()
    found: list[Vector] = []
    for amount, touch in zip(amounts, system.touches):
        nx, ny, nz = touch.normal
        found.append((-amount * nx, -amount * ny, -amount * nz))
    return found


def _few(matrix: Floats, system: System) -> list[float]:
    """The best one or two amounts, none below 0."""
    turned = matrix.T @ system.weight
    gram, wanted = (turned @ matrix).tolist(), (turned @ system.wrench).tolist()
    alone = [max(0.0, want / gram[at][at]) if gram[at][at] > 0 else 0.0 for at, want in enumerate(wanted)]
    if len(alone) == 1:
        return alone
    (aa, ab), (_, bb) = gram
    area = aa * bb - ab * ab
    if area > 1e-12 * aa * bb:
        both = [(wanted[0] * bb - wanted[1] * ab) / area, (wanted[1] * aa - wanted[0] * ab) / area]
        if min(both) >= 0:
            return both
    gains = [want * amount for want, amount in zip(wanted, alone)]
    return [alone[0], 0.0] if gains[0] >= gains[1] else [0.0, alone[1]]


def _suffice(system: System, forces: list[Vector]) -> bool:
    if not any(touch.friction for touch in system.touches):
        return True
    rest = system.wrench - system.matrix() @ np.ravel(forces)
    off = float(rest @ system.weight @ rest)
    if system.noise is None:
        return off <= SMALL**2 * float(system.wrench @ system.weight @ system.wrench)
    freedom = system.freedom(_rank(system, system.pushes()))
    return freedom == 0 or off <= ALARM[freedom - 1]


def _along_edges(system: System) -> list[Vector]:
    edges, owners = [], []
    turns = [2 * math.pi * step / EDGES for step in range(EDGES)]
    for number, touch in enumerate(system.touches):
        inward, first, second = cones.frame(touch.normal).T
        directions = [inward]
        if touch.friction:
            sideways = [math.cos(turn) * first + math.sin(turn) * second for turn in turns]
            directions += [inward + touch.friction * each for each in sideways]
        edges += directions
        owners += [number] * len(directions)
    matrix = system.matrix()
    columns = np.stack([matrix[:, 3 * own : 3 * own + 3] @ edge for own, edge in zip(owners, edges)], axis=1)
    amounts = _least_squares(system.root @ columns, system.root @ system.wrench)
    found = np.zeros((len(system.touches), 3))
    for amount, own, edge in zip(amounts, owners, edges):
        found[own] += amount * edge
    return [vector(force) for force in found]


def _least_squares(matrix: Floats, wanted: Floats) -> Floats:
    try:
        from scipy.optimize import nnls
    except ModuleNotFoundError:
        raise MissingExtra("The force at three contacts or more", "haptics") from None
    return np.asarray(nnls(matrix, wanted)[0])


def _solution(system: System, forces: list[Vector], model: str, frictionless: bool = False) -> Solution:
    known = model == PURE_FORCE_WITH_KNOWN_DIRECTION
    matrix = system.pushes() if known else system.matrix()
    rank, null = _spaces(system, matrix)

    def intervals() -> list[Interval]:
        return cones.intervals(system, forces, frictionless)

    def covariance() -> Floats | None:
        if system.noise is None:
            return None
        inverse = np.linalg.pinv(matrix.T @ system.weight @ matrix, rcond=1e-12, hermitian=True)
        if not known:
            return np.asarray(inverse)
        spread = np.zeros((3 * len(forces), len(forces)))
        for number, touch in enumerate(system.touches):
            spread[3 * number : 3 * number + 3, number] = touch.normal
        return np.asarray(spread @ inverse @ spread.T)

    chi2, freedom = system.chi2(system.wrench - system.matrix() @ np.ravel(forces)), system.freedom(rank)
    null_space = null.T.tolist()
    return Solution(model, forces, intervals, rank, null_space, chi2, freedom, system.touches, system.given, covariance)


def _spaces(system: System, matrix: Floats) -> tuple[int, Floats]:
    """Rank, and the null space as columns."""
    _, values, turned = np.linalg.svd(system.centered(matrix))
    rank = int((values > 1e-9 * values[0]).sum())
    return rank, turned[rank:].T


def _rank(system: System, matrix: Floats) -> int:
    return _spaces(system, matrix)[0]
