"""Cells that the folding cover presses at a joint: learned with nobody near, per joint angle, then marked.

Folds are by cells, as a finger beside a crease makes one zone with it. Where the board tells levels of force, a cell
above the level that the fold reaches is a touch.
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
from contactfpga.skin import Skin
from contactfpga.skin.derived import MAX_RULER
from contactfpga.skin.sheet import MAX_LEVELS
from contactfpga.zones.zone import Zones

STEP_RAD = 0.05
"""Resolution of angles."""
MAX_BYTES = 20_000_000
MAX_STEPS = 10_000
"""Most steps of an angle; a full turn needs 126."""

VERSION = 2
"""Version of the file. The first one, which states none, has cells without levels."""
LATER = 1.5
"""Factor of the instants at which harder levels are sampled while folds are learned. A cell whose resistance falls as
1/F then reaches a level at two thirds of its force, which leaves a margin for folds that press harder later."""

Levels = NDArray[np.integer[Any] | np.bool_]
"""(rows, columns) level of each cell, 0 at rest; pressed or not where there is one level."""


@dataclasses.dataclass(frozen=True, eq=False)
class Folds:
    """The folds learned for one joint and one sheet."""

    joint: str
    step_rad: float
    lines: tuple[int, int]
    """Rows and columns."""
    frames: dict[int, int]
    """Frames seen, by step number."""
    reached: dict[int, Levels]
    """Highest level of each cell in any of these frames, by step number."""
    levels: int = 1
    """Levels of force that the board tells."""

    def step_of(self, angle_rad: float) -> int:
        """Number of an angle's step."""
        return math.floor(angle_rad / self.step_rad)

    def explained(self, angle_rad: float) -> Levels | None:
        """Highest level of each cell that the fold may reach at this angle; None if nothing was learned there.

        With several levels these are also the levels of the steps beside it, and the lightest level of all cells next
        to those that the fold presses.
        """
        step = self.step_of(angle_rad)
        if not self.frames.get(step):
            return None
        if self.levels == 1:  # with the steps beside it twice as many fingers that touch a crease would pass for it
            return self.reached[step]
        most = np.max([self.reached[one] for one in range(step - 1, step + 2) if one in self.reached], axis=0)
        around = np.lib.stride_tricks.sliding_window_view(np.pad(most > 0, 1), (3, 3)).any(axis=(2, 3))
        explained: Levels = np.maximum(most, around)
        return explained

    def share(self, angle_rad: float, zone: Levels) -> float | None:
        """Share of a zone's cells that are at most at the level of the fold at this angle; ``zone`` is 0 on all other
        cells. None if nothing was learned there, or without cells."""
        explained = self.explained(angle_rad)
        if explained is None or not zone.any():
            return None
        return float(((zone > 0) & (zone <= explained)).sum() / (zone > 0).sum())

    def save(self, path: str | Path) -> None:
        """Write a JSON file that :meth:`load` reads."""
        # A row of three numbers for each cell that is not at rest: row, column, level.
        cells = {step: np.column_stack([np.argwhere(most), most[most > 0]]) for step, most in self.reached.items()}
        steps = [
            {"step": step, "frames": count, "cells": cells[step].tolist()}
            for step, count in sorted(self.frames.items())
        ]
        values = {"version": VERSION, "joint": self.joint, "step_rad": self.step_rad, "lines": self.lines}
        values |= {"levels": self.levels, "steps": steps}
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
    reached: dict[int, Levels] = {}
    lines, levels = (0, 0), 1
    for angle, zones in frames:
        if zones.cells is None:
            raise BodyError(
                f"the board reports {zones.sheet.report!r}; folds are learned cell by cell: build its Skin with "
                'report = "cells"'
            )
        step = math.floor(angle / step_rad)
        lines, levels = (zones.sheet.rows, zones.sheet.columns), zones.sheet.levels
        counts[step] = counts.get(step, 0) + 1
        reached[step] = np.maximum(reached.get(step, 0), zones.cells if zones.levels is None else zones.levels)
    return Folds(joint, step_rad, lines, counts, reached, levels)


def instants(skin: Skin) -> tuple[int, ...]:
    """Instants in sixteenths of the ruler's time at which a board samples its harder levels while folds are
    learned."""
    return tuple(min(MAX_RULER, round(LATER * one)) for one in skin.harder)


def _read(values: Any) -> Folds:
    joint, step_rad = values["joint"], values["step_rad"]
    rows, columns = (whole(one) for one in values["lines"])
    if not isinstance(joint, str) or not is_finite(step_rad) or not 1e-4 <= step_rad <= 1:
        raise BodyError("joint must be a text, and step_rad a number from 0.0001 to 1")
    if rows is None or columns is None or not (0 <= rows <= 64 and 0 <= columns <= 64):
        raise BodyError(f"lines is {shown(values['lines'])}; it must be rows and columns, 64 at most")
    version = whole(values.get("version", 1))
    levels = whole(values["levels"]) if version == VERSION else 1
    if version not in (1, VERSION) or levels is None or not 1 <= levels <= MAX_LEVELS:
        raise BodyError(f"it must have version {VERSION} at most, and from 1 to {MAX_LEVELS} levels of force")
    frames: dict[int, int] = {}
    reached: dict[int, Levels] = {}
    if len(values["steps"]) > MAX_STEPS:
        raise BodyError(f"it has {len(values['steps']):,} steps of angles; the limit is {MAX_STEPS:,}")
    for step in values["steps"]:
        number, count = whole(step["step"]), whole(step["frames"])
        if number is None or count is None or count < 1:
            raise BodyError(f"a step is {shown(step)}; its step and frames must be whole numbers")
        frames[number], reached[number] = count, np.zeros((rows, columns), np.uint8)
        for cell in step["cells"]:
            row, column, level = cell if version == VERSION else (*cell, 1)
            limits = ((0, row, rows - 1), (0, column, columns - 1), (1, level, levels))
            if any(whole(one) is None or not low <= one <= high for low, one, high in limits):
                raise BodyError(f"a cell is {shown(cell)}; the sheet has {rows}x{columns} and {levels} levels")
            reached[number][row, column] = level
    return Folds(joint, float(step_rad), (rows, columns), frames, reached, levels)
