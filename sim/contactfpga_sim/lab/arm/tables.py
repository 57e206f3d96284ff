"""Tables and pictures of docs/arm.md."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from contactfpga_sim.lab import writer
from contactfpga_sim.lab.arm import anywhere, comply, pictures, report, sweep
from contactfpga_sim.lab.arm.case import Case
from contactfpga_sim.lab.arm.run import RunRecord, run
from contactfpga_sim.lab.arm.sweep import SweepPoint, SweepTask
from contactfpga_sim.lab.arm.world import Faults
from contactfpga_sim.lab.pool import executor, progress

STEPS_US = (25.0, 12.5, 6.25)
"""Integrator steps, each half of the one before."""

STEPPED = ("closes_s", "torque_before_nm", "peak_force_n", "rest_s")

LIMITS_N = (10.0, 15.0, 20.0, 30.0)


class ArmRuns(NamedTuple):
    plan: pictures.Plan
    points: dict[SweepTask, SweepPoint]
    columns: dict[str, RunRecord]
    anywhere: dict[anywhere.Geometry, anywhere.Found]


def compute() -> ArmRuns:
    case = Case.load("paper")
    plan = pictures.plan(case)
    with executor() as workers, progress() as step:
        points = dict(zip(plan.all, sweep.sweep(plan.all, workers, step)))
        touched = anywhere.many(anywhere.study(), workers, step)
    return ArmRuns(plan, points, report.columns(case, "paper", pictures.PAPER_S), touched)


def draw(folder: Path, found: ArmRuns) -> list[Path]:
    charts = pictures.draw(Case.load("paper"), found.plan, found.points, folder, ("svg",))
    return [*pictures.pictures(found.columns, folder, ("svg",)), *charts]


class Failure(NamedTuple):
    name: str
    changes: dict[str, Any]
    way: str = "uart"
    faults: Faults = Faults()


HALFWAY = report.HALFWAY
BOUNCING = {"bounce_s": 8e-3, "bounce_period_s": 1.5e-3}
FAILURES = (
    Failure("nothing wrong", {}),
    Failure("halfway between four switches", {"touch": (HALFWAY,)}),
    Failure("that, 0.1 m from the joint", {"touch": (HALFWAY | {"lever_m": 0.1},)}),
    Failure("two contacts, one on a switch, one halfway", {"touch": ({}, {"x_mm": 25.0, "y_mm": 25.0})}),
    Failure("the patch's pressure, not a point force", {"model": "foam"}),
    Failure("0.6 m/s: pressed flat", {"link": {"speed_m_s": 0.6}}),
    Failure("0.6 m/s, torque limit alone", {"link": {"speed_m_s": 0.6}}, "torque"),
    Failure("bounce of 8 ms, nobody waits", {"switch": BOUNCING, "control": {"clear_s": 0.0}}),
    Failure("bounce of 8 ms, 2 ms without contact", {"switch": BOUNCING, "control": {"clear_s": 2e-3}}),
    Failure("noise for 4 ms from the closing on", {}, faults=Faults(noise_s=(4.68e-3, 8.68e-3))),
    Failure("board dies before the contact", {}, faults=Faults(board_dies_s=4e-3)),
    Failure("board dies in the contact", {}, faults=Faults(board_dies_s=8e-3)),
    Failure("that, by pin", {}, "pin", Faults(board_dies_s=8e-3)),
    Failure("host dies in the contact", {}, faults=Faults(host_dies_s=8e-3)),
)


def matters_text(found: ArmRuns) -> str:
    return anywhere.matters(found.anywhere)


def places_table(found: ArmRuns) -> str:
    return writer.table_of(anywhere.geometry_lines(found.anywhere))


def effects_table(found: ArmRuns) -> str:
    return writer.table_of(anywhere.effect_lines(found.anywhere))


def set_table(found: ArmRuns) -> str:
    """The output of ``contactfpga study arm``."""
    return writer.table_of(report.table(found.columns, True))


def failure_table() -> str:
    lines = [["", "way", "reacts, ms", "because of", "peak force, N", "indentation, mm", "reversals", "at rest, ms"]]
    for failure in FAILURES:
        found = run(Case.load("paper").but(**failure.changes), failure.way, faults=failure.faults).outcome
        reacts, rest = (f"{1e3 * at:.2f}" if at is not None else "never" for at in (found.reacts_s, found.rest_s))
        flat = " (flat)" if found.bottomed else ""
        deep = f"{1e3 * found.peak_indentation_m:.2f}{flat}"
        numbers = [f"{found.peak_force_n:.1f}", deep, str(found.reversals), rest]
        lines.append([failure.name, failure.way, reacts, found.reason, *numbers])
    return writer.table_of(lines)


def push_table() -> str:
    """Pushes up to the fastest yielded to, and one faster."""
    return writer.table_of(report.push_lines(comply.pushes(Case.load("push"))[1]))


def defense_table() -> str:
    return writer.table_of(report.defense_lines(Case.load("paper")))


def step_table() -> str:
    lines = [["step, us", "way", "closes, ms", "torque before, Nm", "peak force, N", "at rest, ms", "largest change"]]
    for way in ("latency", "uart"):
        before: list[float] | None = None
        for step in STEPS_US:
            found = run(Case.load("paper").but(run={"step_s": 1e-6 * step}), way).outcome
            values = [getattr(found, row.field) for row in report.ROWS]
            change = "" if before is None else f"{100 * max(abs(a / b - 1) for a, b in zip(before, values)):.2f} %"
            shown = [f"{row.scale * value:.4g}" for row, value in zip(report.ROWS, values) if row.field in STEPPED]
            lines.append([f"{step:g}", way, *shown, change])
            before = values
    return writer.table_of(lines)


def sheet_table(found: ArmRuns) -> str:
    lines = [["way", "touches", "to the controller, ms: median / worst", "bound, ms", "peak force, N: median / worst"]]
    bounds = sweep.bounds_s(Case.load("paper"), pictures.Skin())
    for way, name in (("uart", "UART"), ("pin", "pin")):
        points = [found.points[task] for task in found.plan.sheet[way]]
        takes = 1e3 * np.array([point.takes_s for point in points])
        forces = np.array([point.peak_force_n for point in points])
        both = [f"{np.median(values):.2f} / {values.max():.2f}" for values in (takes, forces)]
        lines.append([name, str(len(points)), both[0], f"{1e3 * bounds[name]:.2f}", both[1]])
    return writer.table_of(lines)


def speed_table(found: ArmRuns) -> str:
    """Safe speed by peak force; in brackets by force at the reaction."""
    lines = [["force limit, N", *found.plan.speed, "(δ(limit) - δ(closing)) / 6 ms"]]
    for limit in LIMITS_N:
        cells = []
        for group in found.plan.speed.values():
            speeds = np.array([task.case.link.speed_m_s for task in group])
            fields = ("peak_force_n", "force_before_n")
            forces = [np.array([getattr(found.points[task], field) for task in group]) for field in fields]
            safe, naive = (sweep.safe_speed(speeds, values, limit) for values in forces)
            cells.append(f"**{safe:.2f}** ({f'{naive:.2f}' if naive == naive else f'> {speeds[-1]:g}'})")
        lines.append([f"{limit:g}", *cells, f"{sweep.naive_speed(Case.load('paper'), limit, pictures.PAPER_S):.2f}"])
    return writer.table_of(lines)
