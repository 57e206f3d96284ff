"""Friction's cones by a cone solver, Clarabel; it is loaded where it is needed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from contactfpga.errors import MissingExtra
from contactfpga.robot.haptics.answer import Floats, HapticsError, Vector
from contactfpga.robot.haptics.contact import Interval, Touch
from contactfpga.robot.haptics.system import System

DETERMINED = 1e-9
"""A push that the null space changes by no more than this share is known."""

SMALLEST = 1e-7
"""Weight of the forces' own size against the wrench."""

TOLERANCE = 1e-10
"""Of Clarabel's answers, as a share."""


def frame(normal: Vector) -> Floats:
    """(3, 3): columns inward, and two along the surface."""
    inward = -np.array(normal)
    least = np.zeros(3)
    least[int(np.argmin(np.abs(inward)))] = 1.0
    first = np.cross(inward, least)
    first /= math.sqrt(float(first @ first))
    return np.stack([inward, first, np.cross(inward, first)], axis=1)


def intervals(system: System, forces: Sequence[Vector], frictionless: bool) -> list[Interval]:
    """The least and largest push in N of each contact, over all forces in the cones that exert the same wrench as
    ``forces``, which lie in them, and so in the interval. None: no largest one."""
    basis, firsts = _basis(system.touches, frictionless)
    _, values, turned = np.linalg.svd(system.centered(system.matrix() @ basis))
    rank = int((values > 1e-9 * values[0]).sum())
    fixed, free = turned[:rank], turned[rank:].T
    start = basis.T @ np.ravel(forces)
    size = max(1e-12, float(np.abs(start).max()))
    solver = None
    found: list[Interval] = []
    for first in firsts:
        push = max(0.0, float(start[first]))
        if float(np.abs(free[first]).max(initial=0.0)) <= DETERMINED:
            found.append((push, push))
            continue
        solver = solver or _Solver(system.touches, frictionless, fixed, start / size)
        low, high = solver.least(first, 1.0), solver.least(first, -1.0)
        least = 0.0 if low is None else min(push, max(0.0, float(start[first]) + size * low))
        found.append((least, None if high is None else max(push, float(start[first]) - size * high)))
    return found


def nearest(system: System) -> Floats:
    """The forces (3k,) in N in the cones that exert the nearest wrench; if several do, the smallest of them."""
    basis, firsts = _basis(system.touches, False)
    matrix = system.root @ system.matrix() @ basis
    square = matrix.T @ matrix
    # Of equal ones the smallest forces, and those along the surface count most.
    sizes = np.ones(len(square))
    sizes[firsts] = 0.1
    square += np.diag(SMALLEST * float(np.trace(square)) / len(square) * sizes)
    size = max(1e-12, float(np.abs(system.wrench[:3]).max()))
    wanted = matrix.T @ (system.root @ system.wrench) / size
    scale = float(np.abs(square).max())
    solver = _Solver(system.touches, False, np.zeros((0, len(square))), np.zeros(len(square)))
    return np.asarray(basis @ (size * solver.solve(square / scale, -wanted / scale)))


def _basis(touches: Sequence[Touch], frictionless: bool) -> tuple[Floats, list[int]]:
    """(3k, n): axes of the forces that are looked for, and which of the n are pushes."""
    blocks = [frame(touch.normal)[:, : 1 if frictionless or not touch.friction else 3] for touch in touches]
    widths = [block.shape[1] for block in blocks]
    basis = np.zeros((3 * len(touches), sum(widths)))
    firsts = [sum(widths[:number]) for number in range(len(widths))]
    for number, (block, first) in enumerate(zip(blocks, firsts)):
        basis[3 * number : 3 * number + 3, first : first + block.shape[1]] = block
    return basis, firsts


class _Solver:
    """start + y in all cones, where fixed y = 0. So few of its numbers are not 0 that 64 contacts take no longer each
    than three do; with the null space of ``fixed`` in place of it they take 50 times as long."""

    def __init__(self, touches: Sequence[Touch], frictionless: bool, fixed: Floats, start: Floats):
        try:
            import clarabel
            from scipy import sparse
        except ModuleNotFoundError:
            raise MissingExtra("The interval of a push among three contacts or more", "haptics") from None
        self._clarabel, self._sparse = clarabel, sparse
        scales: list[float] = []
        self._cones: list[Any] = [clarabel.ZeroConeT(len(fixed))] if len(fixed) else []
        for touch in touches:
            flat = frictionless or not touch.friction
            scales += [1.0] if flat else [touch.friction, 1.0, 1.0]
            self._cones.append(clarabel.NonnegativeConeT(1) if flat else clarabel.SecondOrderConeT(3))
        self._sides = sparse.vstack([sparse.csc_matrix(fixed), -sparse.diags(scales)], format="csc")
        self._start = np.concatenate([np.zeros(len(fixed)), np.array(scales) * start])

    def least(self, at: int, factor: float) -> float | None:
        """The least of ``factor`` times this one of y; None where there is none."""
        count = self._sides.shape[1]
        slope = np.zeros(count)
        slope[at] = factor
        solution = self._run(self._sparse.csc_matrix((count, count)), slope)
        status = str(solution.status)
        if "DualInfeasible" in status:
            return None
        if "Solved" not in status:
            raise HapticsError(f"the interval of a push was not found ({status}); do contacts lie in one point?")
        return float(solution.obj_val)

    def solve(self, square: Floats, slope: Floats) -> Floats:
        """The y with the least of y square y / 2 + slope y."""
        solution = self._run(self._sparse.csc_matrix(np.triu(square)), slope)
        if "Solved" not in str(solution.status):
            raise HapticsError(f"no forces within friction's cones were found ({solution.status})")
        return np.array(solution.x)

    def _run(self, square: Any, slope: Floats) -> Any:
        settings = self._clarabel.DefaultSettings()
        settings.verbose = False
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = TOLERANCE
        return self._clarabel.DefaultSolver(square, slope, self._sides, self._start, self._cones, settings).solve()
