"""The line of the paper's Fig. 9 through measured forces and deformations."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from contactfpga.design.cover.answer import CoverError
from contactfpga.design.cover.numerics import Floats
from contactfpga.inputs.files import open_regular
from contactfpga.inputs.values import shown


class StraightLine(NamedTuple):
    """deformation = offset + force / stiffness, by least squares."""

    stiffness_n_m: float
    offset_m: float
    """Deformation without force."""
    correlation: float
    """Correlation of force and deformation, -1 to 1."""


def read(path: str | Path) -> tuple[Floats, Floats]:
    """Forces in N and deformations in m from a file with two comma-separated columns; a header is optional."""
    rows: list[list[float]] = []
    with open_regular(path) as file:
        lines = file.read().decode("utf-8-sig", errors="replace").splitlines()
    for number, text in enumerate(lines, 1):
        cells = [cell.strip() for cell in text.split(",")]
        if not text.strip() or text.startswith("#"):
            continue
        try:
            row = [float(cell) for cell in cells]
        except ValueError:
            if not rows and number == 1:
                continue
            raise _refused(path, number, text) from None
        if len(row) != 2 or not all(map(math.isfinite, row)):
            raise _refused(path, number, text)
        rows.append(row)
    if len(rows) < 3:
        raise CoverError(f"{path}: {len(rows)} points; a line with a correlation needs 3")
    force, deformation = np.array(rows).T
    return force, deformation


def _refused(path: str | Path, number: int, text: str) -> CoverError:
    return CoverError(f"{path}, line {number}: {shown(text)} is not two numbers, force in N and deformation in m")


def fit(force_n: Floats, deformation_m: Floats) -> StraightLine:
    """The regression line; raises :class:`CoverError` if the points do not vary."""
    force, depth = force_n - force_n.mean(), deformation_m - deformation_m.mean()
    across = float(force @ depth)
    if across == 0:
        raise CoverError("force and deformation do not vary together; there is no line")
    slope = across / float(force @ force)
    offset = float(deformation_m.mean() - slope * force_n.mean())
    return StraightLine(1 / slope, offset, across / math.sqrt(float(force @ force) * float(depth @ depth)))
