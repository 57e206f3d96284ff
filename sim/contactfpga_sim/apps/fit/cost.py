"""Cost of Skins in LUT4, computed only as far as ranking needs."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from concurrent.futures import Executor

from contactfpga.skin import Skin
from contactfpga_hdl.board import sizes
from contactfpga_hdl.top import Top
from contactfpga_sim.apps import result_cache, size
from contactfpga_sim.apps.fit.trial import SoFar, Step, Trial, gathered

DEVICE = sizes.UP5K


def sized(
    name: str, trials: Iterable[Trial], executor: Executor, step: Step, so_far: SoFar | None = None, before: int = 0
) -> list[Trial]:
    """Trials with LUT4, the cheapest first; ``before``: pieces of this kind already done."""
    given = list(trials)
    luts: dict[Skin, int] = {}
    try:
        gathered(name, {one.skin: (luts_of, one.skin) for one in given}, executor, step, before, found=luts)
    finally:
        for one in given:
            if so_far is not None and one.skin in luts:
                so_far[one.candidate] = dataclasses.replace(one, luts=luts[one.skin])
    return sorted((dataclasses.replace(one, luts=luts[one.skin]) for one in given), key=lambda one: one.cost)


def luts_of(skin: Skin) -> int:
    """LUT4 of the design; takes seconds unless cached."""
    # A cached count spares looking at the netlist of the same Skin again.
    key = f"{result_cache.made_by(__name__, skin)} {size.tools(DEVICE)}"
    found: int = result_cache.cached("fit-luts", key, lambda: size.luts(lambda: Top(skin), DEVICE))
    return found
