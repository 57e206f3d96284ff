"""From the first touch of the foam to the last byte of the first frame that reports a contact.

Mechanics: with the force that rises, when which switch closes. Electronics: from the first closed switch on, by the
golden model, on a board whose scan is anywhere in its round by then.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Sequence

import numpy as np

from contactfpga.design.cover import Cover
from contactfpga.skin import Skin
from contactfpga_sim.lab.chart import errors, speed
from contactfpga_sim.lab.chart.errors import Interval, Quantile
from contactfpga_sim.model.scenes.scene import Scene

HALVINGS = 14
"""Of the time in which the force rises, until it is known when the first switch closes: to 12 us where it rises for
200 ms."""

LOOKS_S = (0.0, 1e-4, 2e-4, 4e-4, 8e-4)
"""From the first closed switch on, when it is looked which ones are closed by then."""

Closing = tuple[float, list[tuple[float, np.ndarray]]]
"""When the first switch closes in s after the touch, and from how many s later on which (R, C) bool cells are closed.
"""

Raw = dict[str, list[float]]
"""By name of a time, a value for each touch."""


@dataclasses.dataclass(frozen=True)
class Times:
    """Of a method's touches; all times in us."""

    touch_median_us: Quantile
    """From the first touch of the foam; a touch that no frame ever reports counts as infinite."""
    touch_q95_us: Quantile
    electric_median_us: Quantile
    """Of the touches that close a switch: from the first closed one on."""
    electric_q95_us: Quantile
    not_felt: Interval
    """Share of the touches that close no switch."""
    bytes: float
    """Of the first frame: median."""
    lower_bound_us: float
    """What the bits of these bytes take."""


def at_once(cover: Cover | None) -> bool:
    """Whether this is a bare sheet: it knows no force, so all that a contact presses closes at the touch."""
    return cover is None or cover.model == "patch"


def closing(scene: Scene, skin: Skin, cover: Cover | None) -> Closing | None:
    """How a touch closes switches; None where it closes none at its whole force."""
    settled = scene.pressed(scene.settled_s, skin, cover)
    if not settled.any():
        return None
    if at_once(cover):
        return 0.0, [(0.0, settled)]
    before, first = 0.0, scene.settled_s
    for _ in range(HALVINGS):
        middle = (before + first) / 2
        if scene.pressed(middle, skin, cover).any():
            first = middle
        else:
            before = middle
    looks = [(late, scene.pressed(first + late, skin, cover)) for late in LOOKS_S]
    changes = (later for one, later in itertools.pairwise(looks) if not np.array_equal(one[1], later[1]))
    return first, [looks[0], *changes]


def measured(scenes: Sequence[Scene], skin: Skin, cover: Cover | None, first: int, checked: int) -> Raw:
    """Times of touches with the numbers from ``first`` on; those below ``checked`` also go through the compiled
    gateware, which must agree in every clock, else :class:`contactfpga_sim.verify.cosim.compare.Mismatch` is raised."""
    found: Raw = {"touch": [], "electric": [], "bytes": []}
    for number, scene in enumerate(scenes, first):
        values = (math.inf, math.nan, math.nan)
        if close := closing(scene, skin, cover):
            pieces = [(round(late * skin.clock_hz), cells) for late, cells in close[1]]
            clocks, size = speed.first_report(skin, pieces, number * speed.GOLDEN % 1, check=number < checked)
            electric = clocks * 1e6 / skin.clock_hz
            values = (1e6 * close[0] + electric, electric, float(size))
        for name, value in zip(found, values, strict=True):
            found[name].append(value)
    return found


def summed(pieces: Sequence[Raw], skin: Skin) -> Times:
    """What a method's touches say together."""
    touch, electric, sizes = ([value for piece in pieces for value in piece[name]] for name in pieces[0])
    closed = [value for value in electric if not math.isnan(value)]
    usual = errors.quantile([size for size in sizes if not math.isnan(size)], 0.5).value
    return Times(
        errors.quantile(touch, 0.5),
        errors.quantile(touch, 0.95),
        errors.quantile(closed, 0.5),
        errors.quantile(closed, 0.95),
        errors.interval([float(math.isinf(value)) for value in touch]),
        usual,
        usual * 10 * skin.derived.bit_clocks * 1e6 / skin.clock_hz,
    )
