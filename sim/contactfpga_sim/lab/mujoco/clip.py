"""The robots of docs/mujoco.md side by side: their peak forces, and a clip of them in a browser without a window."""

from __future__ import annotations

import io
from pathlib import Path

import contactfpga
from contactfpga.tools.view import opening
from contactfpga.tools.view.opening import ServedView
from contactfpga.tools.view.simulated import ALL, SKINS, SimulatedSource
from contactfpga.tools.view.sources import SimulatedPace
from contactfpga_sim.lab.view import browser
from contactfpga_sim.lab.writer import table_of

ARM = contactfpga.examples() / "arm"
ROBOT, SCENE, REFLEXES = (str(ARM / name) for name in ("pushed.toml", "scene.xml", "reflexes.py"))
ENDS_S = 2.7
"""All have touched the bar, and all but one have let go."""
SHOWN = ("Stop", "BackOff")
"""Reflexes that run into the bar."""
COMES_S, TOUCHES_S = (1.4, 2.2), (2.2, 2.32)
"""Of the clip: the arms come, and the touch in slow motion."""
COMING, TOUCHING, STANDING = 9, 31, 12
"""Frames of each, and of the end, which stands."""
FRAME_MS, SETTLE_MS, QUALITY = 100, 900, 55
SIZE = 1120, 560
"""In pixels."""


class Asked(SimulatedPace):
    """Lets the robots go on up to a moment, and no further."""

    until_s = 0.0

    def due(self, simulated_s: float) -> float:
        return self.until_s - simulated_s


def paced(found: SimulatedSource) -> Asked:
    """All skins side by side, from their start on, at the pace that is asked for."""
    found.skin = ALL
    found.restart()
    pace = found.pace = Asked(0.0)
    return pace


def peaks_n(reflex: str) -> list[float]:
    """The largest force in N on the arm, by :data:`contactfpga.tools.view.simulated.SKINS`."""
    found = SimulatedSource(ROBOT, SCENE, REFLEXES)
    pace, found.reflex = paced(found), reflex
    pace.until_s = ENDS_S
    try:
        while found.simulated_s < ENDS_S - 1e-9:
            found.advance()
        return [copy.most_n["arm"] for copy in found.copies]
    finally:
        found.close()


def peaks_table() -> str:
    """For docs/mujoco.md."""
    rows = [[f"`{reflex}`", *(f"{peak:.1f}" for peak in peaks_n(reflex))] for reflex in SHOWN]
    return table_of([["largest force, N", *SKINS], *rows])


def draw(folder: Path) -> list[Path]:
    """A picture of the view, and a clip that ends with it."""
    named = opening.ViewRequest(ROBOT, mujoco=SCENE, reflex=REFLEXES)
    image, clip = folder / "arms.png", folder / "arms.webp"
    with opening.opened(named, http_port=0) as shown, browser.visit(shown, *SIZE, dark=True) as visitor:
        record(shown, visitor, image, clip)
    return [image, clip]


def record(shown: ServedView, visitor: browser.Visitor, image: Path, clip: Path) -> None:
    """Play it frame by frame."""
    from PIL import Image

    robots = shown.source
    assert isinstance(robots, SimulatedSource)
    robots.reflex = "BackOff"
    began_s, pace = robots.simulated_s, paced(robots)
    browser.tidy(visitor)
    frames = []
    for at_s in moments():
        pace.until_s = began_s + at_s
        while robots.simulated_s < pace.until_s - 1e-9:
            visitor.page.wait_for_timeout(50)
        visitor.page.wait_for_timeout(SETTLE_MS)  # the panel is written four times a second
        frames.append(Image.open(io.BytesIO(visitor.page.screenshot())).convert("RGB"))
    frames[-1].save(image)
    durations = [FRAME_MS] * (len(frames) - 1) + [FRAME_MS * STANDING]
    frames[0].save(clip, save_all=True, append_images=frames[1:], duration=durations, loop=0, quality=QUALITY)


def moments() -> list[float]:
    """Seconds since the start, of each frame."""
    spans = ((*COMES_S, COMING), (*TOUCHES_S, TOUCHING))
    return [begin + (end - begin) * step / count for begin, end, count in spans for step in range(1, count + 1)]
