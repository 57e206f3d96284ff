"""The experiment's numbers beside the paper's."""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

from contactfpga.skin import Skin
from contactfpga_sim.lab.arm.case import Case
from contactfpga_sim.lab.arm.run import ArmResponse, RunRecord, run

UNLIMITED = {"torque_limit_nm": 1e6, "sensor_nm": 1e6}


class ReportLine(NamedTuple):
    name: str
    field: str
    """Field of :class:`contactfpga_sim.lab.arm.run.ArmResponse`."""
    unit: str
    scale: float
    paper: float | None
    """The paper's value, in SI."""
    stated: float | None
    """Expected of the consistent set, in SI."""


ROWS = (
    ReportLine("switch closes", "closes_s", "ms", 1e3, None, 4.68e-3),
    ReportLine("detected", "detected_s", "ms", 1e3, None, None),
    ReportLine("reacts", "reacts_s", "ms", 1e3, None, 10.75e-3),
    ReportLine("speed stays positive for", "positive_s", "ms", 1e3, 5e-3, 5.05e-3),
    ReportLine("sensor torque before the reaction", "torque_before_nm", "Nm", 1, 2.3, 2.54),
    ReportLine("and 0.25 ms later", "torque_after_nm", "Nm", 1, None, 0.2),
    ReportLine("contact force at the reaction", "force_before_n", "N", 1, 12.0, 13.9),
    ReportLine("peak force", "peak_force_n", "N", 1, None, 18.9),
    ReportLine("peak indentation", "peak_indentation_m", "mm", 1e3, None, 2.92e-3),
    ReportLine("contact resolved", "resolved_s", "ms", 1e3, None, None),
    ReportLine("at rest", "rest_s", "ms", 1e3, None, None),
)

NOTES = (
    "The set's speed, motor, controller and human arm were chosen, not measured; the paper gives none of them.",
    "The paper takes its 12 N as the force at which the switch closes. In the set that is 4.2 N, and about 12 N stands "
    'at the reaction; "at 12 N" is the paper\'s reading, with the torque limit and without it.',
)


def columns(case: Case, name: str, latency_s: float, skin: Skin | None = None) -> dict[str, RunRecord]:
    late = f"{1e3 * latency_s:g} ms"
    found = {
        late: run(case, "latency", latency_s=latency_s, skin=skin),
        "UART": run(case, "uart", skin=skin),
        "pin": run(case, "pin", skin=skin),
        "limit alone": run(case, "torque", skin=skin),
    }
    if name == "paper":
        offset = Case.load("paper-offset")
        found[f"at 12 N, {late}"] = run(offset, "latency", latency_s=latency_s, skin=skin)
        found["at 12 N, no limit"] = run(offset.but(control=UNLIMITED), "latency", latency_s=latency_s, skin=skin)
    return found


def cell(row: ReportLine, outcome: ArmResponse) -> str:
    value = getattr(outcome, row.field)
    return "-" if value is None else f"{row.scale * value:.{2 if row.scale * abs(value) < 100 else 1}f}"


def deviation(row: ReportLine, outcome: ArmResponse) -> float | None:
    """Our value over the paper's, less 1."""
    value = getattr(outcome, row.field)
    return None if value is None or row.paper is None else value / row.paper - 1


def table(found: dict[str, RunRecord], paper: bool) -> list[list[str]]:
    """Headings and lines; ``paper`` puts the paper's and consistent numbers first."""
    first = next(iter(found.values())).outcome
    lines = [["", *(["paper", "set"] if paper else []), *found]]
    if paper:
        lines[0].insert(4, "to paper")
    for row in ROWS:
        line = [f"{row.name}, {row.unit}"]
        cells = [cell(row, result.outcome) for result in found.values()]
        if paper:
            line += ["" if value is None else f"{row.scale * value:g}" for value in (row.paper, row.stated)]
            share = deviation(row, first)
            cells.insert(1, "" if share is None else f"{100 * share:+.0f} %")
        lines.append([*line, *cells])
    lines.append(["because of", *(["", ""] if paper else []), *_reasons(found, paper)])
    return lines


def _reasons(found: dict[str, RunRecord], paper: bool) -> list[str]:
    reasons = [result.outcome.reason + (", flat" if result.outcome.bottomed else "") for result in found.values()]
    if paper:
        reasons.insert(1, "")
    return reasons


def as_json(found: dict[str, RunRecord], name: str) -> dict[str, Any]:
    first = next(iter(found.values())).outcome
    known: dict[str, Any] = {
        "case": name,
        "runs": {heading: dataclasses.asdict(result.outcome) for heading, result in found.items()},
    }
    if name == "paper":
        known["paper"] = {row.field: row.paper for row in ROWS if row.paper is not None}
        known["set"] = {row.field: row.stated for row in ROWS if row.stated is not None}
        known["deviation_from_paper"] = {row.field: deviation(row, first) for row in ROWS if row.paper is not None}
        known["notes"] = list(NOTES)
    return known


HALFWAY = {"x_mm": 85.0, "y_mm": 85.0}
DEFENDED: dict[str, dict[str, Any]] = {
    "on a switch": {},
    "halfway between four switches": {"touch": (HALFWAY,)},
    "that, 0.1 m from the joint": {"touch": (HALFWAY | {"lever_m": 0.1},)},
    "foam as a layer, not a half-space": {"model": "foam"},
}
"""Touches of the defense table, as changes to the case."""

DEFENSES = {"torque limit alone": "torque", "contact": "pin", "force threshold": "force", "both": "both"}
DEFENSE_HEADINGS = ("touch", *(f"{name}: reacts, ms / peak, N" for name in DEFENSES))


def defense_lines(case: Case) -> list[list[str]]:
    """Headings, then reaction and peak force of touches by line of defense."""
    lines = [list(DEFENSE_HEADINGS)]
    for name, changes in DEFENDED.items():
        cells = []
        for way in DEFENSES.values():
            found = run(case.but(**changes), way).outcome
            reacts = "never" if found.reacts_s is None else f"{1e3 * found.reacts_s:.2f}"
            cells.append(f"{reacts} / {found.peak_force_n:.1f}" + (" (flat)" if found.bottomed else ""))
        lines.append([name, *cells])
    return lines
