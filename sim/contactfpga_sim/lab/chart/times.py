"""Times from the foam's first touch to the last byte of the first frame that reports a contact.

Switches close as force rises; from the first closed one on, the golden model counts, at a random phase of the scan.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Sequence

import numpy as np

from contactfpga.design.cover import Cover
from contactfpga.skin import Skin
from contactfpga_sim.apps import score, speed, stats
from contactfpga_sim.apps.score import Interval
from contactfpga_sim.apps.stats import Quantile
from contactfpga_sim.model.scenes.scene import Scene

HALVINGS = 14
"""Bisections of the rise time: to 12 us for 200 ms."""

LOOKS_S = (0.0, 1e-4, 2e-4, 4e-4, 8e-4)
"""Sampling times after the first closed switch."""

Closing = tuple[float, list[tuple[float, np.ndarray]]]
"""Seconds from touch to first closed switch, and (R, C) bool cells by seconds after it."""

Raw = dict[str, list[float]]


@dataclasses.dataclass(frozen=True)
class Times:
    """Times of a method's touches, in us."""

    touch_median_us: Quantile
    """Time from the foam's first touch; unreported touches count as infinite."""
    touch_q95_us: Quantile
    electric_median_us: Quantile
    """Time from the first closed switch, over touches that close one."""
    electric_q95_us: Quantile
    not_felt: Interval
    """Share of touches that close no switch."""
    bytes: float
    lower_bound_us: float


def at_once(cover: Cover | None) -> bool:
    """Whether all of a contact closes at the touch: on a bare sheet, without force."""
    return cover is None or cover.model == "patch"


def closing(scene: Scene, skin: Skin, cover: Cover | None) -> Closing | None:
    """How a touch closes switches; None if its full force closes none."""
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
    """Times of touches from number ``first``; for those below ``checked`` the compiled gateware must agree in every
    clock, else :class:`~contactfpga_sim.verify.cosim.compare.Mismatch`."""
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
    touch, electric, sizes = ([value for piece in pieces for value in piece[name]] for name in pieces[0])
    closed = [value for value in electric if not math.isnan(value)]
    usual = stats.quantile([size for size in sizes if not math.isnan(size)], 0.5).value
    return Times(
        stats.quantile(touch, 0.5),
        stats.quantile(touch, 0.95),
        stats.quantile(closed, 0.5),
        stats.quantile(closed, 0.95),
        score.interval([float(math.isinf(value)) for value in touch]),
        usual,
        usual * 10 * skin.derived.bit_clocks * 1e6 / skin.clock_hz,
    )
