"""Pressed cells as the native models take them: one 64-bit word a row, bit c is column c."""

from __future__ import annotations

import numpy as np


def to_words(cells: np.ndarray) -> np.ndarray:
    """(..., C) bool to (...) uint64, C at most 64."""
    packed = np.packbits(np.asarray(cells, bool), axis=-1, bitorder="little")
    whole = np.zeros((*packed.shape[:-1], 8), np.uint8)
    whole[..., : packed.shape[-1]] = packed
    return whole.view("<u8")[..., 0].astype(np.uint64)
