"""Knobs of the sheet's wiring: slow columns, weak switches, missing diodes, broken lines, what sticks."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from contactfpga.design.circuit import Circuit
from contactfpga.skin import Skin
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab.failures.knob import Knob, Outcome
from contactfpga_sim.lab.failures.rig import (
    GUARDED,
    REFERENCE,
    REVERSAL,
    REVERSAL_GUARDED,
    Rig,
    faults,
    hello_clocks,
    moments,
    places,
    plural,
    reported,
    still,
)
from contactfpga_sim.model.sheet import wiring
from contactfpga_sim.model.sheet.line import lines_of
from contactfpga_sim.model.sheet.wiring import Wiring, at_rest


def finger(skin: Skin, *spots: tuple[int, int]) -> np.ndarray:
    """(rows, columns) bool: 2x2 cells at each of these (row, column)."""
    cells = np.zeros((skin.rows, skin.columns), bool)
    for row, column in spots:
        cells[row : row + 2, column : column + 2] = True
    return cells


def judged(zones: Zones, cells: np.ndarray, contacts: list[np.ndarray], unit: str = "contact") -> Outcome:
    """A frame against the contacts that are there, to the cell."""
    right = reported(zones) == sorted(map(moments, contacts))
    what = f"{plural(len(zones), 'zone')} of {plural(len(contacts), unit)}"
    if not right and len(zones) == len(contacts):
        what = f"{zones.pressed} cells of {int(sum(contact.sum() for contact in contacts))}"
    return Outcome(right, faults(zones), what, zones.pressed, cells, places(zones))


# ---- settle time

LAZY = REFERENCE.replace(release_us=40.0)
LAZY_GUARDED = GUARDED.replace(release_us=40.0)
LAZY_CIRCUIT = Circuit(column_pull_ohm=40_000.0, line_ohm=2000.0)


def _slow(skin: Skin, circuit: Circuit, picofarad: float) -> Outcome:
    spots = [(3, 4), (9, 10)]
    cells = finger(skin, *spots)
    with Rig(skin) as rig:
        rig.board.settle(*lines_of(circuit.replace(line_pf=picofarad), skin, most=2))
        rig.board.hold(cells[None], hello_clocks(skin) + 4 * rig.scan)
        zones = rig.frames()[-1]
    return judged(zones, cells, [finger(skin, spot) for spot in spots])


SETTLE = Knob(
    name="settle",
    title="Columns slower than `settle_us = 5`",
    axis="capacitance of a line, pF",
    amount="cells that read pressed",
    values=tuple(np.geomspace(10, 10_000, 19).round().tolist()),
    runs={
        "4.7 kΩ pull-up, `release_us = 1`": functools.partial(_slow, REFERENCE, Circuit(column_pull_ohm=4700.0)),
        "40 kΩ pull-up, the same": functools.partial(_slow, REFERENCE, Circuit(column_pull_ohm=40_000.0)),
        "40 kΩ, lines of 2 kΩ, `release_us = 40`": functools.partial(_slow, LAZY, LAZY_CIRCUIT),
        "the same with guard lines": functools.partial(_slow, LAZY_GUARDED, LAZY_CIRCUIT),
    },
    helps="`contactfpga settle` says which times a circuit needs; smaller resistances, precharge",
    unnoticed="a switch that pulls too slowly reads as one that is not pressed; a guard line does so too, and reports "
    "it",
)


# ---- diodes


def bare(skin: Skin, count: float) -> Outcome:
    """Three fingers at the corners of a rectangle; of one of them the switches lose their diodes one by one. Undefined
    levels are tried both ways."""
    spots = [(3, 4), (3, 10), (11, 4)]
    cells = finger(skin, *spots)
    bare = np.zeros_like(cells)
    for row, column in [(3, 4), (3, 5), (4, 4), (4, 5)][: int(count)]:
        bare[row, column] = True
    if skin.guard:
        cells_, bare_ = wiring.extended(cells), wiring.extended(bare, guard=False)
    else:
        cells_, bare_ = cells, bare
    read, undefined, amperes = at_rest(Circuit(column_pull_ohm=4700.0), cells_, bare_)
    frames = [_still(skin, each) for each in (read, read | undefined)]
    undefined = undefined[: skin.rows, : skin.columns]
    worst = min(frames, key=lambda zones: zones.pressed)
    contacts = [finger(skin, spot) for spot in spots]
    right = all(reported(zones) == sorted(map(moments, contacts)) for zones in frames)
    told = faults(frames[0]) if faults(frames[0]) and faults(frames[1]) else ()
    lost, of = int((undefined & cells).sum()), int(cells.sum())
    what = f"{lost} of {of} pressed cells undefined, {1e3 * amperes:.0f} mA from row pin to row pin"
    return Outcome(right, told, what, worst.pressed, cells, places(worst))


def _still(skin: Skin, read: np.ndarray) -> Zones:
    """The frame of a sheet that reads so, with its guard lines if it has some."""
    if not skin.guard:
        return still(skin, read)
    return still(skin, read[:-1, :-1], wiring.missed(read))


DIODES = Knob(
    name="diodes",
    title="Switches without a sound diode on a sheet that should have them",
    axis="such switches under one of three fingers",
    amount="cells that surely read pressed",
    values=(0, 1, 2, 3, 4),
    runs={
        "three fingers at corners": functools.partial(bare, REFERENCE),
        "the same with guard lines": functools.partial(bare, GUARDED),
    },
    helps='test each diode before fitting; a board for `diodes = "none"` lets rows float and flags ghosts',
    unnoticed="two row pins drive against each other, and the level between low and high may read either way; the "
    "self-test finds such a diode while its switch alone is pressed, and nothing finds it while no switch is",
)

BARE = Skin(rows=12, columns=12, diodes="none", connectivity=4)
BARE_CELLS = BARE.replace(report="cells")
CORNERS = [(1, 2), (1, 8), (8, 2), (8, 8)]


def bare_read(pressed: np.ndarray) -> np.ndarray:
    """What a sheet without diodes reads."""
    return Wiring(bare=np.ones((1, 1), bool), floating=True).read(pressed)[0]


def _corners(count: float) -> Outcome:
    spots = CORNERS[: int(count)]
    cells = finger(BARE, *spots)
    zones = still(BARE, bare_read(cells))
    return judged(zones, cells, [finger(BARE, spot) for spot in spots])


def scattered(count: int, places_: int = 60, seed: int = 5) -> list[list[tuple[int, int]]]:
    """Fingers of 2x2 cells at random places of the sheet without diodes, at least a cell apart."""
    rng = np.random.default_rng([seed, count])
    found: list[list[tuple[int, int]]] = []
    while len(found) < places_:
        spots: list[tuple[int, int]] = []
        while len(spots) < count:
            row, column = map(int, rng.integers(0, BARE.rows - 1, 2))
            if all(max(abs(row - y), abs(column - x)) > 2 for y, x in spots):
                spots.append((row, column))
        found.append(spots)
    return found


def _frames(skin: Skin, cells: list[np.ndarray]) -> list[Zones]:
    """The second frame of each: the first one differs from what was before."""
    found = []
    with Rig(skin) as rig:
        rig.board.hold(np.zeros((1, skin.rows, skin.columns), bool), hello_clocks(skin))
        for each in cells:
            rig.frames()
            rig.board.hold(bare_read(each)[None], 6 * rig.scan)
            found.append(rig.frames()[-1])
    return found


def _scattered(count: float) -> Outcome:
    """Zones are not what touches; it is reported if all frames in which that is so are flagged."""
    placed = scattered(int(count))
    cells = [finger(BARE, *spots) for spots in placed]
    frames = _frames(BARE, cells)
    truth = [sorted(moments(finger(BARE, spot)) for spot in spots) for spots in placed]
    wrong = [index for index, zones in enumerate(frames) if reported(zones) != truth[index]]
    silent = [index for index in wrong if "ghost" not in frames[index].flags]
    shown = (silent or wrong or [0])[0]
    what = (
        f"wrong zones at {100 * len(wrong) / len(frames):.0f} % of places, "
        f"unflagged at {100 * len(silent) / len(frames):.0f} %"
    )
    told = () if silent else tuple({flag for index in wrong for flag in faults(frames[index])})
    return Outcome(not wrong, told, what, len(wrong) / len(frames), cells[shown], places(frames[shown]))


def _scattered_cells(count: float) -> Outcome:
    """Cells that are read wrong; it is reported if each of them is marked."""
    cells = [finger(BARE, *spots) for spots in scattered(int(count))]
    frames = _frames(BARE_CELLS, cells)
    read, marked = (np.array([getattr(zones, name) for zones in frames]) for name in ("cells", "ghost_cells"))
    wrong = np.flatnonzero((read != cells).any(axis=(1, 2)))
    missed = np.flatnonzero((read & ~np.array(cells) & ~marked).any(axis=(1, 2)))
    shares = [100 * len(some) / len(frames) for some in (wrong, missed)]
    what = f"ghosts at {shares[0]:.0f} % of places, unmarked at {shares[1]:.0f} %"
    told = ("ghost",) if len(wrong) and not len(missed) else ()
    return Outcome(not len(wrong), told, what, len(wrong) / len(frames), read[wrong[0] if len(wrong) else 0])


GHOSTS = Knob(
    name="ghosts",
    title="Fingers on a sheet without diodes",
    axis="fingers of 2x2 cells",
    amount="share of places read wrong",
    values=tuple(range(1, 9)),
    runs={
        "zones, random places": _scattered,
        "cells, random places": _scattered_cells,
    },
    helps="diodes",
    unnoticed="the same switches read pressed as under one larger contact",
)

GHOST = Knob(
    name="ghost",
    title="Three corners fake the fourth, without diodes",
    axis="fingers at the corners of a rectangle",
    amount="cells that read pressed",
    values=(1, 2, 3, 4),
    runs={"zones": _corners},
    helps="diodes",
)


SPOTS = [(3, 4), (9, 10)]
PULLED = Circuit(column_pull_ohm=4700.0)
PATIENT, PATIENT_GUARDED = (skin.replace(settle_us=5.0) for skin in (REVERSAL, REVERSAL_GUARDED))
"""Columns have the time that weak switches need."""


def _slow_reversal(skin: Skin, circuit: Circuit) -> Outcome:
    """Two fingers on a sheet whose columns and rows take their time."""
    cells = finger(skin, *SPOTS)
    with Rig(skin) as rig:
        rig.board.settle(*lines_of(circuit, skin, most=2))
        rig.board.hold(cells[None], 2 * hello_clocks(skin))
        zones = rig.frames()[-1]
    return judged(zones, cells, [finger(skin, spot) for spot in SPOTS])


def _capacitance(skin: Skin, picofarad: float) -> Outcome:
    return _slow_reversal(skin, PULLED.replace(line_pf=picofarad))


def _switch(skin: Skin, kiloohm: float) -> Outcome:
    return _slow_reversal(skin, Circuit(switch_ohm=1000 * kiloohm))


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


def _broken(skin: Skin, line: str, count: float) -> Outcome:
    """``line``: row or column."""
    cells = np.zeros((skin.rows, skin.columns), bool)
    cells[4:11, 5:12] = True
    lines = tuple(range(7, 7 + int(count)))
    cut = dict.fromkeys(lines, 0)
    cuts = wiring.LineCuts(cut, {}) if line == "row" else wiring.LineCuts({}, cut)
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
