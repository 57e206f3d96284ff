""".npy and .npz files from anywhere. numpy would allocate whatever a header claims."""

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

MAX_BYTES = 1 << 32
"""Of an array."""
NUMBERS = "biuf"
"""Kinds of arrays that are read: bools, whole numbers, floats."""
_SHOWN = 8


class ArrayFileError(ValueError):
    """What a file holds that is no array of numbers."""


def read(path: str | Path, names: Sequence[str]) -> dict[str, np.ndarray]:
    """The named arrays of a .npz file that it has; of a .npy file the one array, by the first name.

    Raises :class:`ArrayFileError` where the first one is not there or the file is damaged, and OSError.
    """
    with open_regular(path) as file:
        try:
            if file.read(len(npy.MAGIC_PREFIX)) == npy.MAGIC_PREFIX:
                return {names[0]: _array(file, os.fstat(file.fileno()).st_size, str(path))}
            with zipfile.ZipFile(file) as archive:
                return _arrays(archive, names, str(path))
        except ArrayFileError:
            raise
        except Exception as error:  # zipfile and numpy raise a dozen kinds for bytes that are no such file
            said = visible(str(error) or type(error).__name__)[:200]
            raise ArrayFileError(f"{path} is no .npy or .npz file, or damaged: {said}") from None


def _arrays(archive: zipfile.ZipFile, names: Sequence[str], path: str) -> dict[str, np.ndarray]:
    held = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
    if names[0] not in held:
        shown = ", ".join(visible(name[:40]) for name in list(held)[:_SHOWN]) or "nothing"
        more = f" and {len(held) - _SHOWN} more" if len(held) > _SHOWN else ""
        raise ArrayFileError(f"{path} holds {shown}{more}; a recording has an array `{names[0]}`")
    found = {}
    for name in names:
        if name in held:
            with archive.open(held[name]) as file:
                found[name] = _array(file, held[name].file_size, f"`{name}` in {path}")  # type: ignore[arg-type]
    return found


def _array(file: BinaryIO, size: int, what: str) -> np.ndarray:
    """The array that begins here, of ``size`` bytes with its header."""
    file.seek(0)
    version = npy.read_magic(file)
    header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    shape, by_columns, dtype = header(file)
    if dtype.kind not in NUMBERS:
        raise ArrayFileError(f"{what} holds {visible(str(dtype))[:40]}; bools or numbers are needed")
    claimed, left = math.prod(shape) * dtype.itemsize, size - file.tell()
    if min(shape, default=0) < 0 or claimed > left:
        raise ArrayFileError(f"{what} claims shape {shape} of {dtype}, {claimed} bytes, and holds {left}")
    if claimed > MAX_BYTES:
        raise ArrayFileError(f"{what} has {claimed} bytes; the limit is {MAX_BYTES}, split it")
    data = file.read(claimed)
    if dtype.kind == "b":  # any byte but 0 is True, and numpy takes such bytes for 0 or 1
        return np.reshape(np.frombuffer(data, np.uint8) != 0, shape, "F" if by_columns else "C")
    return np.reshape(np.frombuffer(data, dtype), shape, "F" if by_columns else "C")
