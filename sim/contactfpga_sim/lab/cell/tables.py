"""Materials, levels and wrong readings of resistive cells; tables of docs/cell.md."""

from __future__ import annotations

import dataclasses
import functools
import math

import numpy as np

from contactfpga.design.circuit import SCHOTTKY, Circuit, falling, load_circuit
from contactfpga.design.cover import Cover, load_cover
from contactfpga.design.cover.cell import MATERIALS, read_cell
from contactfpga.shipped import examples
from contactfpga.skin import Skin
from contactfpga_sim.apps.stats import wilson
from contactfpga_sim.lab import writer
from contactfpga_sim.model.board.receiver import Receiver
from contactfpga_sim.model.board.virtual import VirtualBoard

FILE = examples() / "cells.toml"
LEAKS_UA = (10.0, 1.0, 0.1)
WITHIN = 0.3
"""Octaves of resistance that a level may be off."""
FRAMES = 1_000
SCENES = ("fingertip", "palm", "nothing")
DISTURBED = {"noise": ("noise_mv",), "a motor's edges": ("edge_mv",), "both": ("noise_mv", "edge_mv")}


def _example() -> tuple[Skin, Circuit, Cover]:
    circuit, cover = load_circuit(FILE), load_cover(FILE)
    assert circuit is not None
    assert cover is not None
    return Skin.load(FILE), circuit, cover


def materials_table() -> str:
    """Levels of materials, and what moves the force that reads pressed, in octaves."""
    skin, circuit, _ = _example()
    rows = [["material", "level", "resistance", "`ruler`", "latest sample", "cell to cell", "falling", "a day", "hot"]]
    for name in MATERIALS:
        cell = read_cell({"material": name})
        level = falling.sixteenths(circuit, skin, cell.level_ohm)
        lines = skin.row_lines, skin.columns
        latest = max(falling.ruler_s(circuit, *lines, ruler) for ruler, _ in falling.corners(circuit, *lines, 1.0))
        usual = np.array(cell.level_n)
        moved = [
            math.exp(2 * cell.spread),
            *(cell.level_ohm / cell.ohm(usual, **how) for how in ({"falling": True}, {"seconds": 86_400.0})),
            cell.level_ohm / cell.ohm(usual, celsius=falling.HOT_C),
        ]
        octaves = [f"{math.log2(float(share)) / cell.exponent:.2f}" for share in moved]
        sample = f"{1e6 * latest * level / falling.SIXTEENTHS:.0f} us"
        rows.append([name, f"{cell.level_n:g} N", f"{cell.level_ohm / 1e3:.0f} kΩ", str(level), sample, *octaves])
    return writer.table_of(rows)


def levels_table() -> str:
    """Largest error of a level by leakage, and the lightest cell that holds."""
    skin, circuit, cover = _example()
    assert cover.cell is not None
    lines, ohm = (skin.row_lines, skin.columns), cover.cell.level_ohm
    hot = circuit.replace(diode=SCHOTTKY)
    rows = [["leakage of a pin", "with the ruler", "without", "Schottky diodes", f"up to {WITHIN} octaves"]]
    for leak in LEAKS_UA:
        errors = [
            falling.error_octaves(circuit, *lines, ohm, leak),
            falling.error_octaves(circuit, *lines, ohm, leak, ruled=False),
            falling.error_octaves(hot, *lines, ohm, leak),
        ]
        tried = np.geomspace(5e3, 4e5, 100)
        held = tried[falling.error_octaves(circuit, *lines, tried, leak) <= WITHIN]
        range_ = f"{held.min() / 1e3:.0f} to {held.max() / 1e3:.0f} kΩ" if len(held) else "none"
        rows.append([f"{leak:g} µA", *(f"{float(error[0]):.2f}" for error in errors), range_])
    return writer.table_of(rows)


def wrong_table() -> str:
    """Readings of the virtual board that disturbances turned, of all readings."""
    rows = [["scene", "cells pressed", *DISTURBED]]
    for scene in SCENES:
        usual = _readings(scene, ())[0]
        found = [_readings(scene, parts) != usual for parts in DISTURBED.values()]
        rows.append([scene, str(int(usual.sum())), *map(_share, found)])
    return writer.table_of(rows)


def _share(turned: np.ndarray) -> str:
    hits = int(turned.sum())
    low, high = (1e6 * end for end in wilson(hits, turned.size))
    cells = int(turned.any(axis=0).sum())
    at = f" in {cells} cell{'s' * (cells > 1)}" if cells else ""
    return f"{1e6 * hits / turned.size:,.0f} ({max(0.0, low):,.0f} to {high:,.0f}){at}"


@functools.cache
def _readings(scene: str, disturbed: tuple[str, ...]) -> np.ndarray:
    """(frames, rows, columns) cells of the example under a scene, with these disturbances."""
    skin, circuit, cover = _example()
    assert circuit.falling is not None
    quiet = {name: 0.0 for name in ("noise_mv", "edge_mv") if name not in disturbed}
    circuit = circuit.replace(falling=dataclasses.replace(circuit.falling, **quiet))
    data, frame_s = b"", skin.derived.frame_clocks / skin.clock_hz
    with VirtualBoard(skin, scene, cover, circuit, look_s=100 * frame_s) as board:
        while board.clock() < (FRAMES + 3) * frame_s:
            data += board.read(frame_s)
    frames = [one.frame.bitmap for one in Receiver(skin).take(enumerate(data))]
    return np.array(frames[1 : FRAMES + 1], bool)
