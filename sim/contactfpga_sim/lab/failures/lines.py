"""Knobs of single lines and switches: broken lines, switches and columns that stick."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from contactfpga.skin import Skin
from contactfpga_sim.lab.failures.electric import finger, judged
from contactfpga_sim.lab.failures.knob import Knob, Outcome
from contactfpga_sim.lab.failures.rig import (
    GUARDED,
    REFERENCE,
    REVERSAL,
    REVERSAL_GUARDED,
    Rig,
    hello_clocks,
    still,
)
from contactfpga_sim.model.sheet import guards
from contactfpga_sim.model.sheet.wiring import Wiring


def _broken(skin: Skin, line: str, count: float) -> Outcome:
    """``line``: row or column."""
    cells = np.zeros((skin.rows, skin.columns), bool)
    cells[4:11, 5:12] = True
    lines = tuple(range(7, 7 + int(count)))
    cut = dict.fromkeys(lines, 0)
    cuts = guards.LineCuts(cut, {}) if line == "row" else guards.LineCuts({}, cut)
    return judged(still(skin, cells, cuts), cells, [cells])


BROKEN = Knob(
    name="broken",
    title="Lines that are broken under a contact of 7x7 cells",
    axis="broken lines side by side",
    amount="cells that read pressed",
    values=(0, 1, 2, 3),
    runs={
        "row": functools.partial(_broken, REFERENCE, "row"),
        "column": functools.partial(_broken, REFERENCE, "column"),
        "row, with guard lines": functools.partial(_broken, GUARDED, "row"),
        "column, with guard lines": functools.partial(_broken, GUARDED, "column"),
    },
    helps="guard lines; `contactfpga wire` shows lines that never read pressed",
    unnoticed="what is past a break looks like switches that nobody presses; only one that is closed for good shows "
    "it, and guard lines have these",
)

BROKEN_REVERSAL = dataclasses.replace(
    BROKEN,
    name="broken_reversal",
    title="Lines that are broken, by line reversal",
    runs={
        "row": functools.partial(_broken, REVERSAL, "row"),
        "column": functools.partial(_broken, REVERSAL, "column"),
        "row, with guard lines": functools.partial(_broken, REVERSAL_GUARDED, "row"),
        "column, with guard lines": functools.partial(_broken, REVERSAL_GUARDED, "column"),
    },
)

STUCK_SPOTS = [(2, 3), (12, 2), (5, 12), (13, 13), (1, 9), (9, 14)]
MASKED = REFERENCE.replace(mask=tuple(STUCK_SPOTS[:3]))


def _stuck(skin: Skin, count: float) -> Outcome:
    touch = finger(skin, (7, 7))
    closed = np.zeros_like(touch)
    for row, column in STUCK_SPOTS[: int(count)]:
        closed[row, column] = True
    zones = still(skin, Wiring(closed=closed).read(touch)[0])
    return judged(zones, touch | closed, [touch])


def _stuck_columns(skin: Skin, count: float) -> Outcome:
    touch = finger(skin, (7, 7))
    columns = np.zeros(skin.columns, bool)
    columns[[2, 12, 4, 14, 0, 10][: int(count)]] = True
    with Rig(skin) as rig:
        rig.board.stick(columns)
        rig.board.hold(touch[None], hello_clocks(skin) + 4 * skin.derived.frame_clocks)
        zones = rig.frames()[-1]
    return judged(zones, touch | columns, [touch])


STUCK = Knob(
    name="stuck",
    title="Switches that are stuck closed, beside a finger",
    axis="how many are stuck",
    amount="cells that read pressed",
    values=(0, 1, 2, 3, 4, 5, 6),
    runs={
        "no mask": functools.partial(_stuck, REFERENCE),
        "three in the mask": functools.partial(_stuck, MASKED),
        "columns shorted to the rows' level": functools.partial(_stuck_columns, REFERENCE),
    },
    helps="`contactfpga doctor --watch` names them in time; list them in `mask`",
    unnoticed="a switch that is stuck and one that is pressed are the same circuit; only time tells them apart",
)

STUCK_REVERSAL = dataclasses.replace(
    STUCK,
    name="stuck_reversal",
    title="Switches that are stuck closed, by line reversal",
    runs={
        "no mask": functools.partial(_stuck, REVERSAL),
        "columns shorted to the rows' level": functools.partial(_stuck_columns, REVERSAL),
    },
)
