"""The linear system of one frame: forces at known places, and their wrench, weighted by its noise.

Its solvers, non-negative least squares (scipy) and cones (Clarabel), are loaded on demand.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from contactfpga.errors import MissingExtra
from contactfpga.robot.haptics import confidence
from contactfpga.robot.haptics.contact import PURE_FORCE, PURE_FORCE_WITH_KNOWN_DIRECTION, Interval, Solution, Touch
from contactfpga.robot.haptics.values import HapticsError, skew
from contactfpga.robot.haptics.wrench import ALARM, Wrench
from contactfpga.surfaces.shapes import Floats, Vector, vector

SAME_M = 1e-9
"""Distance below which points are identical."""


class System:
    """A wrench, its points, and the weight of its components.

    Without noise a newton counts as much as a newton times the contacts' mean distance from their barycenter, so the
    answer does not depend on frame or unit.
    """

    def __init__(self, wrench: Wrench, touches: Sequence[Touch]):
        self.touches = touches
        self.noise = wrench.noise
        self.given = wrench
        self.points: list[Vector] = [touch.point_m for touch in touches]
        if self.noise is None:
            self._about_barycenter()
        else:
            self.wrench = wrench.array
            self.weight = self.noise.information

    def _about_barycenter(self) -> None:
        count = len(self.points)
        x, y, z = (sum(axis) / count for axis in zip(*self.points))
        self.points = [(px - x, py - y, pz - z) for px, py, pz in self.points]
        (fx, fy, fz), (mx, my, mz) = self.given.force_n, self.given.moment_nm
        self.wrench = np.array((fx, fy, fz, mx - (y * fz - z * fy), my - (z * fx - x * fz), mz - (x * fy - y * fx)))
        square = sum(px * px + py * py + pz * pz for px, py, pz in self.points) / count
        per_moment = 1 / square if square > SAME_M**2 else 1.0
        self.weight = np.diag((1.0, 1.0, 1.0, per_moment, per_moment, per_moment))

    @functools.cached_property
    def root(self) -> Floats:
        """A root of the weight: its transpose times itself."""
        return np.sqrt(self.weight) if self.noise is None else self.noise.root

    def matrix(self) -> Floats:
        """(6, 3k) matrix from k forces to the wrench."""
        rows: list[list[float]] = [[], [], [], [], [], []]
        for x, y, z in self.points:
            rows[0] += (1.0, 0.0, 0.0)
            rows[1] += (0.0, 1.0, 0.0)
            rows[2] += (0.0, 0.0, 1.0)
            rows[3] += (0.0, -z, y)
            rows[4] += (z, 0.0, -x)
            rows[5] += (-y, x, 0.0)
        return np.array(rows)

    def pushes(self) -> Floats:
        """(6, k) matrix from k pushes along the normals to the wrench."""
        columns = []
        for (x, y, z), touch in zip(self.points, self.touches):
            nx, ny, nz = touch.normal
            columns.append((-nx, -ny, -nz, z * ny - y * nz, x * nz - z * nx, y * nx - x * ny))
        return np.array(columns).T

    @functools.cached_property
    def length_m(self) -> float:
        """The contacts' mean distance from their barycenter, or 1 if they coincide."""
        points = np.array(self.points)
        length = math.sqrt(((points - points.mean(axis=0)) ** 2).sum() / len(points))
        return length if length > SAME_M else 1.0

    def centered(self, matrix: Floats) -> Floats:
        """A matrix to wrenches with moments about the contacts' barycenter and over their distance, for its rank."""
        x, y, z = np.mean(self.points, axis=0)
        moved = np.array(matrix)
        moved[3:] -= skew((x, y, z)) @ moved[:3]
        moved[3:] /= self.length_m
        return moved

    def places_widen(self, forces: Floats) -> bool:
        """Add the effect of uncertain places on moments to the noise; False if places are certain."""
        if self.noise is None or not any(touch.point_sigma_m for touch in self.touches):
            return False
        more = np.zeros((3, 3))
        for touch, force in zip(self.touches, forces.reshape(-1, 3)):
            more += touch.point_sigma_m**2 * (float(force @ force) * np.eye(3) - force[:, None] * force)
        if self.noise.rank == 6:
            covariance = np.array(self.noise.covariance)
            covariance[3:, 3:] += more
            self.weight = np.asarray(np.linalg.inv(covariance), float)
            self.root = np.asarray(np.linalg.cholesky(self.weight).T, float)
        else:
            self.noise = self.noise.widened(more)
            self.weight = self.noise.information
            self.root = self.noise.root
        return True

    def chi2(self, rest: Floats) -> float | None:
        """Chi-square of a residual (6,); None without noise."""
        return None if self.noise is None else float(rest @ self.weight @ rest)

    def freedom(self, rank: int) -> int:
        """Components of the wrench left to check forces of this rank."""
        return max(0, (6 if self.noise is None else self.noise.rank) - rank)


def distinct(touches: Sequence[Touch]) -> None:
    """Raise :class:`HapticsError` for two touches at one place, whose forces are indistinguishable."""
    for last, one in enumerate(touches):
        for first in range(last):
            if math.dist(one.point_m, touches[first].point_m) < SAME_M:
                raise HapticsError(f"contacts {first} and {last} both lie at {one.point_m}; give one of them")


EDGES = 12
"""Edges of the inscribed pyramid for friction's cone."""

SMALL = 1e-6
"""Share of the wrench that pushes alone may leave unexplained without noise."""


def along_normals(system: System) -> Solution:
    """Pushes along the normals, for contacts without friction and units that do not see it."""
    found = _along_normals(system)
    if system.places_widen(np.ravel(found)):
        found = _along_normals(system)
    return _solution(system, found, PURE_FORCE_WITH_KNOWN_DIRECTION, frictionless=True)


def by_least_squares(system: System) -> Solution:
    """Pushes along the normals if these exert the wrench to within its noise, else forces within friction's cones."""
    forces = _along_normals(system)
    if system.places_widen(np.ravel(forces)):
        forces = _along_normals(system)
    if _suffice(system, forces):
        return _solution(system, forces, PURE_FORCE_WITH_KNOWN_DIRECTION)
    forces = _along_edges(system)
    return _solution(system, forces, PURE_FORCE, beyond=_beyond(system, forces))


def _beyond(system: System, forces: Sequence[Vector]) -> bool:
    """Whether these forces, the best within friction's cones, fit worse than unrestricted ones."""
    matrix = system.root @ system.matrix()
    rest = system.root @ system.wrench - matrix @ np.ravel(forces)
    more = matrix @ np.linalg.lstsq(matrix, rest, rcond=confidence.KNOWN)[0]
    return float(more @ more) > SMALL * float(system.wrench @ system.weight @ system.wrench)


def within_cones(system: System) -> Solution:
    """The forces within friction's cones nearest to the wrench. Raises :class:`~contactfpga.MissingExtra` without
    Clarabel."""
    forces = _nearest(system)
    if system.places_widen(forces):
        forces = _nearest(system)
    found = [vector(force) for force in forces.reshape(-1, 3)]
    return _solution(system, found, PURE_FORCE, beyond=_beyond(system, found))


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
    weighted = matrix.T @ system.weight
    gram, wanted = (weighted @ matrix).tolist(), (weighted @ system.wrench).tolist()
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
    angles = [2 * math.pi * step / EDGES for step in range(EDGES)]
    for number, touch in enumerate(system.touches):
        inward, first, second = _frame(touch.normal).T
        directions = [inward]
        if touch.friction:
            sideways = [math.cos(angle) * first + math.sin(angle) * second for angle in angles]
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


def _solution(
    system: System, forces: list[Vector], model: str, frictionless: bool = False, beyond: bool = False
) -> Solution:
    known = model == PURE_FORCE_WITH_KNOWN_DIRECTION
    matrix = system.pushes() if known else system.matrix()
    rank, null = _spaces(system, matrix)

    def intervals() -> list[Interval]:
        return intervals_of(system, forces, frictionless, beyond)

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
    given = (system.touches, system.given, covariance, beyond)
    return Solution(model, forces, intervals, rank, null_space, chi2, freedom, *given)


def _spaces(system: System, matrix: Floats) -> tuple[int, Floats]:
    _, values, right = np.linalg.svd(system.centered(matrix))
    rank = int((values > 1e-9 * values[0]).sum())
    return rank, right[rank:].T


def _rank(system: System, matrix: Floats) -> int:
    return _spaces(system, matrix)[0]


DETERMINED = 1e-9
"""Effect of the null space up to which a push counts as known, as a share of it."""

SMALLEST = 1e-7
"""Weight of the forces' own size against the wrench."""

TOLERANCE = 1e-10
"""Relative tolerance of Clarabel."""


def _frame(normal: Vector) -> Floats:
    """(3, 3): columns inward, and two along the surface."""
    inward = -np.array(normal)
    least = np.zeros(3)
    least[int(np.argmin(np.abs(inward)))] = 1.0
    first = np.cross(inward, least)
    first /= math.sqrt(float(first @ first))
    return np.stack([inward, first, np.cross(inward, first)], axis=1)


def intervals_of(system: System, forces: Sequence[Vector], frictionless: bool, beyond: bool) -> list[Interval]:
    """The least and largest push of each contact, containing those of ``forces``: with noise at 95 %
    (:mod:`contactfpga.robot.haptics.confidence`), without it over all forces that exert exactly the same wrench.

    Args:
        frictionless: all forces are along the normals.
        beyond: ``forces`` do not exert the wrench; with noise friction then bounds nothing.
    """
    if system.noise is None:
        return _exact(system, forces, frictionless)
    basis, firsts = _basis(system.touches, frictionless)
    matrix, wanted = system.root @ system.matrix() @ basis, system.root @ system.wrench
    pushes = [max(0.0, float(one)) for one in (basis.T @ np.ravel(forces))[firsts]]
    size = max(pushes)
    if beyond and not frictionless:
        fit = confidence.of_pushes(matrix[:, firsts], wanted, np.delete(matrix, firsts, axis=1), size)
        found = _fitted(fit) if fit else [(0.0, None)] * len(firsts)
    else:
        found = _fitted(confidence.Fit(matrix, wanted, firsts, _frictions(system.touches, frictionless), size))
    return [(min(push, low), None if high is None else max(push, high)) for push, (low, high) in zip(pushes, found)]


def _fitted(fit: confidence.Fit) -> list[Interval]:
    return fit.intervals() if fit.contacts <= 2 else fit.intervals(_ends_of_many)


def _ends_of_many(fit: confidence.Fit, firsts: Sequence[int]) -> dict[int, tuple[float, float]]:
    nothing = np.zeros((0, fit.matrix.shape[1]))
    solver = _Solver(fit.frictions, nothing, np.zeros(fit.matrix.shape[1]))
    scale = max(1.0, float(np.abs(fit.square).max()))
    best = solver.solve(fit.square / scale, -(fit.matrix.T @ fit.wanted) / scale)
    most = math.sqrt(float(fit.misfit(best[None])[0]) + confidence.CHI2_1)
    bounded = _Solver(fit.frictions, nothing, np.zeros(len(best)), (fit.matrix, fit.wanted, most))
    found = {}
    for first in firsts:
        low, high = bounded.least(first, 1.0), bounded.least(first, -1.0)
        found[first] = (0.0 if low is None else low, math.inf if high is None else -high)
    return found


def _frictions(touches: Sequence[Touch], frictionless: bool) -> list[float]:
    return [0.0 if frictionless else touch.friction for touch in touches]


def _exact(system: System, forces: Sequence[Vector], frictionless: bool) -> list[Interval]:
    """Least and largest push of each contact over all forces in the cones with the wrench of ``forces``; None:
    unbounded."""
    basis, firsts = _basis(system.touches, frictionless)
    _, values, right = np.linalg.svd(system.centered(system.matrix() @ basis))
    rank = int((values > 1e-9 * values[0]).sum())
    fixed, free = right[:rank], right[rank:].T
    start = basis.T @ np.ravel(forces)
    size = max(1e-12, float(np.abs(start).max()))
    solver = None
    found: list[Interval] = []
    for first in firsts:
        push = max(0.0, float(start[first]))
        if float(np.abs(free[first]).max(initial=0.0)) <= DETERMINED:
            found.append((push, push))
            continue
        solver = solver or _Solver(_frictions(system.touches, frictionless), fixed, start / size)
        low, high = solver.least(first, 1.0), solver.least(first, -1.0)
        least = 0.0 if low is None else min(push, max(0.0, float(start[first]) + size * low))
        found.append((least, None if high is None else max(push, float(start[first]) - size * high)))
    return found


def _nearest(system: System) -> Floats:
    """(3k,): smallest forces in the cones that exert the nearest wrench."""
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
    solver = _Solver(_frictions(system.touches, False), np.zeros((0, len(square))), np.zeros(len(square)))
    return np.asarray(basis @ (size * solver.solve(square / scale, -wanted / scale)))


def _basis(touches: Sequence[Touch], frictionless: bool) -> tuple[Floats, list[int]]:
    """(3k, n): axes of the unknown forces, and which of the n are pushes."""
    blocks = [_frame(touch.normal)[:, : 1 if frictionless or not touch.friction else 3] for touch in touches]
    widths = [block.shape[1] for block in blocks]
    basis = np.zeros((3 * len(touches), sum(widths)))
    firsts = [sum(widths[:number]) for number in range(len(widths))]
    for number, (block, first) in enumerate(zip(blocks, firsts)):
        basis[3 * number : 3 * number + 3, first : first + block.shape[1]] = block
    return basis, firsts


class _Solver:
    """start + y in all cones, with fixed y = 0; ``near`` is a matrix, its wanted product with y, and the tolerance.

    The problem is so sparse that 64 contacts need no longer each than three.
    """

    def __init__(
        self,
        frictions: Sequence[float],
        fixed: Floats,
        start: Floats,
        near: tuple[Floats, Floats, float] | None = None,
    ):
        try:
            import clarabel
            from scipy import sparse
        except ModuleNotFoundError:
            raise MissingExtra("The interval of a push among three contacts or more", "haptics") from None
        self._clarabel, self._sparse = clarabel, sparse
        scales: list[float] = []
        self._cones: list[Any] = [clarabel.ZeroConeT(len(fixed))] if len(fixed) else []
        for friction in frictions:
            scales += [friction, 1.0, 1.0] if friction else [1.0]
            self._cones.append(clarabel.SecondOrderConeT(3) if friction else clarabel.NonnegativeConeT(1))
        sides = [sparse.csc_matrix(fixed), -sparse.diags(scales)]
        starts = [np.zeros(len(fixed)), np.array(scales) * start]
        if near is not None:
            matrix, wanted, most = near
            sides += [sparse.csc_matrix((1, matrix.shape[1])), sparse.csc_matrix(matrix)]
            starts += [np.array([most]), wanted]
            self._cones.append(clarabel.SecondOrderConeT(1 + len(wanted)))
        self._sides = sparse.vstack(sides, format="csc")
        self._start = np.concatenate(starts)

    def least(self, at: int, factor: float) -> float | None:
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
        solution = self._run(self._sparse.csc_matrix(np.triu(square)), slope)
        if "Solved" not in str(solution.status):
            raise HapticsError(f"no forces within friction's cones were found ({solution.status})")
        return np.array(solution.x)

    def _run(self, square: Any, slope: Floats) -> Any:
        settings = self._clarabel.DefaultSettings()
        settings.verbose = False
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = TOLERANCE
        return self._clarabel.DefaultSolver(square, slope, self._sides, self._start, self._cones, settings).solve()
