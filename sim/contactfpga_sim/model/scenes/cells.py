"""Pressed cells: definition, and form for native models."""

from __future__ import annotations

import math

import numpy as np


def pressed(values: np.ndarray, what: str, threshold: float | None = None) -> np.ndarray:
    """Bools unchanged, numbers compared with ``threshold``: the one rule for all sources of cells.

    Raises ValueError, which calls the array ``what``, for numbers without a threshold, NaN, and other types.
    """
    if values.dtype == bool:
        return values
    if values.dtype.kind not in "iuf":
        raise ValueError(f"{what} holds {values.dtype}; cells are bools or numbers")
    if threshold is None:
        raise ValueError(
            f"{what} holds {values.dtype}; say above which value a cell is pressed (--threshold, or threshold= after "
            "sim://), or store bools"
        )
    if not math.isfinite(threshold):
        raise ValueError(f"the threshold of {what} is {threshold}; it must be a finite number")
    if values.dtype.kind == "f" and (count := int(np.isnan(values).sum())):
        raise ValueError(f"{what} holds {count} NaN; a cell is pressed or it is not")
    return values > np.float64(threshold)


def to_words(cells: np.ndarray) -> np.ndarray:
    """(..., C) bool to (...) uint64, C at most 64: one word per row, bit c is column c."""
    packed = np.packbits(np.asarray(cells, bool), axis=-1, bitorder="little")
    whole = np.zeros((*packed.shape[:-1], 8), np.uint8)
    whole[..., : packed.shape[-1]] = packed
    return whole.view("<u8")[..., 0].astype(np.uint64)
