"""Tables and pictures of docs/arm.md."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from contactfpga_sim.apps.pool import executor, progress
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.arm import anywhere, kits, pictures, report, sweep
from contactfpga_sim.lab.arm.case import Case
from contactfpga_sim.lab.arm.run import RunRecord, run
from contactfpga_sim.lab.arm.sweep import SweepPoint, SweepTask
from contactfpga_sim.lab.arm.world import Faults

PLACES = (
    anywhere.PAPER,
    anywhere.FLUSH,
    *(anywhere.FLUSH._replace(face=face) for face in ("buttons", "tiles")),
    anywhere.BEST,
)
"""Geometries that the page shows."""

SET = ("reacts", "speed stays", "contact force at the reaction", "peak force")
"""Rows of the set that the page shows."""

LIMITS_N = (10.0, 15.0, 20.0, 30.0)


class ArmRuns(NamedTuple):
    plan: pictures.Plan
    points: dict[SweepTask, SweepPoint]
    columns: dict[str, RunRecord]
    anywhere: dict[anywhere.Geometry, anywhere.Found]
    kits: dict[kits.Collision, anywhere.Found]


def compute() -> ArmRuns:
    case = Case.load("paper")
    plan = pictures.plan(case)
    with executor() as workers, progress() as step:
        points = dict(zip(plan.all, sweep.sweep(plan.all, workers, step)))
        touched = anywhere.many(anywhere.study(), workers, step)
        covered = anywhere.many(kits.study(kits.fingers()), workers, step)
    return ArmRuns(plan, points, report.columns(case, "paper", pictures.PAPER_S), touched, covered)


def draw(folder: Path, found: ArmRuns) -> list[Path]:
    chart = pictures.draw(Case.load("paper"), found.plan, found.points, folder)
    return [*pictures.pictures(found.columns, folder, ("svg",)), chart]


class Failure(NamedTuple):
    name: str
    changes: dict[str, Any]
    faults: Faults = Faults()


HALFWAY = report.HALFWAY
BOUNCING = {"bounce_s": 8e-3, "bounce_period_s": 1.5e-3}
FAILURES = (
    Failure("nothing wrong", {}),
    Failure("halfway between four switches", {"touch": (HALFWAY,)}),
    Failure("foam as a layer, not a half-space", {"model": "foam"}),
    Failure("bounce of 8 ms, nobody waits", {"switch": BOUNCING, "control": {"clear_s": 0.0}}),
    Failure("bounce of 8 ms, 2 ms without contact", {"switch": BOUNCING, "control": {"clear_s": 2e-3}}),
    Failure("board dies before the contact", {}, faults=Faults(board_dies_s=4e-3)),
    Failure("board dies in the contact", {}, faults=Faults(board_dies_s=8e-3)),
    Failure("host dies in the contact", {}, faults=Faults(host_dies_s=8e-3)),
)


def matters_text(found: ArmRuns) -> str:
    return anywhere.matters(found.anywhere)


def places_table(found: ArmRuns) -> writer.Table:
    head, *rows = anywhere.geometry_lines(found.anywhere)
    shown = [row for geometry, row in zip(found.anywhere, rows, strict=True) if geometry in PLACES]
    columns = [name for name in head if not name.startswith(("limit alone", "pressed in"))]
    return writer.Table(head, rows, lambda row: row in shown, columns)


def kits_table(found: ArmRuns) -> writer.Table:
    """The page has a kit with domes and one with light cells, without palms."""
    head, *rows = kits.lines(found.kits)

    def shown(row: Sequence[str]) -> bool:
        return row[1] != "palm" and row[0] in ("starter", "soft")

    return writer.Table(head, rows, shown)


def set_table(found: ArmRuns) -> writer.Table:
    """The output of ``contactfpga study arm``."""
    head, *rows = report.table(found.columns, True)
    return writer.Table(head, rows, lambda row: row[0].startswith(SET), ("", "paper", "set", *list(found.columns)[:4]))


def failure_table() -> str:
    lines = [["", "reacts, ms", "because of", "peak force, N", "reversals"]]
    for failure in FAILURES:
        found = run(Case.load("paper").but(**failure.changes), "uart", faults=failure.faults).outcome
        reacts = "never" if found.reacts_s is None else f"{1e3 * found.reacts_s:.2f}"
        lines.append([failure.name, reacts, found.reason, f"{found.peak_force_n:.1f}", str(found.reversals)])
    return writer.table_of(lines)


def defense_table() -> str:
    return writer.table_of(report.defense_lines(Case.load("paper")))


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
    lines = [["force limit, N", *found.plan.speed]]
    for limit in LIMITS_N:
        cells = []
        for group in found.plan.speed.values():
            speeds = np.array([task.case.link.speed_m_s for task in group])
            fields = ("peak_force_n", "force_before_n")
            forces = [np.array([getattr(found.points[task], field) for task in group]) for field in fields]
            safe, naive = (sweep.safe_speed(speeds, values, limit) for values in forces)
            cells.append(f"**{safe:.2f}** ({f'{naive:.2f}' if naive == naive else f'> {speeds[-1]:g}'})")
        lines.append([f"{limit:g}", *cells])
    return writer.table_of(lines)
