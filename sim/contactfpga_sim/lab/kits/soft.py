"""The soft kit beside the starter kit, row by row; tables of docs/soft.md."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from typing import NamedTuple

import numpy as np

from contactfpga.design import kits, predictions
from contactfpga.design.circuit import falling
from contactfpga.design.cover import Cover, ResistiveCell, load_cover
from contactfpga.design.cover.cells import cells_of
from contactfpga.design.kits import Kit
from contactfpga.design.sheet.extract import extracted
from contactfpga_sim.apps import errors, pool, result_cache
from contactfpga_sim.apps.light import OLDER, TOUCHED, Reading, Sensed
from contactfpga_sim.apps.score import Interval, interval
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.benchmark.pressed import Pressed
from contactfpga_sim.lab.benchmark.scenes import FAMILIES
from contactfpga_sim.lab.kits import predict
from contactfpga_sim.lab.levels.compute import outcome
from contactfpga_sim.model.scenes.families import placements

SCENES, PIECE, SEED = 400, 50, 3
SETUP_USD, JOINT_USD = 9.5, 0.0017
"""JLCPCB's tariff for an assembly, with a stencil (docs/starter.md)."""
LEAKS_UA = 10.0, 1.0, 0.1
EASY = ("bumper", "edge")
"""Families that the page leaves to its file, with all places."""


class Sheet(NamedTuple):
    """A kit, and the forces of its cells' levels."""

    name: str
    kit: str
    reading: Reading

    @property
    def cover(self) -> Cover:
        """The kit's own; a resistive cell's level is the lightest."""
        stated = load_cover(kits.kit(self.kit).skin_path)
        assert stated is not None
        if stated.cell is None:
            return stated
        cell = dataclasses.replace(stated.cell, level_n=self.reading.forces_n[0])
        return dataclasses.replace(stated, cell=cell, switch=cell.switch)


SHEETS = (
    Sheet("starter", "starter", Reading((0.4,))),
    Sheet("soft, one level", "soft", Reading((0.2,))),
    Sheet("soft, three levels", "soft", Reading((0.1, 0.4, 1.6), 2)),
)


class Film(Sensed):
    """Forces on cells of the film, as :class:`Sensed` has those of any cell."""

    def __init__(self, forces_n: np.ndarray, cell: ResistiveCell, *seeds: int):
        rng, creep = np.random.default_rng(seeds), cell.creep / cell.exponent
        gain = np.exp(cell.spread / cell.exponent * rng.standard_normal(forces_n.shape))
        preload = cell.preload_n * np.abs(rng.standard_normal(forces_n.shape))
        self._rest_n = gain * preload
        touch, older = 1 + creep * rng.uniform(*TOUCHED), 1 + creep * rng.uniform(0, OLDER)
        self._touched_n = gain * (np.maximum(forces_n, 0) * touch + preload * older)


class Domes(NamedTuple):
    """Closed domes, which have one level whatever the reading."""

    closed: np.ndarray

    def levels(self, reading: Reading) -> np.ndarray:
        return self.closed.astype(int)


Outcome = tuple[bool, bool, float]


def _piece(sheet: Sheet, family: str, first: int) -> list[Outcome]:
    def new() -> list[Outcome]:
        return [*_outcomes(sheet, family, first)]

    key = f"{result_cache.made_by(__name__, kits.kit(sheet.kit).skin)} {sheet} {sheet.cover} {family} {first} {SEED}"
    found: list[Outcome] = result_cache.cached("soft", key, new)
    return found


def _outcomes(sheet: Sheet, family: str, first: int) -> Iterator[Outcome]:
    skin, cover = kits.kit(sheet.kit).skin, sheet.cover
    pitch_m = 1e-3 * skin.pitch_x_mm
    for number, drawn in enumerate(placements(family, PIECE, SEED, skin, first), first):
        on = drawn.on_cover(skin, cover)
        loads, there = on.loads(0.0), errors.contacts(on.truth(0.0, skin))
        cells = cells_of(cover, skin.rows, skin.columns, pitch_m, pitch_m, number)
        forces_n = cells.forces_n(loads)
        read = Film(forces_n, cover.cell, SEED, number) if cover.cell else Domes(cells.closed_by(forces_n))
        pressed = Pressed(forces_n, there, there)
        yield outcome(read, sheet.reading, pressed, skin.pitch_x_mm)  # type: ignore[arg-type]


def _judged(sheet: Sheet, family: str, workers: Executor) -> tuple[Interval, Interval]:
    """Shares of wrong counts, and errors of place in mm."""
    pieces = workers.map(functools.partial(_piece, sheet, family), range(0, SCENES, PIECE))
    found = [one for piece in pieces for one in piece]
    return interval([float(wrong) for wrong, _, _ in found]), interval([place_mm for _, _, place_mm in found])


def verdict_table() -> writer.Table:
    """What both kits come to; the last columns compare the soft sheets with the starter kit, beyond intervals if there
    are any."""
    rows = []

    def row(what: str, form: str, spans: Sequence[tuple[float, float, float]], without: str = "") -> None:
        cells = [form.format(*one) for one in spans] + [without] * (len(SHEETS) - len(spans))
        rows.append((what, *cells, *_compared(spans)))

    with pool.executor() as workers:
        judged = {(one, family): _judged(one, family, workers) for one in SHEETS for family in FAMILIES}
    felt = [predict.measured(predict.pressing(one.cover, {"spread": 0.0}), kits.kit(one.kit).skin, 0) for one in SHEETS]
    row("half of fingers felt from", "{:.2f} N", [(one["felt_half_n"],) * 3 for one in felt])
    row("foam touched at 150 mm/s until felt", "{:.1f} ms", [(one["first_closing_ms"],) * 3 for one in felt])
    last_ms = [1e-3 * predictions.load(kits.kit(one.kit))["last_byte_worst_us"].value for one in SHEETS[:2]]
    row("last byte after a cell closes, worst", "{:.2f} ms", [(one,) * 3 for one in last_ms], "not built")
    for number, what, scale, form in (
        (0, "counted wrong", 100, "{:.1f} % ({:.1f} to {:.1f})"),
        (1, "place off by", 1, "{:.2f} mm ({:.2f} to {:.2f})"),
    ):
        for family in FAMILIES:
            spans = [judged[one, family][number] for one in SHEETS]
            row(f"{family} {what}", form, [(scale * one.mean, scale * one.low, scale * one.high) for one in spans])
    prices = [SETUP_USD + JOINT_USD * joints(kits.kit(one.kit)) for one in SHEETS]
    row("assembly without parts", "{:.2f} USD", [(usd,) * 3 for usd in prices])
    head = ("what", *(one.name for one in SHEETS), *(one.name[6:] for one in SHEETS[1:]))
    return writer.Table(head, rows, lambda row: "off by" not in row[0] and row[0].split()[0] not in EASY)


def _compared(spans: Sequence[tuple[float, float, float]]) -> Iterator[str]:
    """Each soft sheet against the starter kit, by mean, low and high."""
    (_, low, high), *soft = spans
    for _, least, most in soft:
        yield "better" if most < low else "worse" if least > high else "even"
    yield from [""] * (len(SHEETS) - len(spans))


def joints(kit: Kit) -> int:
    """Joints that an assembler solders; headers with pins through the board are soldered by hand."""
    pads = [pad for one in kit.layout.drawing.placed if one.part.soldered for pad in one.part.pads]
    return sum(not pad.drill for pad in pads)


def leakage_table() -> str:
    """The largest error of a level by the pins' leakage, at the corners of docs/cell.md."""
    kit, cover = kits.kit("soft"), load_cover(kits.kit("soft").skin_path)
    assert cover is not None
    assert cover.cell is not None
    circuit = extracted(kit.layout).circuit
    forces_n = sorted({force for one in SHEETS[1:] for force in one.reading.forces_n})
    ohm = cover.cell.ohm(np.array(forces_n))
    cells = [f"{force:g} N, {each / 1e3:.3g} kΩ" for force, each in zip(forces_n, ohm, strict=True)]
    rows = [["leakage of a pin", *cells]]
    for leak in LEAKS_UA:
        octaves = falling.error_octaves(circuit, kit.skin.row_lines, kit.skin.columns, ohm, leak)
        rows.append([f"{leak:g} µA", *(f"{one:.2f}" if math.isfinite(one) else "never read" for one in octaves)])
    return writer.table_of(rows)
