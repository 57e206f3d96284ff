"""A body pressed on a cover: soft layers in series, each of which yields under the pressure right above it.

A layer of thickness t carries the pressure p = E e / (1 - e) at the strain e: E is its modulus at first, and it is
solid at e = 1. The body's flesh, the cover's foam and the switches' travel are such layers between the body's shape and
a rigid base. At the depth d beyond its first touch a body presses a round part, whose half axes at the depth D are a
and b, in by d (1 - (x/a')^2 - (y/b')^2) within a' = a sqrt(d/D), b' = b sqrt(d/D), and a flat part by d throughout.
With P(d) = int_0^d p, the force is

    F = A_round/D P(d) + A_flat p(d).

p is the mean pressure over the surface: layers that carry on a part of it only, such as tiles with gaps between them,
have their modulus times that part. What couples columns sideways stiffens foam of the thickness h, whole or in tiles,
by the factor 1 + 0.16 h^2/(a' b'), in a stack by its part of the depth. The force then holds to 10 % for Poisson's
ratios up to 0.2 in whole foam and up to 0.25 in tiles (the tests' finite elements); under a rigid body that touches few
tiles this is the mean over its places. The modulus of flesh is what it shows on a hard plate, coupling included.
"""

from __future__ import annotations

import bisect
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from contactfpga.design.cover.answer import CoverError, positive
from contactfpga.design.cover.numerics import Floats
from contactfpga.design.cover.patch import Ellipse, Pad, Part

COUPLING = 0.16
"""Share by which foam as thick as the patch's radius presses harder than its columns alone."""

STEPS = 385
"""Pressures in a table, 6 % apart."""

RANGE = 1e-6, 1e4
"""Least and largest of these pressures, over the modulus of the softest layer."""


FLAT = 4.0
"""Pressure over the modulus at which a layer is pressed to 4/5."""


class Layer(NamedTuple):
    """A soft layer: p = E e / (1 - e)."""

    thickness_m: float
    modulus_pa: float
    """E of small strains, times the part of the surface that carries."""
    coupled: bool = False
    """Whether its columns couple sideways: foam's do; the modulus of flesh contains that."""

    def pressed_m(self, pressure_pa: Floats) -> Floats:
        """Compression under a pressure."""
        return np.asarray(self.thickness_m * pressure_pa / (self.modulus_pa + pressure_pa))


class Spring(NamedTuple):
    """Switches that give way in proportion to the force, up to their travel."""

    stiffness_pa_m: float
    """Pressure per travel: a switch's stiffness over the area of the surface that rests on it, gaps included."""
    travel_m: float

    def pressed_m(self, pressure_pa: Floats) -> Floats:
        """Travel under a pressure."""
        return np.asarray(np.minimum(pressure_pa / self.stiffness_pa_m, self.travel_m))


class Body(NamedTuple):
    """What presses the cover."""

    name: str
    depth_m: float
    """Depth D at which its parts have their half axes."""
    flesh: Layer | None
    """None: rigid."""
    source: str

    def ball(self, radius_m: float) -> Ellipse:
        """The part of a round body: at the depth D it reaches to sqrt(2 R D)."""
        half = math.sqrt(2 * positive("radius_m", radius_m, "m") * self.depth_m)
        return Ellipse(half, half)


BODIES = {
    body.name: body
    for body in (
        Body(
            "finger",
            3e-3,
            Layer(6e-3, 55e3),
            "chosen: 12 x 10 mm of contact and 3 mm of depth at 2 N on a hard plate, stiffer with each mm",
        ),
        Body("palm", 5e-3, Layer(10e-3, 40e3), "chosen: softer and thicker than a finger's pad"),
        Body("forearm", 5e-3, Layer(15e-3, 40e3), "chosen: muscle on bone"),
        Body("rigid", 1e-3, None, "a bumper or tool"),
    )
}


class Indentation:
    """Parts of a body on layers in series.

    ``depth_m``: the depth at which the parts have their half axes. Raises CoverError if nothing is soft.
    """

    def __init__(self, parts: Sequence[Part], depth_m: float, layers: Sequence[Layer | Spring]):
        moduli = [layer.modulus_pa for layer in layers if isinstance(layer, Layer)]
        if not moduli:
            raise CoverError("neither body nor cover is soft; give the body flesh or the cover foam")
        self._parts, self._full_m = tuple(parts), positive("depth_m", depth_m, "m")
        pressure = np.append(0.0, min(moduli) * np.geomspace(*RANGE, STEPS - 1))
        self._pressure_pa: Floats = pressure
        pressed = [(layer, layer.pressed_m(pressure)) for layer in layers]
        self._depth_m: Floats = sum((each for _, each in pressed), np.zeros(STEPS))
        foams = ((layer.thickness_m**2, each) for layer, each in pressed if isinstance(layer, Layer) and layer.coupled)
        self._coupling_m3: Floats = COUPLING * sum((square * each for square, each in foams), np.zeros(STEPS))
        means = (pressure[1:] + pressure[:-1]) / 2
        self.flat_m = float(sum(layer.pressed_m(np.array(FLAT * min(moduli))) for layer in layers))
        """Depth at which the softest layer is pressed to 4/5."""
        self._integral = np.append(0.0, (np.diff(self._depth_m) * means).cumsum())
        force_n: Floats = sum((self._of(part) for part in self._parts), np.zeros(STEPS))
        self._depths, self._forces = self._depth_m.tolist(), force_n.tolist()

    def force_n(self, depth_m: float) -> float:
        """Force at a depth; 0 above the surface. It goes on linearly once all layers are pressed solid."""
        return _between(self._depths, self._forces, depth_m)

    def depth_m(self, force_n: float) -> float:
        """Depth at a force."""
        return _between(self._forces, self._depths, force_n)

    def parts_at(self, depth_m: float) -> tuple[Part, ...]:
        """The parts as they are pressed at a depth above 0."""
        return tuple(self._at(part, depth_m) for part in self._parts)

    def _of(self, part: Part) -> Floats:
        if not isinstance(part, Ellipse):
            return np.asarray(part.area_m2 * self._pressure_pa)
        grown = part.half_x_m * part.half_y_m / self._full_m * self._depth_m[1:] ** 2
        more = np.append(1.0, 1 + self._coupling_m3[1:] / grown)
        return np.asarray(part.area_m2 / self._full_m * self._integral * more)

    def _at(self, part: Part, depth_m: float) -> Part:
        if not isinstance(part, Ellipse):
            return part
        pressures = np.interp(depth_m * Pad.SHARES, self._depth_m, self._pressure_pa)
        return Pad.of(part, math.sqrt(depth_m / self._full_m), pressures)


def _between(places: list[float], values: list[float], place: float) -> float:
    """A table's value, 0 before it; faster than numpy's for a single place."""
    if place <= 0:
        return 0.0
    at = min(bisect.bisect_right(places, place), len(places) - 1)
    rise = (values[at] - values[at - 1]) / (places[at] - places[at - 1])
    return values[at - 1] + rise * (place - places[at - 1])
