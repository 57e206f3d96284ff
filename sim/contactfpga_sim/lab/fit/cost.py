"""What Skins cost: LUT4 from synthesis, worked out for no more of them than the order of the cheapest needs."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor

from contactfpga.skin import Skin
from contactfpga_hdl.board import sizes
from contactfpga_hdl.top import Top
from contactfpga_sim.lab import kept, size
from contactfpga_sim.lab.fit.candidates import SHEET
from contactfpga_sim.lab.fit.trial import SoFar, Step, Trial, gathered

DEVICE = sizes.UP5K
"""For which LUT4 are counted."""


def cheapest(
    name: str,
    trials: Iterable[Trial],
    limit: Callable[[Sequence[Trial]], float],
    executor: Executor,
    step: Step,
    so_far: SoFar | None = None,
) -> list[Trial]:
    """Those of the trials that can have as many LUT4 as ``limit``, which is given those found so far, or fewer; with
    their LUT4, the cheapest first.

    The same method is taken to need no fewer LUT4 on a sheet with more rows and columns: where a coarser sheet
    is above the limit, no finer one is synthesized.
    """
    found: list[Trial] = []
    left = list(trials)
    while left:
        most = limit(found)
        over = [one for one in found if one.luts is not None and one.luts > most]
        left = [one for one in left if not any(_finer(one, other) for other in over)]
        batch = [one for one in left if not any(_finer(one, other) for other in left)]
        luts: dict[Skin, int] = {}
        try:
            gathered(name, {one.skin: (luts_of, one.skin) for one in batch}, executor, step, len(found), luts)
        finally:
            for one in batch:
                if so_far is not None and one.skin in luts:
                    so_far[one.candidate] = dataclasses.replace(one, luts=luts[one.skin])
        found += [dataclasses.replace(one, luts=luts[one.skin]) for one in batch]
        left = [one for one in left if one.skin not in luts]
    return sorted(found, key=lambda one: one.cost)


def second(found: Sequence[Trial]) -> float:
    """LUT4 of the runner-up: a limit for :func:`cheapest`."""
    return sorted([one.cost[0] for one in found] + [float("inf")] * 2)[1]


def _finer(one: Trial, other: Trial) -> bool:
    """The same but for a sheet with more rows or columns, and none fewer."""
    lines = [(trial.skin.rows, trial.skin.columns) for trial in (one, other)]
    more = lines[0] != lines[1] and all(mine >= theirs for mine, theirs in zip(*lines, strict=True))
    return more and _method(one) == _method(other)


def _method(trial: Trial) -> list[tuple[str, object]]:
    return [setting for setting in trial.candidate.settings if setting[0] not in SHEET]


def luts_of(skin: Skin) -> int:
    """LUT4 of the whole design on the :data:`DEVICE`; takes some seconds where they are not kept."""
    key = f"{kept.made_by(__name__, skin)} {size.tools(DEVICE)}"  # spares looking at the netlist of the same Skin again
    found: int = kept.kept("fit-luts", key, lambda: size.luts(lambda: Top(skin), DEVICE))
    return found
