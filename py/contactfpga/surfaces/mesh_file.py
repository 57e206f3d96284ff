"""Triangle meshes in files, in plain formats only: archives and pictures may unpack to any size."""

from __future__ import annotations

import array
import codecs
import collections
import io
import itertools
import logging
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from contactfpga.errors import MissingExtra
from contactfpga.inputs import xmlfile
from contactfpga.inputs.files import read_small
from contactfpga.inputs.values import shown
from contactfpga.surfaces.shapes import SurfaceError

SUFFIXES = (".stl", ".obj", ".ply", ".off")
COLLADA = ".dae"
"""Format of robots' meshes, whose unit the robot's file scales."""
MAX_BYTES = 20_000_000
MAX_TRIANGLES = 500_000
FAR = 1e9
"""Coordinate from which the library cannot merge corners, in the mesh's unit."""
MAX_WORDS = {".ply": 4_000_000, ".off": 4_000_000, COLLADA: 2_000_000}
"""Most words of a text that the library reads, which takes up to 500 bytes for each."""


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
    words, most = sum(len(line.split()) for line in io.BytesIO(data)), MAX_WORDS.get(kind, len(data))
    if words > most:
        raise SurfaceError(
            f"{path}: {words:,} words; the limit is {most:,}. Write it as binary STL, or simplify the mesh"
        )
    if kind == COLLADA:
        _check_collada(data, path, words)
    text = _text(data, path, kind) if kind == ".obj" or (kind == ".stl" and _is_text(data, path)) else None
    try:  # unprocessed, as else triangles without a place are left out in silence
        if text is None:
            mesh: Any = trimesh.load_mesh(io.BytesIO(data), file_type=kind[1:], process=False)
        else:
            mesh = trimesh.Trimesh(*text, process=False)
        faces, count = np.asarray(getattr(mesh, "faces", ())), len(mesh.vertices)
    except Exception as error:  # whatever a parser of many formats stumbles over
        raise SurfaceError(f"{path}: not a mesh: {str(error)[:200] or type(error).__name__}") from None
    if not len(faces):
        raise SurfaceError(f"{path}: no triangles in it")
    if len(faces) > MAX_TRIANGLES:
        raise SurfaceError(f"{path}: {len(faces):,} triangles; the limit is {MAX_TRIANGLES:,}, simplify the mesh")
    if faces.min() < 0 or faces.max() >= count:
        raise SurfaceError(f"{path}: a triangle has a corner that is none of its {count:,}")
    if wrong := int((~(np.abs(np.asarray(mesh.vertices)[faces]) < FAR)).any(axis=(1, 2)).sum()):
        raise SurfaceError(f"{path}: {wrong} of its {len(faces)} triangles have a corner that is no point < {FAR:g}")
    mesh.remove_unreferenced_vertices()
    return mesh


def _is_text(data: bytes, path: Path) -> bool:
    """Whether an STL file is text. Raises :class:`SurfaceError` for a binary one of another length than it states."""
    stated = int.from_bytes(data[80:84], "little")
    is_text = len(data) != (size := 84 + 50 * stated)
    if is_text and stated and b"vertex" not in data.lower():
        raise SurfaceError(
            f"{path}: {len(data):,} bytes; its {stated:,} triangles would take {size:,}; export it again"
        )
    return is_text


def _text(data: bytes, path: Path, kind: str) -> tuple[np.ndarray, np.ndarray]:
    """(n, 3) vertices and (m, 3) faces of an OBJ or STL file. The library takes minutes for thousands of groups,
    which are irrelevant, and counts relative indices from the end of the file."""
    vertices, faces, vertex = array.array("d"), array.array("q"), b"v" if kind == ".obj" else b"vertex"
    plain = data.removeprefix(codecs.BOM_UTF8).replace(b"\r\n", b"\n").replace(b"\r", b"\n").replace(b"\\\n", b" ")
    ended = 0  # numbers of vertices in solids that have an end
    for line in io.BytesIO(plain):
        key, *words = line.partition(b"#")[0].lower().split() or (b"",)
        try:
            if key == vertex:
                x, y, z = map(float, words[:3])
                vertices.extend((x, y, z))
            elif key == b"endsolid":
                ended = len(vertices)
            elif key == b"f":
                numbers = [int(word.partition(b"/")[0]) for word in words]
                first, *others = (one - 1 if one >= 0 else one + len(vertices) // 3 for one in numbers)
                faces.extend(itertools.chain.from_iterable((first, *pair) for pair in itertools.pairwise(others)))
        except ValueError:
            due = "three numbers with decimal points" if key == vertex else "whole numbers, of vertices"
            raise SurfaceError(f"{path}: line {shown(line.strip().decode(errors='replace'))} must have {due}") from None
    if kind == ".stl":
        if len(vertices) > ended or len(vertices) % 9:
            raise SurfaceError(f"{path}: it ends within a solid, so a part is missing; export it again")
        faces.extend(range(len(vertices) // 3))
    return np.array(vertices).reshape(-1, 3), np.array(faces).reshape(-1, 3)


def _check_collada(data: bytes, path: Path, words: int) -> None:
    """Refuse archives and endlessly nested scenes."""
    if zipfile.is_zipfile(io.BytesIO(data)):
        raise SurfaceError(f"{path}: it is an archive; unpack it")
    places: collections.Counter[str] = collections.Counter()
    for element in xmlfile.parse(data, path, "a mesh", SurfaceError).iter():
        name = element.tag.rpartition(":")[2]
        if name == "instance_node":
            raise SurfaceError(f"{path}: it shows a node at several places; export it as one mesh")
        if name in ("instance_geometry", "instance_controller"):
            places[element.get("url", "")] += 1
    if (most := max(places.values(), default=0)) * len(data) > MAX_BYTES or most * words > MAX_WORDS[COLLADA]:
        raise SurfaceError(f"{path}: it shows one part at {most:,} places; export it as one mesh")
