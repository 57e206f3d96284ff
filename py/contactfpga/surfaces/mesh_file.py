"""Triangle meshes in files, in plain formats only: archives and pictures may unpack to any size."""

from __future__ import annotations

import collections
import io
import logging
import re
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from contactfpga.errors import MissingExtra
from contactfpga.inputs import xmlfile
from contactfpga.inputs.files import read_small
from contactfpga.surfaces.shapes import SurfaceError

SUFFIXES = (".stl", ".obj", ".ply", ".off")
COLLADA = ".dae"
"""Format of robots' meshes, whose unit the robot's file scales."""
MAX_BYTES = 20_000_000
MAX_TRIANGLES = 500_000
_OBJ = re.compile(rb"^[vf][ \t].*$", re.MULTILINE)
"""Vertices and faces; thousands of groups, which are irrelevant, take the library minutes."""
_OBJ_SKIPPED = re.compile(rb"\\\r?\n|/\S*")
"""Continued lines, and references of a face besides vertices."""


def read(path: str | Path, extra: str, suffixes: tuple[str, ...] = SUFFIXES) -> Any:
    """The library's mesh object of a file, with (n, 3) ``vertices`` and (m, 3) ``faces``, their indices.

    ``extra``: the extra to install. Raises :class:`SurfaceError`, :class:`~contactfpga.MissingExtra`, OSError.
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in suffixes:
        raise SurfaceError(f"{path}: a mesh is a file of {', '.join(suffixes)}")
    try:
        import trimesh
    except ModuleNotFoundError as error:
        raise MissingExtra(f"reading a mesh ({error})", extra) from None
    # What the library stumbles over it logs, traceback and all, where nobody else takes it.
    logging.getLogger("trimesh").addHandler(logging.NullHandler())
    data = read_small(path, MAX_BYTES, "a mesh? Fewer triangles are enough", SurfaceError)
    if kind == ".obj":
        data = b"\n".join(_OBJ.findall(_OBJ_SKIPPED.sub(b"", data)))
    if kind == COLLADA:
        _check_collada(data, path)
    try:
        # Unprocessed, as else triangles without a place are left out in silence.
        mesh: Any = trimesh.load_mesh(io.BytesIO(data), file_type=kind[1:], process=False)
        faces, count = np.asarray(getattr(mesh, "faces", ())), len(mesh.vertices)
    except Exception as error:  # whatever a parser of many formats stumbles over
        raise SurfaceError(f"{path}: not a mesh: {str(error)[:200] or type(error).__name__}") from None
    if not len(faces):
        raise SurfaceError(f"{path}: no triangles in it")
    if len(faces) > MAX_TRIANGLES:
        raise SurfaceError(f"{path}: {len(faces):,} triangles; the limit is {MAX_TRIANGLES:,}, simplify the mesh")
    if faces.min() < 0 or faces.max() >= count:
        raise SurfaceError(f"{path}: a triangle has a corner that is none of its {count:,}")
    return mesh


def _check_collada(data: bytes, path: Path) -> None:
    """Refuse archives and endlessly nested scenes."""
    if zipfile.is_zipfile(io.BytesIO(data)):
        raise SurfaceError(f"{path}: it is an archive; unpack it")
    shown: collections.Counter[str] = collections.Counter()
    for element in xmlfile.parse(data, path, "a mesh", SurfaceError).iter():
        name = element.tag.rpartition(":")[2]
        if name == "instance_node":
            raise SurfaceError(f"{path}: it shows a node at several places; export it as one mesh")
        if name in ("instance_geometry", "instance_controller"):
            shown[element.get("url", "")] += 1
    if (most := max(shown.values(), default=0)) * len(data) > MAX_BYTES:
        raise SurfaceError(f"{path}: it shows one part at {most:,} places; export it as one mesh")
