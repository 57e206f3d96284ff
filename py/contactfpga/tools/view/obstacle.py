"""A ball or a hand that the mouse places in a simulated robot's way."""

from __future__ import annotations

from typing import Any

import numpy as np

NOTHING, BALL, HAND = OBSTACLES = ("none", "ball", "hand")
FASTEST_M_S = 0.5
"""Largest speed of following the mouse, as MuJoCo's contacts ignore the speed of placed bodies."""
AWAY_M = np.array([0.0, 0.0, 100.0])
AHEAD_M = 0.06
BALL_M = 0.03
STEEP = 1 / 3
"""Sine of the elevation from which the view counts as downward."""
FARTHEST = 3.0
"""Largest depth over that of the grip."""
COLORS = {BALL: (0.87, 0.56, 0.02, 1.0), HAND: (0.89, 0.67, 0.54, 1.0)}
ALL_BITS = 2**31 - 1

FINGERS_M = (-0.033, -0.011, 0.011, 0.033)


def add(spec: Any) -> None:
    """Add to a ``mujoco.MjSpec`` bodies that only :class:`Obstacle` moves."""
    import mujoco

    sphere, capsule = mujoco.mjtGeom.mjGEOM_SPHERE, mujoco.mjtGeom.mjGEOM_CAPSULE
    fingers = [((x, 0.0, 0.03), (x, -0.01, 0.115 - 20 * x * x), 0.0095) for x in FINGERS_M]
    thumb = ((0.03, 0.0, -0.02), (0.07, -0.012, 0.03), 0.011)
    forms: dict[str, list[dict[str, Any]]] = {
        BALL: [{"type": sphere, "size": [BALL_M, 0, 0]}],
        HAND: [
            {"type": mujoco.mjtGeom.mjGEOM_ELLIPSOID, "size": [0.045, 0.017, 0.055]},
            *({"type": capsule, "fromto": [*low, *high], "size": [r, 0, 0]} for low, high, r in (*fingers, thumb)),
        ],
    }
    for name, geoms in forms.items():
        body = spec.worldbody.add_body(name=f"obstacle {name}", mocap=True, pos=AWAY_M)
        for form in geoms:
            body.add_geom(**form, rgba=COLORS[name], contype=ALL_BITS, conaffinity=ALL_BITS)


class Obstacle:
    def __init__(self) -> None:
        self.kind = NOTHING
        self.wanted_m = self.at_m = AWAY_M

    def put(self, kind: str, at_m: np.ndarray) -> None:
        self.kind, self.wanted_m, self.at_m = kind, at_m, at_m

    def go_on(self, seconds: float) -> None:
        way = self.wanted_m - self.at_m
        far, most = float(np.linalg.norm(way)), FASTEST_M_S * seconds
        self.at_m = self.wanted_m if far <= most else self.at_m + way * (most / far)

    def place(self, model: Any, data: Any) -> None:
        for name in (BALL, HAND):
            number = model.body(f"obstacle {name}").mocapid[0]
            data.mocap_pos[number] = self.at_m if name == self.kind else AWAY_M


class Grip:
    """A drag in the horizontal plane seen from above, otherwise in the coordinate plane that faces the camera."""

    def __init__(self, obstacle: Obstacle, eye_m: np.ndarray, grabbed_m: np.ndarray):
        """(3,) places of the camera, and of the grip."""
        self._obstacle, self._grabbed_m, self._began_m = obstacle, grabbed_m, obstacle.at_m
        ray = grabbed_m - eye_m
        above = abs(ray[2]) >= STEEP * np.linalg.norm(ray)
        self._axis = 2 if above else int(np.abs(ray[:2]).argmax())

    def drag(self, eye_m: np.ndarray, to_m: np.ndarray) -> None:
        """Follow the mouse's ray, from the camera through a point at the grip's depth."""
        ray, axis = to_m - eye_m, self._axis
        reach = (self._grabbed_m - eye_m)[axis]
        if reach * ray[axis] > 0 and abs(reach) < FARTHEST * abs(ray[axis]):
            self._obstacle.wanted_m = self._began_m + eye_m + reach / ray[axis] * ray - self._grabbed_m
