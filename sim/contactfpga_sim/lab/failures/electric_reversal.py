"""The sheet as a circuit under line reversal: slow columns, switches too weak for the projection, missing diodes."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from contactfpga.design.circuit import Circuit
from contactfpga.skin import Skin
from contactfpga_sim.lab.failures.electric import DIODES, bare, finger, judged
from contactfpga_sim.lab.failures.knob import Knob, Outcome
from contactfpga_sim.lab.failures.rig import REVERSAL, REVERSAL_GUARDED, Rig, hello_clocks
from contactfpga_sim.model.sheet.line import lines_of

SPOTS = [(3, 4), (9, 10)]
PULLED = Circuit(column_pull_ohm=4700.0)
PATIENT, PATIENT_GUARDED = (skin.replace(settle_us=5.0) for skin in (REVERSAL, REVERSAL_GUARDED))
"""Columns have the time that weak switches need."""


def _slow(skin: Skin, circuit: Circuit) -> Outcome:
    """Two fingers on a sheet whose columns and rows take their time."""
    cells = finger(skin, *SPOTS)
    with Rig(skin) as rig:
        rig.board.settle(*lines_of(circuit, skin, most=2))
        rig.board.hold(cells[None], 2 * hello_clocks(skin))
        zones = rig.frames()[-1]
    return judged(zones, cells, [finger(skin, spot) for spot in SPOTS])


def _capacitance(skin: Skin, picofarad: float) -> Outcome:
    return _slow(skin, PULLED.replace(line_pf=picofarad))


def _switch(skin: Skin, kiloohm: float) -> Outcome:
    return _slow(skin, Circuit(switch_ohm=1000 * kiloohm))


SETTLE_REVERSAL = Knob(
    name="settle_reversal",
    title="Lines slower than `settle_us = 0.5`, by line reversal",
    axis="capacitance of a line, pF",
    amount="cells that read pressed",
    values=tuple(np.geomspace(10, 10_000, 19).round().tolist()),
    runs={
        "4.7 kΩ pull-up": functools.partial(_capacitance, REVERSAL),
        "the same with guard lines": functools.partial(_capacitance, REVERSAL_GUARDED),
    },
    helps="`contactfpga settle` says which times a circuit needs; smaller resistances",
)

PROJECT_REVERSAL = Knob(
    name="project_reversal",
    title="Pressed switches too weak to lift their row, by line reversal",
    axis="resistance of a pressed switch, kΩ",
    amount="cells that read pressed",
    values=(0.1, 0.2, 0.5, 1, 2, 3, 4, 5, 6, 7, 8, 10, 15, 20),
    runs={
        "rows pulled by 10 kΩ": functools.partial(_switch, PATIENT),
        "the same with guard lines": functools.partial(_switch, PATIENT_GUARDED),
    },
    helps="switches of less resistance, weaker pulls of the rows; `contactfpga settle` says what a circuit needs",
    unnoticed="a row that is not lifted reads as one that nobody touches; guard lines with such switches report it",
)

DIODES_REVERSAL = dataclasses.replace(
    DIODES,
    name="diodes_reversal",
    title="Switches without a sound diode, by line reversal",
    runs={
        "three fingers at corners": functools.partial(bare, REVERSAL),
        "the same with guard lines": functools.partial(bare, REVERSAL_GUARDED),
    },
)
