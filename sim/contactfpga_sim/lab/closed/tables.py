"""Cost of zones over the seam of a closed sheet and of extents, for docs/labelling.md."""

from __future__ import annotations

import functools
import itertools
from typing import Any

import numpy as np

from contactfpga.choices.labellers import LABELLERS, Labeller
from contactfpga.skin import Skin
from contactfpga_hdl.board import sizes
from contactfpga_sim.apps import pool, size
from contactfpga_sim.lab import writer
from contactfpga_sim.model.golden import volume

CLOSED = [name for name, labeller in LABELLERS.items() if labeller.closed]
COLUMNS = 8
"""Columns whose last two rows are all tried."""
AROUND: dict[str, Any] = {"surface": "cylinder", "radius_mm": 30.0, "closed": True}


def skin_of(lines: int, connectivity: int, labeller: Labeller, closed: bool, extent: bool = False) -> Skin:
    values = {"connectivity": connectivity, "labeller": labeller, "extent": extent, **(AROUND if closed else {})}
    return Skin(rows=lines, columns=lines, settle_us=30.0, **values)


def clocks_table() -> str:
    head = ("labeller", "connectivity", f"worst of all last rows of {COLUMNS} columns: open", "closed")
    bounds = [f"bound of {lines} columns" for lines in size.SIZES]
    rows = [(*names(labeller, connectivity), *worst(labeller, connectivity), *most(labeller, connectivity))
            for labeller in map(LABELLERS.__getitem__, CLOSED) for connectivity in (8, 4)]  # fmt: skip
    return writer.table_of([(*head, *bounds), *rows])


def size_table() -> str:
    sheets = ("open", "open, extents", "closed", "closed, extents")
    head = ["labeller", "connectivity", *(f"{lines}x{lines}: {sheet}" for lines in (16, 32) for sheet in sheets)]
    with pool.executor() as workers:
        return writer.table_of([head, *workers.map(_sizes, *zip(*itertools.product(CLOSED, (8, 4))))])


def _sizes(name: str, connectivity: int) -> list[str]:
    labeller = LABELLERS[name]
    return [*names(labeller, connectivity), *luts(labeller, connectivity, 16), *luts(labeller, connectivity, 32)]


def names(labeller: Labeller, connectivity: int) -> tuple[str, str]:
    return f"`{labeller.title}`", str(connectivity)


def worst(labeller: Labeller, connectivity: int) -> list[str]:
    """Most clocks from the last row to the last record over all last two rows, open and closed."""
    cells = 2 * COLUMNS
    numbers = np.arange(1 << cells)[:, None] >> np.arange(cells) & 1
    frames = numbers.astype(bool).reshape(-1, 2, COLUMNS)
    both = (volume.last_record_clocks(frames, connectivity, labeller, closed).max() for closed in (False, True))
    return [str(clocks) for clocks in both]


def most(labeller: Labeller, connectivity: int) -> list[str]:
    """Bound for every closed sheet, whose end mark is a clock later."""
    skins = (skin_of(lines, connectivity, labeller, True) for lines in size.SIZES)
    return [str(skin.derived.label_clocks - 1) for skin in skins]


def luts(labeller: Labeller, connectivity: int, lines: int) -> list[str]:
    skins = (
        skin_of(lines, connectivity, labeller, closed, extent) for closed in (False, True) for extent in (False, True)
    )
    return [f"{size.luts(functools.partial(labeller.load_gateware(), skin), sizes.UP5K):,}" for skin in skins]


def clocks_sample() -> str:
    labeller = LABELLERS["run"]
    return writer.line((*names(labeller, 8), *worst(labeller, 8), *most(labeller, 8)))
