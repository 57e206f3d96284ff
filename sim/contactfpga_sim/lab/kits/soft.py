"""The soft kit beside the starter kit, row by row; tables of docs/soft.md."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor

import numpy as np

from contactfpga.design import kits, predictions
from contactfpga.design.circuit import falling
from contactfpga.design.cover import ResistiveCell, load_cover
from contactfpga.design.cover.cells import cells_of
from contactfpga.design.kits import Kit
from contactfpga.design.sheet.extract import extracted
from contactfpga.zones.levels import LASTS
from contactfpga_sim.apps import errors, pool, result_cache, score
from contactfpga_sim.apps.light import GUARD, OLDER, TOUCHED
from contactfpga_sim.apps.score import Interval, interval
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.benchmark import entries, scenes
from contactfpga_sim.lab.benchmark.scenes import FAMILIES
from contactfpga_sim.lab.kits import predict
from contactfpga_sim.lab.kits.film import LevelReader
from contactfpga_sim.model.scenes.families import placements

SCENES, PIECE, SEED = 400, 50, 3
SETUP_USD, JOINT_USD = 9.5, 0.0017
"""JLCPCB's tariff for an assembly, with a stencil (docs/starter.md)."""
LEAKS_UA = 10.0, 1.0, 0.1
KITS = ("starter", "soft")


def _film_ohm(forces_n: np.ndarray, cell: ResistiveCell, *seeds: int) -> np.ndarray:
    """Resistances of a drawn film, infinite where its preload masks a cell; preload, creep and mask are as in
    :class:`contactfpga_sim.apps.light.Sensed`."""
    rng, creep = np.random.default_rng(seeds), cell.creep / cell.exponent
    gain = np.exp(cell.spread / cell.exponent * rng.standard_normal(forces_n.shape))
    preload = cell.preload_n * np.abs(rng.standard_normal(forces_n.shape))
    touch, older = 1 + creep * rng.uniform(*TOUCHED), 1 + creep * rng.uniform(0, OLDER)
    ohm = cell.ohm(gain * (np.maximum(forces_n, 0) * touch + preload * older))
    return np.where(GUARD * cell.ohm(gain * preload) <= cell.level_ohm, np.inf, ohm)


Outcome = tuple[bool, bool, float]


def _piece(name: str, family: str, first: int) -> list[Outcome]:
    def new() -> list[Outcome]:
        return [*_outcomes(name, family, first)]

    kit = kits.kit(name)
    key = f"{result_cache.made_by(__name__, kit.skin)} {name} {load_cover(kit.skin_path)} {family} {first} {SEED}"
    found: list[Outcome] = result_cache.cached("soft", key, new)
    return found


def _outcomes(name: str, family: str, first: int) -> Iterator[Outcome]:
    kit, cover = kits.kit(name), load_cover(kits.kit(name).skin_path)
    skin, pitch_m = kit.skin, 1e-3 * kit.skin.pitch_x_mm
    assert cover is not None
    reader, circuit = (LevelReader(skin), extracted(kit.layout).circuit) if cover.cell else (None, None)
    for number, drawn in enumerate(placements(family, PIECE, SEED, skin, first), first):
        on = drawn.on_cover(skin, cover)
        loads, there = on.loads(0.0), errors.contacts(on.truth(0.0, skin))
        cells = cells_of(cover, skin.rows, skin.columns, pitch_m, pitch_m, number)
        forces_n = cells.forces_n(loads)
        if reader and circuit and cover.cell:
            read = reader.read(_film_ohm(forces_n, cover.cell, SEED, number), circuit)
        else:
            read = cells.closed_by(forces_n).astype(int)
        truth = scenes.places(there, skin.pitch_x_mm)
        yield score.judged(entries.places(read, skin.pitch_x_mm, LASTS), truth, truth)


def _judged(name: str, family: str, workers: Executor) -> tuple[Interval, Interval]:
    """Shares of wrong counts, and errors of place in mm."""
    pieces = workers.map(functools.partial(_piece, name, family), range(0, SCENES, PIECE))
    found = [one for piece in pieces for one in piece]
    return interval([float(wrong) for wrong, _, _ in found]), interval([place_mm for _, _, place_mm in found])


def verdict_table() -> writer.Table:
    """What both kits come to; the last column compares them, beyond intervals if there are any."""
    rows, every = [], [kits.kit(name) for name in KITS]

    def row(what: str, form: str, spans: Sequence[tuple[float, float, float]]) -> None:
        (_, low, high), (_, least, most) = spans
        verdict = "better" if most < low else "worse" if least > high else "even"
        rows.append((what, *(form.format(*one) for one in spans), verdict))

    with pool.executor() as workers:
        judged = {(name, family): _judged(name, family, workers) for family in FAMILIES for name in KITS}
    felt = [_felt(kit) for kit in every]
    row("half of fingers felt from", "{:.2f} N", [(one["felt_half_n"],) * 3 for one in felt])
    row("foam touched at 150 mm/s until felt", "{:.1f} ms", [(one["first_closing_ms"],) * 3 for one in felt])
    last_ms = [1e-3 * predictions.load(kit)["last_byte_worst_us"].value for kit in every]
    row("last byte after a cell closes, worst", "{:.2f} ms", [(one,) * 3 for one in last_ms])
    for number, what, scale, form in (
        (0, "counted wrong", 100, "{:.1f} % ({:.1f} to {:.1f})"),
        (1, "place off by", 1, "{:.2f} mm ({:.2f} to {:.2f})"),
    ):
        for family in FAMILIES:
            spans = [judged[name, family][number] for name in KITS]
            row(f"{family} {what}", form, [(scale * one.mean, scale * one.low, scale * one.high) for one in spans])
    row("assembly without parts", "{:.2f} USD", [(SETUP_USD + JOINT_USD * joints(kit),) * 3 for kit in every])
    even = "edge counted wrong"  # beside eight other rows
    return writer.Table(("what", *KITS, "soft is"), rows, lambda row: "off by" not in row[0] and row[0] != even)


def _felt(kit: Kit) -> dict[str, float]:
    cover = load_cover(kit.skin_path)
    assert cover is not None
    return predict.measured(predict.pressing(cover, {"spread": 0.0}), kit.skin, 0)


def joints(kit: Kit) -> int:
    """Joints that an assembler solders; headers with pins through the board are soldered by hand."""
    pads = [pad for one in kit.layout.drawing.placed if one.part.soldered for pad in one.part.pads]
    return sum(not pad.drill for pad in pads)


def leakage_table() -> str:
    """The largest error of a level by the pins' leakage, at the corners of docs/cell.md, and by the clock: its instant
    and the ruler's time are whole clocks."""
    kit, cover = kits.kit("soft"), load_cover(kits.kit("soft").skin_path)
    assert cover is not None
    assert cover.cell is not None
    circuit, lines = extracted(kit.layout).circuit, (kit.skin.row_lines, kit.skin.columns)
    ruler_s = falling.ruler_s(circuit, *lines)
    instants_s = np.array(kit.skin.derived.rulers) / falling.SIXTEENTHS * ruler_s
    ohm = falling.read_ohm(circuit, lines[0], instants_s)
    forces_n = cover.cell.ohm_at_1n / ohm  # its exponent is 1
    cells = [f"{force:.2f} N, {each / 1e3:.3g} kΩ" for force, each in zip(forces_n, ohm, strict=True)]
    clock = np.sum(
        [np.log2(1 + 1 / (kit.skin.clock_hz * one)) for one in (instants_s, np.full_like(instants_s, ruler_s))], axis=0
    )
    rows = [["leakage of a pin", *cells]]
    for leak in LEAKS_UA:
        octaves = falling.error_octaves(circuit, *lines, ohm, leak) + clock
        rows.append([f"{leak:g} µA", *(f"{one:.2f}" for one in octaves)])
    return writer.table_of([*rows, ["of which the clock", *(f"{one:.2f}" for one in clock)]])
