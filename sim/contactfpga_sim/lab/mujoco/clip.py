"""Peak forces of the arms of docs/mujoco.md, side by side."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

import contactfpga
from contactfpga.driver.pace import Pace
from contactfpga.tools.view.robot_source import ALL, SKINS, SimulatedSource
from contactfpga_sim.lab.writer import table_of

ARM = contactfpga.examples() / "arm"
ROBOT, SCENE, REFLEXES = (str(ARM / name) for name in ("pushed.toml", "scene.xml", "reflexes.py"))
REFLEX = "BackOff"
MEETINGS = 12
NEAR_RAD, SPREAD_RAD = 0.4, 0.01
"""Start angle before the bar, and its range, for random phases of scan and step."""
STEP_S, ENDS_S = 1e-3, 0.25
"""MuJoCo's step, and a time by which all arms touched the bar and all but one let go."""


class SteppedPace(Pace):
    """A pace that runs the robots up to a given moment."""

    until_s = 0.0

    def due(self, at_s: float) -> float:
        return self.until_s - at_s


def paced(found: SimulatedSource) -> SteppedPace:
    """All skins side by side, at the requested pace."""
    found.skin = ALL
    found.restart()
    pace = found.pace = SteppedPace(0.0)
    return pace


@dataclasses.dataclass(frozen=True)
class Met:
    late_s: float
    """Time from the touch to the reflex's command; nan: none."""
    peak_n: float


def meet(angle: float) -> list[Met]:
    """The example's arm with reflex in each of :data:`contactfpga.tools.view.robot_source.SKINS`, from this angle."""
    robots = SimulatedSource(ROBOT, SCENE, REFLEXES)
    robots.reflex, pace = REFLEX, paced(robots)
    robots.advance()
    for copy in robots.copies:
        copy.sheets.data.qpos[0] = angle
    told = [copy.sheets.data.ctrl[0] for copy in robots.copies]
    touched_s, acted_s = math.nan, [math.nan] * len(SKINS)
    while pace.until_s < ENDS_S:
        pace.until_s += STEP_S
        robots.advance()
        if math.isnan(touched_s) and robots.copies[0].force_n("arm"):
            touched_s = pace.until_s
        for number, copy in enumerate(robots.copies):
            if math.isnan(acted_s[number]) and copy.sheets.data.ctrl[0] != told[number]:
                acted_s[number] = pace.until_s
    robots.close()
    return [Met(at_s - touched_s, copy.most_n["arm"]) for at_s, copy in zip(acted_s, robots.copies)]


def peaks_table() -> str:
    rng = np.random.default_rng(0)
    found = [meet(NEAR_RAD + rng.uniform(0, SPREAD_RAD)) for _ in range(MEETINGS)]
    late_ms, peak_n = (
        np.array([[getattr(one, key) for one in each] for each in found]) for key in ("late_s", "peak_n")
    )
    rows = [
        ["from the touch to the reflex, ms", *map(_ranged, 1e3 * late_ms.T)],
        ["largest force, N", *map(_ranged, peak_n.T)],
    ]
    return table_of([["", *SKINS], *rows])


def _ranged(values: np.ndarray) -> str:
    if np.isnan(values).any():
        return "never"
    return f"{np.median(values):.1f} ({values.min():.1f} to {values.max():.1f})"
