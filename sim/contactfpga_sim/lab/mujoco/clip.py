"""Arms of docs/mujoco.md side by side: peak forces, and a clip."""

from __future__ import annotations

import dataclasses
import io
import math
from pathlib import Path

import numpy as np

import contactfpga
from contactfpga.driver.pace import Pace
from contactfpga.tools.view import opening
from contactfpga.tools.view.opening import ServedView
from contactfpga.tools.view.simulated import ALL, KIT, SKINS, SimulatedSource
from contactfpga_sim.lab.view import browser
from contactfpga_sim.lab.writer import table_of

ARM = contactfpga.examples() / "arm"
ROBOT, SCENE, REFLEXES = (str(ARM / name) for name in ("pushed.toml", "scene.xml", "reflexes.py"))
REFLEX = "BackOff"
MEETINGS = 12
NEAR_RAD, SPREAD_RAD = 0.4, 0.01
"""Start angle before the bar, and its range, for random phases of scan and step."""
STEP_S, ENDS_S = 1e-3, 0.25
"""MuJoCo's step, and a time by which all arms touched the bar and all but one let go."""
COMES_S, TOUCHES_S = (1.38, 2.18), (2.18, 2.292)
"""Times of approach and slow motion."""
COMING, TOUCHING, STANDING = 10, 28, 15
FRAME_MS, SETTLE_MS, QUALITY = 100, 900, 55
WIDTH, HEIGHT, TALL = 1120, 400, 700
"""Pixels; TALL while choosing, lest the panel scroll."""


class Asked(Pace):
    """A pace that runs the robots up to a given moment."""

    until_s = 0.0

    def due(self, at_s: float) -> float:
        return self.until_s - at_s


def paced(found: SimulatedSource) -> Asked:
    """All skins side by side, at the requested pace."""
    found.skin = ALL
    found.restart()
    pace = found.pace = Asked(0.0)
    return pace


@dataclasses.dataclass(frozen=True)
class Met:
    late_s: float
    """Time from the touch to the reflex's command; nan: none."""
    peak_n: float


def meet(angle: float) -> list[Met]:
    """The example's arm with reflex in each of :data:`contactfpga.tools.view.simulated.SKINS`, from this angle."""
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


def draw(folder: Path) -> Path:
    named = opening.ViewRequest(ROBOT, mujoco=SCENE, reflex=REFLEXES)
    clip = folder / "arms.webp"
    with opening.opened(named, http_port=0) as shown, browser.visit(shown, WIDTH, TALL, dark=True) as visitor:
        record(shown, visitor, clip)
    return clip


def record(shown: ServedView, visitor: browser.Visitor, clip: Path) -> None:
    from PIL import Image

    robots = shown.source
    assert isinstance(robots, SimulatedSource)
    browser.tidy(visitor)
    visitor.choose(robots.reflex, REFLEX)
    visitor.choose(KIT, ALL)
    while len(robots.copies) < len(SKINS):
        visitor.page.wait_for_timeout(50)
    visitor.page.wait_for_timeout(SETTLE_MS)  # the page says where its camera is now
    visitor.page.set_viewport_size({"width": WIDTH, "height": HEIGHT})
    pace = paced(robots)
    visitor.page.wait_for_timeout(SETTLE_MS)
    began_s = robots.simulated_s
    frames = []
    for at_s in moments():
        pace.until_s = began_s + at_s
        while robots.simulated_s < pace.until_s - 1e-9:
            visitor.page.wait_for_timeout(50)
        visitor.page.wait_for_timeout(SETTLE_MS)  # the panel is written four times a second
        frames.append(Image.open(io.BytesIO(visitor.page.screenshot())).convert("RGB"))
    durations = [FRAME_MS] * (len(frames) - 1) + [FRAME_MS * STANDING]
    frames[0].save(clip, save_all=True, append_images=frames[1:], duration=durations, loop=0, quality=QUALITY)


def moments() -> list[float]:
    """Time of each frame since the start."""
    spans = ((*COMES_S, COMING), (*TOUCHES_S, TOUCHING))
    return [begin + (end - begin) * step / count for begin, end, count in spans for step in range(1, count + 1)]
