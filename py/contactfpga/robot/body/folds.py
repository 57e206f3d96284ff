"""Cells that the folding cover presses at a joint: learned with nobody near, per joint angle, then marked.

Folds are by cells, as a finger beside a crease makes one zone with it.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contactfpga.inputs.files import read_small, write_text
from contactfpga.inputs.values import is_finite, shown, whole
from contactfpga.robot.body.state import BodyError
from contactfpga.zones.zone import Zones

STEP_RAD = 0.05
"""Resolution of angles."""
MAX_BYTES = 20_000_000
MAX_STEPS = 10_000
"""Most steps of an angle; a full turn needs 126."""

Cells = NDArray[np.bool_]


@dataclasses.dataclass(frozen=True, eq=False)
class Folds:
    """The folds learned for one joint and one sheet."""

    joint: str
    step_rad: float
    lines: tuple[int, int]
    """Rows and columns."""
    frames: dict[int, int]
    """Frames seen, by step number."""
    cells: dict[int, Cells]
    """(rows, columns) cells pressed in any of these frames, by step number."""

    def step_of(self, angle_rad: float) -> int:
        """Number of an angle's step."""
        return math.floor(angle_rad / self.step_rad)

    def share(self, angle_rad: float, zone: Cells) -> float | None:
        """Share of a zone's cells that the fold presses at this angle; None if nothing was learned there, or without
        cells."""
        # The steps beside it count nothing: with them twice as many fingers that touch a crease pass for it.
        step = self.step_of(angle_rad)
        if not self.frames.get(step) or not zone.any():
            return None
        return float((zone & self.cells[step]).sum() / zone.sum())

    def save(self, path: str | Path) -> None:
        """Write a JSON file that :meth:`load` reads."""
        steps = [
            {"step": step, "frames": count, "cells": np.argwhere(self.cells[step]).tolist()}
            for step, count in sorted(self.frames.items())
        ]
        values = {"joint": self.joint, "step_rad": self.step_rad, "lines": self.lines, "steps": steps}
        write_text(path, json.dumps(values) + "\n")

    @classmethod
    def load(cls, path: str | Path) -> Folds:
        """Read a file of :meth:`save`. Raises :class:`BodyError`, OSError."""
        data = read_small(path, MAX_BYTES, "a file of `contactfpga body learn`", BodyError)
        try:
            return _read(json.loads(data))
        except (ValueError, RecursionError, KeyError, TypeError, IndexError) as error:
            reason = f"{error} is missing" if isinstance(error, KeyError) else error
            raise BodyError(f"{path}: not a file of `contactfpga body learn`: {reason}") from None


def learn(joint: str, frames: Iterable[tuple[float, Zones]], step_rad: float = STEP_RAD) -> Folds:
    """Learn folds from angles in rad and frames that were taken with nobody near.

    Raises :class:`BodyError` for frames without cells.
    """
    if not is_finite(step_rad) or not 1e-4 <= step_rad <= 1:
        raise BodyError(f"step_rad is {shown(step_rad)}; it must be a number from 0.0001 to 1")
    counts: dict[int, int] = {}
    cells: dict[int, Cells] = {}
    lines = (0, 0)
    for angle, zones in frames:
        if zones.cells is None:
            raise BodyError(
                f"the board reports {zones.sheet.report!r}; folds are learned cell by cell: build its Skin with "
                'report = "cells"'
            )
        step = math.floor(angle / step_rad)
        lines = (zones.sheet.rows, zones.sheet.columns)
        counts[step] = counts.get(step, 0) + 1
        cells[step] = cells.get(step, np.zeros(lines, bool)) | zones.cells
    return Folds(joint, step_rad, lines, counts, cells)


def _read(values: Any) -> Folds:
    joint, step_rad = values["joint"], values["step_rad"]
    rows, columns = (whole(one) for one in values["lines"])
    if not isinstance(joint, str) or not is_finite(step_rad) or not 1e-4 <= step_rad <= 1:
        raise BodyError("joint must be a text, and step_rad a number from 0.0001 to 1")
    if rows is None or columns is None or not (0 <= rows <= 64 and 0 <= columns <= 64):
        raise BodyError(f"lines is {shown(values['lines'])}; it must be rows and columns, 64 at most")
    frames: dict[int, int] = {}
    cells: dict[int, Cells] = {}
    if len(values["steps"]) > MAX_STEPS:
        raise BodyError(f"it has {len(values['steps']):,} steps of angles; the limit is {MAX_STEPS:,}")
    for step in values["steps"]:
        number, count = whole(step["step"]), whole(step["frames"])
        if number is None or count is None or count < 1:
            raise BodyError(f"a step is {shown(step)}; its step and frames must be whole numbers")
        frames[number], cells[number] = count, np.zeros((rows, columns), bool)
        for row, column in step["cells"]:
            if whole(row) is None or whole(column) is None or not (0 <= row < rows and 0 <= column < columns):
                raise BodyError(f"a cell is {shown([row, column])}; the sheet has {rows}x{columns}")
            cells[number][row, column] = True
    return Folds(joint, float(step_rad), (rows, columns), frames, cells)
