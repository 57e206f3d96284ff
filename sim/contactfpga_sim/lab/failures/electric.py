"""Knobs of the sheet's wiring."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from contactfpga.design.circuit import Circuit
from contactfpga.skin import Skin
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab.failures.rig import (
    GUARDED,
    REFERENCE,
    REVERSAL,
    REVERSAL_GUARDED,
    Rig,
    faults,
    held_clocks,
    hello_clocks,
    moments,
    places,
    plural,
    reported,
    still,
)
from contactfpga_sim.lab.knobs import Knob, Outcome, RateTest
from contactfpga_sim.model.sheet import wiring
from contactfpga_sim.model.sheet.line import lines_of
from contactfpga_sim.model.sheet.wiring import Wiring, at_rest


def finger(skin: Skin, *spots: tuple[int, int]) -> np.ndarray:
    """(rows, columns) bool: 2x2 cells at each (row, column)."""
    cells = np.zeros((skin.rows, skin.columns), bool)
    for row, column in spots:
        cells[row : row + 2, column : column + 2] = True
    return cells


def judged(zones: Zones, cells: np.ndarray, contacts: list[np.ndarray], unit: str = "contact") -> Outcome:
    right = reported(zones) == sorted(map(moments, contacts))
    what = f"{plural(len(zones), 'zone')} of {plural(len(contacts), unit)}"
    if not right and len(zones) == len(contacts):
        what = f"{zones.pressed} cells of {int(sum(contact.sum() for contact in contacts))}"
    return Outcome(right, faults(zones), what, zones.pressed, cells, places(zones))


# ---- settle time

LAZY = REFERENCE.replace(release_us=40.0)
LAZY_GUARDED = GUARDED.replace(release_us=40.0)
PULLED, WEAKLY = Circuit(column_pull_ohm=4700.0), Circuit(column_pull_ohm=40_000.0)
LAZY_CIRCUIT = WEAKLY.replace(line_ohm=2000.0)


def _apart(rng: np.random.Generator, skin: Skin, count: int, free: int = 1) -> list[tuple[int, int]]:
    spots: list[tuple[int, int]] = []
    while len(spots) < count:
        row, column = map(int, rng.integers(0, (skin.rows - 1, skin.columns - 1)))
        if all(max(abs(row - y), abs(column - x)) >= 2 + free for y, x in spots):
            spots.append((row, column))
    return spots


def _slow(skin: Skin, circuit: Circuit, rng: np.random.Generator, count: int) -> list[Outcome]:
    found = []
    with Rig(skin) as rig:
        rig.board.settle(*lines_of(circuit, skin, most=2))
        rig.board.hold(np.zeros((1, skin.rows, skin.columns), bool), 2 * hello_clocks(skin))
        for _ in range(count):
            spots = _crossed(rng, skin)
            cells = finger(skin, *spots)
            rig.frames()
            rig.board.hold(cells[None], held_clocks(skin))
            found.append(judged(rig.frames()[-1], cells, [finger(skin, spot) for spot in spots]))
    return found


def _crossed(rng: np.random.Generator, skin: Skin) -> list[tuple[int, int]]:
    while True:
        (y, x), (v, u) = spots = _apart(rng, skin, 2)
        if min(abs(y - v), abs(x - u)) > 2:
            return spots


def _capacitance(skin: Skin, circuit: Circuit, picofarad: float, rng: np.random.Generator, count: int) -> list[Outcome]:
    return _slow(skin, circuit.replace(line_pf=picofarad), rng, count)


SETTLE = Knob(
    name="settle",
    title="Columns slower than `settle_us = 5`",
    axis="capacitance of a line, pF",
    values=tuple(np.geomspace(10, 10_000, 19).round().tolist()),
    runs={
        name: RateTest(functools.partial(_capacitance, skin, circuit), most=120)
        for name, skin, circuit in (
            ("4.7 kΩ pull-up, `release_us = 1`", REFERENCE, PULLED),
            ("40 kΩ pull-up, the same", REFERENCE, WEAKLY),
            ("40 kΩ, lines of 2 kΩ, `release_us = 40`", LAZY, LAZY_CIRCUIT),
            ("the same with guard lines", LAZY_GUARDED, LAZY_CIRCUIT),
        )
    },
    helps="`contactfpga settle` says which times a circuit needs; smaller resistances, precharge",
    unnoticed="a switch that pulls too slowly reads as one that is not pressed; a guard line does so too, and reports "
    "it",
)


# ---- diodes


def bare(skin: Skin, count: float, rng: np.random.Generator, draws: int) -> list[Outcome]:
    """Outcomes of three fingers at corners of rectangles, one of which loses its diodes one by one."""
    return [_bare(skin, int(count), _rectangle(rng, skin)[:3], rng) for _ in range(draws)]


def _rectangle(rng: np.random.Generator, skin: Skin) -> list[tuple[int, int]]:
    (y, x), (v, u) = _crossed(rng, skin)
    return [(y, x), (y, u), (v, x), (v, u)]


def _bare(skin: Skin, count: int, spots: list[tuple[int, int]], rng: np.random.Generator) -> Outcome:
    cells = finger(skin, *spots)
    bare = np.zeros_like(cells)
    bare.flat[rng.permutation(np.flatnonzero(finger(skin, spots[0])))[:count]] = True
    if skin.guard:
        cells_, bare_ = wiring.extended(cells), wiring.extended(bare, guard=False)
    else:
        cells_, bare_ = cells, bare
    read, undefined, amperes = at_rest(PULLED, cells_, bare_)
    frames = [_still(skin, each) for each in (read, read | undefined)]
    undefined = undefined[: skin.rows, : skin.columns]
    worst = min(frames, key=lambda zones: zones.pressed)
    contacts = [finger(skin, spot) for spot in spots]
    right = all(reported(zones) == sorted(map(moments, contacts)) for zones in frames)
    told = faults(frames[0]) if faults(frames[0]) and faults(frames[1]) else ()
    lost, of = int((undefined & cells).sum()), int(cells.sum())
    what = f"{lost} of {of} pressed cells undefined, {1e3 * amperes:.0f} mA from row pin to row pin"
    return Outcome(right, told, what, cells=cells, zones=places(worst))


def _still(skin: Skin, read: np.ndarray) -> Zones:
    if not skin.guard:
        return still(skin, read)
    return still(skin, read[:-1, :-1], wiring.missed(read))


DIODES = Knob(
    name="diodes",
    title="Switches without a sound diode on a sheet that should have them",
    axis="such switches under one of three fingers",
    values=(0, 1, 2, 3, 4),
    runs={
        "three fingers at corners": RateTest(functools.partial(bare, REFERENCE)),
        "the same with guard lines": RateTest(functools.partial(bare, GUARDED)),
    },
    helps='test each diode before fitting; a board for `diodes = "none"` lets rows float and flags ghosts',
    unnoticed="two row pins drive against each other, and the level between low and high may read either way; the "
    "self-test finds such a diode while its switch alone is pressed, and nothing finds it while no switch is",
)

BARE = Skin(rows=12, columns=12, diodes="none", connectivity=4)
BARE_CELLS = BARE.replace(report="cells")


def bare_read(pressed: np.ndarray) -> np.ndarray:
    return Wiring(bare=np.ones((1, 1), bool), floating=True).read(pressed)[0]


def _corners(count: float, rng: np.random.Generator, draws: int) -> list[Outcome]:
    spots = [_rectangle(rng, BARE)[: int(count)] for _ in range(draws)]
    cells = [finger(BARE, *each) for each in spots]
    frames = zip(_frames(BARE, cells), cells, spots)
    return [judged(zones, each, [finger(BARE, spot) for spot in there]) for zones, each, there in frames]


def _frames(skin: Skin, cells: list[np.ndarray]) -> list[Zones]:
    """The first frame depends on earlier ones, so the second counts."""
    found = []
    with Rig(skin) as rig:
        rig.board.hold(np.zeros((1, skin.rows, skin.columns), bool), hello_clocks(skin))
        for each in cells:
            rig.frames()
            rig.board.hold(bare_read(each)[None], 6 * rig.scan)
            found.append(rig.frames()[-1])
    return found


def _scattered(count: float, rng: np.random.Generator, draws: int) -> list[Outcome]:
    placed = [_apart(rng, BARE, int(count)) for _ in range(draws)]
    cells = [finger(BARE, *spots) for spots in placed]
    truths = [[finger(BARE, spot) for spot in spots] for spots in placed]
    return [judged(*each) for each in zip(_frames(BARE, cells), cells, truths)]


def _scattered_cells(count: float, rng: np.random.Generator, draws: int) -> list[Outcome]:
    """A fault counts as reported if every misread cell is marked."""
    cells = [finger(BARE, *_apart(rng, BARE, int(count))) for _ in range(draws)]
    return [_marked(zones, each) for zones, each in zip(_frames(BARE_CELLS, cells), cells)]


def _marked(zones: Zones, cells: np.ndarray) -> Outcome:
    assert zones.cells is not None
    assert zones.ghost_cells is not None
    wrong = zones.cells != cells
    told = ("ghost",) if not (zones.cells & ~cells & ~zones.ghost_cells).any() and wrong.any() else ()
    return Outcome(not wrong.any(), told, f"{int(wrong.sum())} ghosts", cells=zones.cells)


GHOSTS = Knob(
    name="ghosts",
    title="Fingers on a sheet without diodes",
    axis="fingers of 2x2 cells",
    values=tuple(range(1, 9)),
    runs={"zones": RateTest(_scattered), "cells": RateTest(_scattered_cells)},
    helps="diodes",
    unnoticed="the same switches read pressed as under one larger contact",
)

GHOST = Knob(
    name="ghost",
    title="Three corners fake the fourth, without diodes",
    axis="fingers at the corners of a rectangle",
    values=(1, 2, 3, 4),
    runs={"zones": RateTest(_corners)},
    helps="diodes",
)


PATIENT, PATIENT_GUARDED = (skin.replace(settle_us=5.0) for skin in (REVERSAL, REVERSAL_GUARDED))
"""Skins with time for weak switches."""


def _switch(skin: Skin, kiloohm: float, rng: np.random.Generator, count: int) -> list[Outcome]:
    return _slow(skin, Circuit(switch_ohm=1000 * kiloohm), rng, count)


SETTLE_REVERSAL = Knob(
    name="settle_reversal",
    title="Lines slower than `settle_us = 0.5`, by line reversal",
    axis="capacitance of a line, pF",
    values=tuple(np.geomspace(10, 10_000, 19).round().tolist()),
    runs={
        "4.7 kΩ pull-up": RateTest(functools.partial(_capacitance, REVERSAL, PULLED), most=120),
        "the same with guard lines": RateTest(functools.partial(_capacitance, REVERSAL_GUARDED, PULLED), most=120),
    },
    helps="`contactfpga settle` says which times a circuit needs; smaller resistances",
)

PROJECT_REVERSAL = Knob(
    name="project_reversal",
    title="Pressed switches too weak to lift their row, by line reversal",
    axis="resistance of a pressed switch, kΩ",
    values=(0.1, 0.2, 0.5, 1, 2, 3, 4, 5, 6, 7, 8, 10, 15, 20),
    runs={
        "rows pulled by 10 kΩ": RateTest(functools.partial(_switch, PATIENT), most=120),
        "the same with guard lines": RateTest(functools.partial(_switch, PATIENT_GUARDED), most=120),
    },
    helps="switches of less resistance, weaker pulls of the rows; `contactfpga settle` says what a circuit needs",
    unnoticed="a row that is not lifted reads as one that nobody touches; guard lines with such switches report it",
)

DIODES_REVERSAL = dataclasses.replace(
    DIODES,
    name="diodes_reversal",
    title="Switches without a sound diode, by line reversal",
    runs={
        "three fingers at corners": RateTest(functools.partial(bare, REVERSAL)),
        "the same with guard lines": RateTest(functools.partial(bare, REVERSAL_GUARDED)),
    },
)


def _broken(skin: Skin, line: str, count: float, rng: np.random.Generator, draws: int) -> list[Outcome]:
    found = []
    for _ in range(draws):
        top, left = map(int, rng.integers(0, (skin.rows - 6, skin.columns - 6)))
        cells = np.zeros((skin.rows, skin.columns), bool)
        cells[top : top + 7, left : left + 7] = True
        first = (top if line == "row" else left) + int(rng.integers(0, 8 - int(count)))
        cut = dict.fromkeys(range(first, first + int(count)), 0)
        cuts = wiring.LineCuts(cut, {}) if line == "row" else wiring.LineCuts({}, cut)
        found.append(judged(still(skin, cells, cuts), cells, [cells]))
    return found


BROKEN = Knob(
    name="broken",
    title="Lines that are broken under a contact of 7x7 cells",
    axis="broken lines side by side",
    values=(0, 1, 2, 3),
    runs={
        "row": RateTest(functools.partial(_broken, REFERENCE, "row")),
        "column": RateTest(functools.partial(_broken, REFERENCE, "column")),
        "row, with guard lines": RateTest(functools.partial(_broken, GUARDED, "row")),
        "column, with guard lines": RateTest(functools.partial(_broken, GUARDED, "column")),
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
        "row": RateTest(functools.partial(_broken, REVERSAL, "row")),
        "column": RateTest(functools.partial(_broken, REVERSAL, "column")),
        "row, with guard lines": RateTest(functools.partial(_broken, REVERSAL_GUARDED, "row")),
        "column, with guard lines": RateTest(functools.partial(_broken, REVERSAL_GUARDED, "column")),
    },
)

MASKED = REFERENCE.replace(mask=((2, 3), (12, 2), (5, 12)))


def _stuck(skin: Skin, count: float, rng: np.random.Generator, draws: int) -> list[Outcome]:
    found = []
    for _ in range(draws):
        touch, beside = _finger_anywhere(rng, skin)
        free = [spot for spot in zip(*np.nonzero(~beside)) if spot not in skin.mask]
        drawn = rng.permutation(len(free))
        spots = [*skin.mask, *(free[number] for number in drawn)][: int(count)]
        closed = np.zeros_like(touch)
        closed[tuple(np.array(spots, int).reshape(-1, 2).T)] = True
        found.append(judged(still(skin, Wiring(closed=closed).read(touch)[0]), touch | closed, [touch]))
    return found


def _finger_anywhere(rng: np.random.Generator, skin: Skin) -> tuple[np.ndarray, np.ndarray]:
    """(rows, columns) bool each: a finger clear of the mask, and its cells with neighbors."""
    while True:
        ((row, column),) = _apart(rng, skin, 1)
        touch, beside = finger(skin, (row, column)), np.zeros((skin.rows, skin.columns), bool)
        beside[max(row - 1, 0) : row + 3, max(column - 1, 0) : column + 3] = True
        if not any(beside[spot] for spot in skin.mask):
            return touch, beside


def _stuck_columns(skin: Skin, count: float, rng: np.random.Generator, draws: int) -> list[Outcome]:
    found = []
    for _ in range(draws):
        touch, _ = _finger_anywhere(rng, skin)
        columns = np.isin(np.arange(skin.columns), rng.permutation(skin.columns)[: int(count)])
        with Rig(skin) as rig:
            rig.board.stick(columns)
            rig.board.hold(touch[None], hello_clocks(skin) + 4 * skin.derived.frame_clocks)
            zones = rig.frames()[-1]
        found.append(judged(zones, touch | columns, [touch]))
    return found


STUCK = Knob(
    name="stuck",
    title="Switches that are stuck closed, beside a finger",
    axis="how many are stuck",
    values=(0, 1, 2, 3, 4, 5, 6),
    runs={
        "no mask": RateTest(functools.partial(_stuck, REFERENCE)),
        "three in the mask": RateTest(functools.partial(_stuck, MASKED)),
        "columns shorted to the rows' level": RateTest(functools.partial(_stuck_columns, REFERENCE)),
    },
    helps="`contactfpga doctor --watch` names them in time; list them in `mask`",
    unnoticed="a switch that is stuck and one that is pressed are the same circuit; only time tells them apart",
)

STUCK_REVERSAL = dataclasses.replace(
    STUCK,
    name="stuck_reversal",
    title="Switches that are stuck closed, by line reversal",
    runs={
        "no mask": RateTest(functools.partial(_stuck, REVERSAL)),
        "columns shorted to the rows' level": RateTest(functools.partial(_stuck_columns, REVERSAL)),
    },
)
