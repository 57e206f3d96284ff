"""The tables and pictures of docs/cover.md."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from contactfpga.design.cover import drawing
from contactfpga.design.cover.design import thinning
from contactfpga.design.cover.task import FIRST_DESIGN, FOAMS
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.cover import formulas, paper, pictures


def _cell(error: float) -> str:
    if math.isnan(error):
        return "none"
    if math.isinf(error) or abs(error) > 1e6:
        return "infinite"
    if abs(error) < formulas.FLOOR:
        return "< 1e-13"
    if abs(error) >= 1e-3:
        return f"{100 * error:+.1f} %"
    return f"{abs(error):.0e}"


def _rule_table(rules: dict[str, formulas.Rule]) -> str:
    rows = [["rule", *(blow.name for blow in formulas.BLOWS), "time"]]
    for name, rule in rules.items():
        errors = formulas.relative_errors(rule)
        with np.errstate(all="ignore"):
            takes = 1e6 * formulas.seconds(lambda rule=rule: rule(formulas.BLOWS[0]))  # type: ignore[misc]
        told = f"{takes:.1f}" if takes < 10 else f"{takes:,.0f}"
        rows.append([name, *map(_cell, errors), f"{told} µs"])
    return writer.table_of(rows)


def sense_table() -> str:
    """Models of sensitivity: error against the reference, and time."""
    study = formulas
    rows = [["model", "ball", *(f"ρ/h = {place:g}" for place in study.PLACES), "time"]]
    for model in study.LADDER:
        for name, ball in study.BALLS.items():
            sheet = study.PaddedSheet(study.SWITCH, study.THICKNESS_M, ball)
            takes = 1e6 * study.seconds(lambda sheet=sheet, model=model: sheet.force_n(model, 3e-3))  # type: ignore[misc]
            errors = ["0" if error == 0 else f"{100 * error:+.1f} %" for error in study.sense_errors(model, ball)]
            rows.append([str(model), name, *errors, f"{takes:,.0f} µs"])
    return writer.table_of(rows)


def paper_table() -> str:
    """What is printed, what we get, and the verdict."""
    rows = [(row.printed, row.ours, row.verdict) for row in paper.rows()]
    return writer.table_of([("paper says", "we get", "verdict"), *rows])


def thinning_table() -> str:
    """The first design as the reaction gets faster."""
    head = (
        "reaction after",
        "foam that lasts 4/3 of it",
        "pressed in",
        "peak force",
        "the paper's foam: by then",
        "in all",
    )
    lines = []
    for one in thinning(FIRST_DESIGN, FIRST_DESIGN.foams[0]):
        assert one.modulus_pa is not None
        assert one.compression_m is not None
        assert one.pressed_m is not None
        assert one.stopped_m is not None
        depths = [f"{1e3 * depth:.3g} mm" for depth in (one.compression_m, one.pressed_m, one.stopped_m)]
        foam = (f"{1e3 * one.latency_s:.3g} ms", f"{1e-6 * one.modulus_pa:,.4g} MPa")
        lines.append(writer.line((*foam, depths[0], f"{one.force_n:.4g} N", *depths[1:])))
    return writer.table(head, lines)


def foam_table() -> str:
    """Every foam with its source."""
    rows = [["foam", "E", "density", "Y", "pressed up to", "source"]]
    for one in FOAMS:
        density = "" if one.density_kg_m3 is None else f"{one.density_kg_m3:g} kg/m³"
        strength = "" if one.yield_pa is None else f"{1e-3 * one.yield_pa:g} kPa"
        modulus, strain = f"{1e-3 * one.modulus_pa:g} kPa", f"{100 * one.strain:g} %"
        rows.append([one.name, modulus, density, strength, strain, one.source])
    return writer.table_of(rows)


def rules_table() -> str:
    """Rules for the peak force: error against the exact one, and time."""
    return _rule_table(formulas.RULES)


def failing_table() -> str:
    """The same of rules that fail."""
    return _rule_table(formulas.FAILING)


def draw(folder: Path) -> list[Path]:
    """The pictures of the command's answer, and the one of the study."""
    return [*drawing.draw(folder, "svg"), pictures.study(folder / "cover-study.svg")]
