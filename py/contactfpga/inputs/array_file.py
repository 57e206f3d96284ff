""".npz and .npy files from outside; numpy alone would allocate whatever a header claims."""

from __future__ import annotations

import math
import os
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.lib import format as npy

from contactfpga.inputs.files import open_regular
from contactfpga.inputs.values import visible

MAX_BYTES = 1 << 30
"""Largest array in bytes; the file may hold a thousandth of this, compressed."""
PACKINGS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""numpy's compressions; others could expand a few bytes without limit."""
NUMBERS = "biuf"
"""Accepted kinds of arrays: bools, integers, floats."""
_SHOWN = 8


class ArrayFileError(ValueError):
    """The file has no valid array of numbers."""


def read(path: str | Path, names: Sequence[str], most: int = MAX_BYTES) -> dict[str, np.ndarray]:
    """The named arrays in a .npz file, or the array of a .npy file by the first name. ``most``: bytes of an array.
    Raises
    :class:`ArrayFileError` for a damaged file or without the first array, OSError.
    """
    with open_regular(path) as file:
        try:
            if file.read(len(npy.MAGIC_PREFIX)) == npy.MAGIC_PREFIX:
                return {names[0]: _array(file, os.fstat(file.fileno()).st_size, str(path), most)}
            with zipfile.ZipFile(file) as archive:
                return _arrays(archive, names, str(path), most)
        except ArrayFileError:
            raise
        except Exception as error:  # zipfile and numpy raise a dozen kinds for bytes that are no such file
            said = visible(str(error) or type(error).__name__)[:200]
            raise ArrayFileError(f"{path} is no .npy or .npz file, or damaged: {said}") from None


def _arrays(archive: zipfile.ZipFile, names: Sequence[str], path: str, most: int) -> dict[str, np.ndarray]:
    held = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
    if names[0] not in held:
        shown = ", ".join(visible(name[:40]) for name in list(held)[:_SHOWN]) or "nothing"
        more = f" and {len(held) - _SHOWN} more" if len(held) > _SHOWN else ""
        raise ArrayFileError(f"{path} holds {shown}{more}; a recording has an array `{names[0]}`")
    found = {}
    for name in names:
        if name in held:
            if held[name].compress_type not in PACKINGS:
                raise ArrayFileError(f"`{name}` in {path} is packed in a way that numpy does not use; save it anew")
            with archive.open(held[name]) as file:
                found[name] = _array(file, held[name].file_size, f"`{name}` in {path}", most)  # type: ignore[arg-type]
    return found


def _array(file: BinaryIO, size: int, what: str, most: int) -> np.ndarray:
    file.seek(0)
    version = npy.read_magic(file)
    header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    shape, by_columns, dtype = header(file)
    if dtype.kind not in NUMBERS:
        raise ArrayFileError(f"{what} holds {visible(str(dtype))[:40]}; bools or numbers are needed")
    claimed, left = math.prod(shape) * dtype.itemsize, size - file.tell()
    if min(shape, default=0) < 0 or claimed > left:
        raise ArrayFileError(f"{what} claims shape {shape} of {dtype}, {claimed} bytes, and holds {left}")
    if claimed > most:
        raise ArrayFileError(f"{what} has {claimed} bytes; the limit is {most}, split it")
    data = np.empty(claimed, np.uint8)
    if file.readinto(data.data) != claimed:  # type: ignore[attr-defined]
        raise ArrayFileError(f"{what} claims {claimed} bytes and holds fewer")
    if dtype.kind == "b":  # any byte but 0 is True, and numpy takes such bytes for 0 or 1
        np.minimum(data, 1, out=data)
    return np.reshape(data.view(dtype), shape, "F" if by_columns else "C")
