"""Recordings of other people's sheets, which are not part of the project."""

from pathlib import Path

import numpy as np
import pytest

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
RECORDINGS = ("sdh13x6", "dtmf16x16", "feet45x52", "bed64x32", "popu64x27")


def path_of(name):
    """The recording's file; skips the test where it is not there."""
    path = DATA / f"{name}.dev.npz"
    if not path.exists():
        pytest.skip(f"the recordings are not part of the project: {path.name} is not there")
    return path


def recorded(name):
    """(N, R, C) bool: its frames."""
    with np.load(path_of(name), allow_pickle=False) as file:
        return file["pressed"]
