"""The picture of docs/body.md: the example's robot in the view."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from contactfpga import examples
from contactfpga.tools.view import opening
from contactfpga.tools.view.bodies import BodySource, BodyView
from contactfpga.tools.view.cameras import Placed, Side, fitted
from contactfpga_sim.lab.view import browser

SIZE = 1120, 660
ANGLES = {"L_ELBOW_P": -0.8, "L_SHOULDER_R": 1.2}
"""In rad; a raised arm parts the labels of its contacts."""
SIDE = Side(np.array([0.9, 0.3, 0.3]), np.array([0.0, 0.0, 1.0]))
LOWEST_M = -0.05
"""Height of the hips in the base frame."""
SETTLED_MS = 3000
TRIES = 10
"""The view refits its camera when the panel has changed the canvas, on a busy machine late."""


def draw(folder: Path) -> Path:
    image = folder / "robot.png"
    robot = opening.ViewRequest(port=str(examples() / "robot.toml"))
    with opening.opened(robot, http_port=0) as shown, browser.visit(shown, *SIZE, dark=True) as visitor:
        assert isinstance(shown.source, BodySource)
        assert isinstance(shown.view, BodyView)
        shown.source.title = "examples/robot.toml"
        shown.source.angles.update(ANGLES)
        browser.tidy(visitor)
        visitor.page.wait_for_timeout(SETTLED_MS)
        (client,) = shown.web.get_clients().values()
        points_m = shown.view.stage.points_m()
        shown_m = points_m[points_m[:, 2] > LOWEST_M]
        for _ in range(TRIES):
            placed = _look(client.camera, shown_m)
            visitor.page.wait_for_timeout(SETTLED_MS)
            if np.allclose(client.camera.position, placed.position, atol=1e-3):
                break
        else:
            raise TimeoutError(f"the page's camera moved after each of {TRIES} tries; draw again on an idle machine")
        visitor.page.screenshot(path=str(image))
    return image


def _look(camera: Any, points_m: np.ndarray) -> Placed:
    placed = fitted(points_m, SIDE, camera.aspect, camera.fov)
    with camera.client.atomic():
        camera.up_direction = SIDE.up
        camera.position, camera.look_at = placed.position, placed.look_at
    return placed
