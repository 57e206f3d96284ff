"""Materials, levels and wrong readings of resistive cells; tables of docs/cell.md."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from contactfpga.design.circuit import SCHOTTKY, Circuit, falling, load_circuit
from contactfpga.design.cover import Cover, load_cover
from contactfpga.design.cover.cell import MATERIALS, read_cell
from contactfpga.shipped import examples
from contactfpga.skin import Skin
from contactfpga_sim.apps.score import wilson
from contactfpga_sim.lab import writer
from contactfpga_sim.model.board.receiver import Receiver
from contactfpga_sim.model.board.virtual import VirtualBoard

FILE = examples() / "cells.toml"
LEAKS_UA = (10.0, 1.0, 0.1)
WITHIN = 0.3
"""Octaves of resistance that a level may be off."""
FRAMES = 1_000
SCENES = ("fingertip", "palm", "nothing")
DISTURBED = {"noise": "noise_mv", "a motor's edges": "edge_mv"}
SKIN, CIRCUIT, COVER = Skin.load(FILE), load_circuit(FILE) or Circuit(), load_cover(FILE) or Cover()
LINES = SKIN.row_lines, SKIN.columns


def materials_table() -> str:
    """Levels of materials, and what moves the force that reads pressed, in octaves."""
    latest_s = max(falling.ruler_s(CIRCUIT, *LINES, ruler) for ruler, _ in falling.corners(CIRCUIT, *LINES, 1.0))
    rows = [["material", "level", "resistance", "`ruler`", "latest sample", "cell to cell", "falling", "a day", "hot"]]
    for name in MATERIALS:
        cell = read_cell({"material": name})
        level, usual = falling.sixteenths(CIRCUIT, SKIN, cell.level_ohm), np.array(cell.level_n)
        ohm = [cell.ohm(usual, falling=True), cell.ohm(usual, seconds=86_400.0), cell.ohm(usual, falling.HOT_C)]
        moved = [2 * cell.spread / math.log(2), *np.log2(cell.level_ohm / np.array(ohm)).tolist()]
        octaves = [f"{one / cell.exponent:.2f}" for one in moved]
        sample = f"{1e6 * latest_s * level / falling.SIXTEENTHS:.0f} us"
        rows.append([name, f"{cell.level_n:g} N", f"{cell.level_ohm / 1e3:.0f} kΩ", str(level), sample, *octaves])
    return writer.table_of(rows)


def levels_table() -> str:
    """Largest error of a level by leakage, and the lightest cell that holds."""
    assert COVER.cell is not None
    ohm, tried = COVER.cell.level_ohm, np.geomspace(5e3, 4e5, 100)
    rows = [["leakage of a pin", "with the ruler", "without", "Schottky diodes", f"up to {WITHIN} octaves"]]
    for leak in LEAKS_UA:
        hot = falling.error_octaves(CIRCUIT.replace(diode=SCHOTTKY), *LINES, ohm, leak)
        errors = [*(falling.error_octaves(CIRCUIT, *LINES, ohm, leak, ruled) for ruled in (True, False)), hot]
        held = tried[falling.error_octaves(CIRCUIT, *LINES, tried, leak) <= WITHIN]
        range_ = f"{held.min() / 1e3:.0f} to {held.max() / 1e3:.0f} kΩ" if len(held) else "none"
        rows.append([f"{leak:g} µA", *(f"{float(error[0]):.2f}" for error in errors), range_])
    return writer.table_of(rows)


def board_table() -> str:
    """Largest errors of the levels of the example with several, by leakage."""
    file = examples() / "levels.toml"
    skin, circuit, cell = Skin.load(file), load_circuit(file) or Circuit(), (load_cover(file) or Cover()).cell
    assert cell is not None
    lines = skin.row_lines, skin.columns
    one_s = falling.ruler_s(circuit, *lines) / falling.SIXTEENTHS
    rows = [["level", "force", "resistance", "sample", *(f"error at {leak:g} µA" for leak in LEAKS_UA)]]
    for level, ruler in enumerate(skin.derived.rulers):
        force = cell.level_n * 4.0**level
        ohm = float(cell.ohm(np.array(force)))
        errors = [float(falling.error_octaves(circuit, *lines, ohm, leak)[0]) for leak in LEAKS_UA]
        sample = f"{ruler}/16, {1e6 * ruler * one_s:.1f} us"
        rows.append(
            [str(level + 1), f"{force:.2f} N", f"{ohm / 1e3:.1f} kΩ", sample, *(f"{one:.2f}" for one in errors)]
        )
    return writer.table_of(rows)


def wrong_table() -> str:
    """Readings of the virtual board that disturbances turned, of all readings."""
    rows = [["scene", "cells pressed", *DISTURBED]]
    for scene in SCENES:
        usual = _readings(scene, "")[0]
        found = [_readings(scene, part) != usual for part in DISTURBED.values()]
        rows.append([scene, str(int(usual.sum())), *map(_share, found)])
    return writer.table_of(rows)


def _share(turned: np.ndarray) -> str:
    hits = int(turned.sum())
    low, high = (1e6 * end for end in wilson(hits, turned.size))
    cells = int(turned.any(axis=0).sum())
    at = f" in {cells} cell{'s' * (cells > 1)}" if cells else ""
    return f"{1e6 * hits / turned.size:,.0f} ({max(0.0, low):,.0f} to {high:,.0f}){at}"


def _readings(scene: str, disturbed: str) -> np.ndarray:
    """(frames, rows, columns) cells of the example under a scene, with this disturbance alone."""
    quiet = {name: 0.0 for name in DISTURBED.values() if name != disturbed}
    circuit = CIRCUIT.replace(falling=dataclasses.replace(falling.parts(CIRCUIT), **quiet))
    data, frame_s = b"", SKIN.derived.frame_clocks / SKIN.clock_hz
    with VirtualBoard(SKIN, scene, COVER, circuit, look_s=100 * frame_s) as board:
        while board.clock() < (FRAMES + 3) * frame_s:
            data += board.read(frame_s)
    frames = [one.frame.bitmap for one in Receiver(SKIN).take(enumerate(data))]
    return np.array(frames[1 : FRAMES + 1], bool)
