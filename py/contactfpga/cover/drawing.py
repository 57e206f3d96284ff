"""Pictures of the cover; needs matplotlib. The same input gives the same file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib.figure import Figure

from contactfpga.cover import elastic, impact, line, medium, motion, point
from contactfpga.cover import formula_study as measured
from contactfpga.cover.answer import NoSolution
from contactfpga.cover.hertz import Ball
from contactfpga.cover.paper import FIRST_DESIGN, WORST_M
from contactfpga.cover.solve import Floats
from contactfpga.cover.switch import Switch
from contactfpga.cover.task import Task

COLOURS = {"halfspace": "#2b6f9e", "bonded": "#d1495b", "frictionless": "#8a6fb0"}
SETTINGS: dict[str, Any] = {
    "svg.hashsalt": "contactfpga",
    "svg.fonttype": "none",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
}


def draw(folder: Path, suffix: str, task: Task = FIRST_DESIGN, data: tuple[Floats, Floats] | None = None) -> list[Path]:
    """Every picture into ``folder`` as ``png`` or ``svg``; Fig. 9 only with ``data``: forces (N), deformations (m)."""
    with matplotlib.rc_context(SETTINGS):
        figures = {"cover-force": force(task.switch), "cover-impact": course(task), "cover-map": design_map(task)}
        if data:
            figures["cover-line"] = deformation(*data)
        return [save(figure, folder / f"{name}.{suffix}") for name, figure in figures.items()]


def save(figure: Figure, path: Path) -> Path:
    """Write a picture without the time at which it was drawn."""
    metadata = {"Date": None} if path.suffix == ".svg" else {"Software": None}
    figure.savefig(path, dpi=150, bbox_inches="tight", metadata=metadata)
    return path


def force(switch: Switch) -> Figure:
    """The two curves of the paper's Fig. 8, over three media: force over offset, 5 mm thick, and over thickness."""
    figure = Figure(figsize=(8, 3.2))
    left, right = figure.subplots(1, 2)
    offsets, depths = np.linspace(0, 10e-3, 201), np.linspace(2e-3, 20e-3, 181)
    for name in medium.MEDIA:
        look: dict[str, Any] = {"color": COLOURS[name], "label": name}
        left.plot(1e3 * offsets, _closing(switch, offsets, np.full(201, 5e-3), name), **look)
        right.plot(1e3 * depths, _closing(switch, np.full(181, WORST_M), depths, name), **look)
    for place in (left, right):
        place.set_ylim(0, 200)
        place.set_ylabel("force that closes the switch, N")
    left.axvline(1e3 * WORST_M, color="#999", lw=0.8, ls=":")
    left.set_xlabel("distance from the switch, mm (cover 5 mm)")
    right.set_xlabel("thickness, mm (7.07 mm from the switch)")
    right.plot(1e3 * point.best_thickness_m(WORST_M), point.least_force_n(switch, WORST_M), "o", ms=4, color="#333")
    left.legend()
    return figure


def course(task: Task) -> Figure:
    """Indentation, speed and force over time for the task's foams."""
    figure = Figure(figsize=(8, 3.0))
    places = figure.subplots(1, 3)
    for foam in task.foams[:6]:
        stiffness = elastic.stiffness(Ball(task.radius_m, elastic.effective_modulus_pa(foam.modulus_pa, task.poisson)))
        hit = impact.strike(task.arm, task.speed_m_s, stiffness)
        if isinstance(hit, NoSolution):
            continue
        over = motion.course(task.arm, task.speed_m_s, stiffness, hit.compression_m)
        for place, values in zip(places, (1e3 * over.indentation_m, over.speed_m_s, over.force_n)):
            place.plot(1e3 * over.time_s, values, label=foam.name)
    for place, name in zip(places, ("pressed in, mm", "speed, m/s", "force, N")):
        place.axvline(1e3 * task.latency_s, color="#999", lw=0.8, ls=":")
        place.set_xlabel("time since the touch, ms")
        place.set_ylabel(name)
    places[0].legend()
    figure.tight_layout()
    return figure


def design_map(task: Task) -> Figure:
    """The force felt everywhere over thickness and pitch, by the half-space and by the bonded layer, and the limits."""
    figure = Figure(figsize=(8, 3.4))
    places = figure.subplots(1, 2, sharey=True)
    thickness = np.linspace(1e-3, 2 * task.thickness_m, 120)
    pitch = np.linspace(1e-3, 2 * task.pitch_m, 120)
    levels = [2, 5, 10, 20, 50, 100, 200, 500]
    for place, name in zip(places, ("halfspace", "bonded")):
        forces = _closing(task.switch, pitch[:, None] / math.sqrt(2), thickness[None, :], name)
        lines = place.contour(1e3 * thickness, 1e3 * pitch, forces, levels=levels, colors=COLOURS[name], linewidths=0.8)
        place.clabel(lines, fmt="%g N")
        place.contour(1e3 * thickness, 1e3 * pitch, forces, levels=[task.force_n], colors="#333", linewidths=2)
        fits = (forces <= task.force_n) & (pitch[:, None] <= task.pitch_m) & (thickness <= task.thickness_m)
        place.contourf(1e3 * thickness, 1e3 * pitch, fits.astype(float), levels=[0.5, 1.5], colors=["#e6efe0"])
        place.axvline(1e3 * task.thickness_m, color="#999", lw=0.8, ls=":")
        place.axhline(1e3 * task.pitch_m, color="#999", lw=0.8, ls=":")
        place.set_title(f"{name}, limit {task.force_n:g} N")
        place.set_xlabel("thickness, mm")
    places[0].set_ylabel("pitch, mm")
    return figure


def deformation(force_n: Floats, deformation_m: Floats) -> Figure:
    """Measured points and their line, as the paper's Fig. 9."""
    fitted = line.fit(force_n, deformation_m)
    figure = Figure(figsize=(4, 3.2))
    place = figure.subplots()
    place.plot(force_n, 1e3 * deformation_m, "o", ms=3, color="#2b6f9e")
    ends = np.array([min(0.0, force_n.min()), force_n.max()])
    place.plot(ends, 1e3 * (fitted.offset_m + ends / fitted.stiffness_n_m), color="#333", lw=1)
    place.set_title(f"{fitted.stiffness_n_m / 1e3:.4g} N/mm, correlation {fitted.correlation:.4f}")
    place.set_xlabel("force, N")
    place.set_ylabel("deformation, mm")
    return figure


def _closing(switch: Switch, offset_m: Floats, thickness_m: Floats, within: str) -> Floats:
    """The point force in N that closes a switch; NaN, which is not drawn, where none does."""
    ratio = offset_m / thickness_m
    spread = medium.spread(within, ratio)
    limit = medium.first_zero(within)
    pressed = spread > 0 if limit is None else ratio < limit
    return np.where(pressed, switch.closing_pa * thickness_m**2 / np.where(pressed, spread, 1.0), np.nan)


def study(path: Path) -> Path:
    """Error against time of the rules for the compression time, and of the models of sensitivity."""
    with matplotlib.rc_context(SETTINGS):
        figure = Figure(figsize=(8.5, 3.8))
        left, right = figure.subplots(1, 2)
        _rules(left)
        _models(right)
        for place in (left, right):
            place.set_xscale("log")
            place.set_yscale("log")
            place.set_xlabel("time, µs")
        figure.tight_layout()
        return save(figure, path)


def _rules(place: Any) -> None:
    found = []
    for rules, colour in ((measured.RULES, COLOURS["halfspace"]), (measured.FAILING, COLOURS["bonded"])):
        for name, rule in rules.items():
            error = abs(measured.relative_errors(rule)[0])
            if math.isfinite(error):
                takes = 1e6 * measured.seconds(lambda rule=rule: rule(measured.BLOWS[0]))  # type: ignore[misc]
                found.append((max(error, 1e-15), takes, name.replace("*", ""), colour))
    below = math.inf
    for error, takes, name, colour in sorted(found, reverse=True):
        below = min(error, below / 5)  # labels of rules that are alike go below each other
        place.plot(takes, error, "o", ms=4, color=colour)
        place.annotate(
            name,
            (takes, error),
            xytext=(max(2.2 * takes, 60), below),
            fontsize=6,
            color=colour,
            va="center",
            arrowprops={"arrowstyle": "-", "lw": 0.4, "color": colour},
        )
    place.set_xlim(0.3, 2e5)
    place.set_ylim(1e-18, 1)
    place.set_ylabel("error of the compression time")


def _models(place: Any) -> None:
    for number, model in enumerate(measured.LADDER):
        for ball, mark in zip(measured.BALLS.values(), ("o", "x")):
            sheet = measured.Sheet(measured.SWITCH, measured.THICKNESS_M, ball)
            takes = 1e6 * measured.seconds(lambda sheet=sheet, model=model: sheet.force_n(model, 3e-3))  # type: ignore
            errors = [max(abs(one), 1e-4) for one in measured.sense_errors(model, ball) if math.isfinite(one)]
            place.plot([takes] * len(errors), errors, mark, ms=4, color=COLOURS[model.within])
            if mark == "o":
                height = 20 if number % 2 else 9
                place.annotate(str(model), (takes, height), fontsize=6, ha="center", color=COLOURS[model.within])
    place.axhline(0.05, color="#999", lw=0.8, ls=":")
    place.set_xlim(1, 5e3)
    place.set_ylim(5e-5, 40)
    place.set_ylabel("error of the closing force, ρ/h from 0 to 1.414")
