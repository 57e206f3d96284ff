"""Covers to try, and how well a fingertip is felt through one."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Sequence

import numpy as np

from contactfpga.design.cover import BODIES, Cells, Cover, CoverError, Ellipse, Load, cells_of
from contactfpga.design.cover.stopping import peak_forces
from contactfpga.design.cover.task import Task
from contactfpga_sim.apps import covers, light
from contactfpga_sim.apps.light import Reading, Sensed

LIGHT = "light"
"""Light cells under tiles."""

KINDS = ("caps", "tiles", LIGHT)
"""Kinds that work with switches, or light cells, of any force."""

DOMES_N = (0.15, 0.25, 0.4, 0.6, 1.0)
LIGHTEST_N = (0.05, 0.07, 0.1, 0.14, 0.2, 0.28, 0.4)
"""Forces of the lightest level, half an octave apart."""

Faces = dict[str, Callable[[float], Cover | None]]
"""Covers by name, as functions of pitch in mm; None: no cover."""

BARE: Faces = {"bare": covers.bare}


def faces(kinds: Sequence[str] = KINDS, domes_n: Sequence[float] = DOMES_N, foam_mm: float = 2.0) -> Faces:
    """Each kind, with each switch or lightest level, under foam of this thickness."""
    found: Faces = {}
    for kind in kinds:
        if kind not in KINDS:
            found[kind] = covers.COVERS[kind]
            continue
        for force_n in LIGHTEST_N if kind == LIGHT else domes_n:
            found[f"{kind}, {force_n:g} N"] = functools.partial(_on_cells, kind, force_n, foam_mm)
    return found


def _on_cells(kind: str, force_n: float, foam_mm: float, pitch_mm: float) -> Cover:
    make = covers.capped if kind == "caps" else covers.tiled
    cell = dataclasses.replace(light.example()[2], level_n=force_n) if kind == LIGHT else None
    switch = cell.switch if cell else dataclasses.replace(covers.DOME, force_n=force_n)
    return dataclasses.replace(make(pitch_mm, switch), cell=cell, thickness_m=foam_mm * 1e-3)


def own(cover: Cover) -> Faces:
    return {"the file's": lambda pitch_mm: cover}


def refusal(cover: Cover | None, pitch_mm: tuple[float, float]) -> str:
    """Why switches at this pitch do not fit the cover, or empty."""
    if cover is None or cover.model == "patch":
        return ""
    try:
        Cells(cover, 1, 1, pitch_mm[0] * 1e-3, pitch_mm[1] * 1e-3)
    except CoverError as error:
        return str(error)
    return ""


@dataclasses.dataclass(frozen=True)
class Protection:
    """Limits of the force between an arm and a rigid body; None: no limit."""

    arm: Task
    late_n: float | None = None
    """With the arm's brake after its latency."""
    no_stop_n: float | None = None

    def refusal(self, cover: Cover | None, pitch_mm: tuple[float, float]) -> str:
        """Why a cover is not soft enough, or empty."""
        if cover is None or cover.model == "patch":
            return "it has no foam, so an arm's force has no limit"
        found = peak_forces(self.arm, cover, *(1e-3 * pitch for pitch in pitch_mm))
        late = f"if the stop comes {1e3 * self.arm.latency_s:g} ms after the touch"
        judged = ((found.late, self.late_n, late), (found.no_stop, self.no_stop_n, "without a stop"))
        return "; ".join(
            f"{force:.3g} N {when}, limit {limit:g} N"
            for force, limit, when in judged
            if limit is not None and force > limit
        )


def feels(cover: Cover | None) -> bool:
    """Whether the cover depends on force."""
    return cover is not None and cover.model != "patch"


TOUCHES = 8

FINGERTIP_M = (12e-3, 10e-3)

LINES = 9
"""Sides of the sheet; touches are on its middle cell."""


Touches = list[tuple[np.ndarray, int]]
"""(rows, columns) forces on cells, and the seed of what differs from sheet to sheet."""


def pressing(cover: Cover | None) -> Cover | None:
    """One cover for all that take the same forces: light cells do at any level."""
    return dataclasses.replace(cover, cell=light.example()[2]) if cover and cover.cell else cover


def touches(cover: Cover, pitch_mm: tuple[float, float], force_n: float, numbers: Sequence[int]) -> Touches:
    """:data:`TOUCHES` of each number by a fingertip with ``force_n``, randomly placed and turned."""
    pitch_x, pitch_y = (pitch * 1e-3 for pitch in pitch_mm)
    cells = cells_of(cover, LINES, LINES, pitch_x, pitch_y)
    indentation = cells.indentation([Ellipse(*(size / 2 for size in FINGERTIP_M))], BODIES["finger"])
    pressed, found = indentation.parts_at(indentation.depth_m(force_n)), []
    for touch in (number * TOUCHES + each for number in numbers for each in range(TOUCHES)):
        rng = np.random.default_rng([touch, LINES])
        across, down = LINES // 2 + rng.uniform(-0.5, 0.5, 2)
        parts = (tip.placed(across * pitch_x, down * pitch_y, rng.uniform(0, math.pi)) for tip in pressed)
        found.append((cells.forces_n([Load(tuple(parts), force_n)]), int(rng.integers(1 << 32))))
    return found


def unfelt(cover: Cover, pitch_mm: tuple[float, float], given: Touches) -> list[float]:
    """1 for each touch that closes no switch, or reaches no level, else 0. Closing forces and gains are drawn for
    each."""
    if cover.cell:
        lightest = Reading((cover.cell.level_n,))
        return [float(not Sensed(forces, seed).levels(lightest).any()) for forces, seed in given]
    cells = cells_of(cover, LINES, LINES, *(pitch * 1e-3 for pitch in pitch_mm))
    return [float(not (forces >= cells.drawn(seed)).any()) for forces, seed in given]
