"""A sheet laid on a triangle mesh."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from contactfpga.surfaces import mesh_file
from contactfpga.surfaces.mesh import Mesh
from contactfpga.surfaces.shapes import Floats, SurfaceError

FINE = 8
CHUNK = 2_000_000
MARGIN_MM = 1.0
EDGE = 0.8
"""Cosine of the angle from which two triangles form an edge, not a round surface."""
MAX_AROUND = 20_000_000
"""Most entries of the library's table: corners times the most triangles at a corner."""


@dataclasses.dataclass(frozen=True, eq=False)
class Triangles:
    corners_mm: Floats
    """(n, 3, 3)."""
    normals: Floats
    """(n, 3, 3) normals at the corners."""

    @classmethod
    def load(cls, path: str | Path, scale: float = 1.0) -> Triangles:
        """Read a mesh from a file of :data:`mesh_file.SUFFIXES`, in units of ``scale`` mm. Raises
        :class:`SurfaceError`, OSError."""
        mesh = mesh_file.read(path, "surface")
        corners = np.asarray(mesh.triangles, float)
        mesh.merge_vertices()
        return cls(scale * corners, _corner_normals(mesh))

    def hit(self, starts: Floats, ways: Floats) -> tuple[Floats, Floats]:
        """(n, 3) first hits of rays, and outward normals there; NaN without a hit."""
        points, normals = np.full(starts.shape, np.nan), np.full(starts.shape, np.nan)
        step = max(1, CHUNK // len(self.corners_mm))
        for first in range(0, len(starts), step):
            part = slice(first, first + step)
            points[part], normals[part] = self._hit(starts[part], ways[part])
        return points, normals

    def _hit(self, starts: Floats, ways: Floats) -> tuple[Floats, Floats]:
        """Hits of each ray with each triangle, after Moeller and Trumbore."""
        corner = self.corners_mm[:, 0]
        first, second = self.corners_mm[:, 1] - corner, self.corners_mm[:, 2] - corner
        aside = np.cross(ways[:, None], second[None])
        volume = (aside * first).sum(-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            away = starts[:, None] - corner[None]
            u = (away * aside).sum(-1) / volume
            turned = np.cross(away, first[None])
            v = (turned * ways[:, None]).sum(-1) / volume
            distance = (turned * second).sum(-1) / volume
            inside = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9) & (distance > 0)
        distance = np.where(inside, distance, np.inf)
        which = distance.argmin(axis=1)
        rays = np.arange(len(starts))
        met = np.isfinite(distance[rays, which])
        u, v = u[rays, which], v[rays, which]
        u, v = np.where(met, u, 0.0), np.where(met, v, 0.0)  # else of a triangle without an area, perhaps
        weights = np.stack([1 - u - v, u, v], axis=1)
        normals = (weights[:, :, None] * self.normals[which]).sum(axis=1)
        normals *= np.where((normals * ways).sum(axis=1) > 0, -1.0, 1.0)[:, None]
        points = starts + np.where(met, distance[rays, which], np.nan)[:, None] * ways
        return points, np.where(met[:, None], normals, np.nan)

    @property
    def size_mm(self) -> float:
        """An upper bound on the distance of corners."""
        spread = self.corners_mm.reshape(-1, 3)
        return float(np.linalg.norm(spread.max(axis=0) - spread.min(axis=0))) + MARGIN_MM


def _corner_normals(mesh: Any) -> Floats:
    """(n, 3, 3): area-weighted mean normals of the triangles at each corner on the same side of edges."""
    faces, normals = np.asarray(mesh.faces), np.asarray(mesh.face_normals, float)
    most = int(np.bincount(faces.ravel()).max())
    if most * len(mesh.vertices) > MAX_AROUND:
        raise SurfaceError(f"{most:,} of its {len(faces):,} triangles share one corner; mesh the surface more evenly")
    around = np.asarray(mesh.vertex_faces)
    sized = normals * np.asarray(mesh.area_faces, float)[:, None]
    found = np.empty((len(faces), 3, 3))
    step = max(1, CHUNK // around.shape[1])
    for first in range(0, len(faces), step):
        part = slice(first, first + step)
        for corner in range(3):
            near = around[faces[part, corner]]
            smooth = np.einsum("fkx,fx->fk", normals[near], normals[part]) > EDGE
            found[part, corner] = np.einsum("fkx,fk->fx", sized[near], smooth & (near >= 0))
    sizes = np.linalg.norm(found, axis=2)[..., None]
    return np.where(sizes > 0, found / np.where(sizes > 0, sizes, 1), normals[:, None])


@dataclasses.dataclass(frozen=True, eq=False)
class Placement:
    """A sheet's lines, and the pose of its frame in the mesh's frame."""

    rows: int
    columns: int
    pitch_x_mm: float
    pitch_y_mm: float
    rotation: Floats
    origin_mm: Floats

    def projected(self, mesh: Triangles) -> Mesh:
        """The flat sheet projected against z onto the mesh; distances grow on steep parts."""
        self._check_size(mesh)
        x, y = np.meshgrid(np.arange(self.columns) * self.pitch_x_mm, np.arange(self.rows) * self.pitch_y_mm)
        flat = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
        down = -self.rotation[:, 2]
        starts = self._placed(flat) - down * mesh.size_mm * 2
        points, normals = mesh.hit(starts, np.broadcast_to(down, starts.shape))
        return self._table(points.reshape(self.rows, self.columns, 3), normals.reshape(self.rows, self.columns, 3))

    def unrolled(self, mesh: Triangles, *, closed: bool = False) -> Mesh:
        """The sheet unrolled around z: column 0 goes up along z on the x side, row 0 around from there. Cells are a
        pitch apart on the mesh; columns of a closed sheet share the circumference evenly."""
        self._check_size(mesh)
        heights = self._heights(mesh)
        points, normals = np.empty((2, self.rows, self.columns, 3))
        # An arc is found between rays: fine enough that its chord is no shorter by more than a few parts in 10,000.
        angles = np.linspace(0, 2 * np.pi, max(360, FINE * self.columns) + 1)
        for row, height in enumerate(heights):
            curve, _ = self._seen(mesh, angles, np.full(len(angles), height))
            ways = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
            if np.isnan(curve).any():
                raise SurfaceError(
                    f"row {row}, {height:.1f} mm along the axis, does not meet the mesh all the way round"
                )
            pitch = ways[-1] / self.columns if closed else self.pitch_x_mm
            if pitch * (self.columns - 1) >= ways[-1]:
                raise SurfaceError(f"row {row}: {self.columns} columns are longer than the {ways[-1]:.1f} mm around it")
            at = np.interp(np.arange(self.columns) * pitch, ways, angles)
            points[row], normals[row] = self._seen(mesh, at, np.full(self.columns, height))
        return self._table(points, normals, closed=closed)

    def _check_size(self, mesh: Triangles) -> None:
        sheet = max(self.rows * self.pitch_y_mm, self.columns * self.pitch_x_mm)
        if (across := mesh.size_mm - MARGIN_MM) < sheet / 10:  # which may go around, but not so often
            raise SurfaceError(f"the mesh spans {across:.3g} mm, the sheet {sheet:g}; a mesh in m needs --scale 1000")

    def _heights(self, mesh: Triangles) -> Floats:
        far = (self.rows - 1) * self.pitch_y_mm
        fine = np.linspace(0, far, FINE * self.rows)
        line, _ = self._seen(mesh, np.zeros(len(fine)), fine)
        known = np.isfinite(line.sum(axis=1))
        steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
        if not known[0]:
            raise SurfaceError("column 0 does not meet the mesh at row 0; move the sheet's frame")
        end = len(fine) if known.all() else int(np.argmin(known))
        ways = np.concatenate([[0], np.cumsum(steps[: end - 1])])
        if ways[-1] < far - 1e-6:
            raise SurfaceError(f"column 0 is {far:g} mm long; the mesh ends after {ways[-1]:.1f} mm")
        return np.asarray(np.interp(np.arange(self.rows) * self.pitch_y_mm, ways, fine[:end]))

    def _seen(self, mesh: Triangles, angles: Floats, heights: Floats) -> tuple[Floats, Floats]:
        out = np.stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))], axis=1)
        far = 2 * mesh.size_mm
        starts = self._placed(far * out + heights[:, None] * np.array([0.0, 0.0, 1.0]))
        points, normals = mesh.hit(starts, -out @ self.rotation.T)
        beyond = np.linalg.norm(points - starts, axis=1) > far  # met beyond the axis alone
        points[beyond] = normals[beyond] = np.nan
        return points, normals

    def _placed(self, points_mm: Floats) -> Floats:
        return np.asarray(points_mm @ self.rotation.T + self.origin_mm)

    def _table(self, points: Floats, normals: Floats, closed: bool = False) -> Mesh:
        missed = np.isnan(points).any(axis=2)
        if missed.any():
            row, column = np.argwhere(missed)[0]
            which = f"{missed.sum()} cells do not meet the mesh, among them row {row}, column {column}"
            raise SurfaceError(f"{which}; move the sheet's frame")
        return Mesh(points, normals, self.pitch_x_mm, self.pitch_y_mm, closed)
