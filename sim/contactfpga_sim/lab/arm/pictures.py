"""The paper's Figs. 6 and 7 of a run, and a chart of force over latency."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator

from contactfpga import picture_style as style
from contactfpga.skin import Skin
from contactfpga_sim.lab.arm import sweep
from contactfpga_sim.lab.arm.case import Case
from contactfpga_sim.lab.arm.run import RunRecord
from contactfpga_sim.lab.arm.sweep import SweepPoint, SweepTask

LOOKS: tuple[dict[str, Any], ...] = (
    {"color": style.BLACK, "linestyle": style.DASHES[0], "linewidth": 1.8},
    {"color": style.VERMILLION, "linestyle": style.DASHES[0], "linewidth": 1.8},
    {"color": style.BLUE, "linestyle": style.DASHES[1], "linewidth": 1.8},
)

DRAWN = {"speed": ("speed_rad_s", "angular speed, rad/s"), "torque": ("sensor_nm", "torque between motor and arm, Nm")}
NAMES = {"speed": "arm-fig6-speed", "torque": "arm-fig7-torque"}
FROM_S, TO_S = -5e-3, 40e-3


def pictures(found: dict[str, RunRecord], folder: Path, suffixes: tuple[str, ...] = ("png", "svg")) -> list[Path]:
    folder.mkdir(parents=True, exist_ok=True)
    with matplotlib.rc_context(style.SETTINGS):
        figures = {name: course(found, *DRAWN[name]) for name in DRAWN}
        return [
            style.save(figure, folder / f"{NAMES[name]}.{end}") for name, figure in figures.items() for end in suffixes
        ]


def course(found: dict[str, RunRecord], field: str, label: str) -> Figure:
    figure = style.new(3.9)
    place = figure.subplots()
    for look, (name, result) in zip(LOOKS, found.items()):
        way = f"by the {name}" if name in ("UART", "pin") else f"after {name}"
        place.plot(1e3 * result.course["time_s"], result.course[field], label=way, **look)
        _mark(place, result, field, look["color"])
    place.axhline(0, color=style.SOFT, linewidth=0.8)
    place.grid()
    place.set(ylabel=label, xlabel="time from the touch, ms", xlim=(1e3 * FROM_S, 1e3 * TO_S))
    keys = {"a switch closes": "o", "the controller reacts": "x"}
    marks = [Line2D([], [], color=style.SOFT, marker=mark, linestyle="", fillstyle="none") for mark in keys.values()]
    lines, names = place.get_legend_handles_labels()
    figure.legend([*lines, *marks], [*names, *keys], loc="outside lower center", ncols=5)
    return figure


def _mark(place: Any, result: RunRecord, field: str, color: str) -> None:
    for seconds, mark in ((result.outcome.closes_s, "o"), (result.outcome.reacts_s, "x")):
        if seconds is not None:
            at = int(result.course["time_s"].searchsorted(seconds - 1e-9))
            place.plot(1e3 * seconds, result.course[field][at], mark, color=color, ms=7, mew=1.6, fillstyle="none")


PAPER_S = 6e-3
LATENCIES_S = tuple(1e-3 * ms for ms in (0.1, 0.2, 0.35, 0.5, 0.75, 1, 1.5, 2, 3, 4, 5, 6, 8, 10, 12, 16, 20))
SPEEDS_M_S = tuple(0.02 * step for step in range(1, 31))
INSTANTS = 8
"""Touches of the gateware's runs, a controller period apart."""
COLORS = {"6 ms": style.BLACK, "UART": style.VERMILLION, "pin": style.BLUE, "last byte": style.GREEN}
BOUND_OF = "bound, "
BOUND: dict[str, Any] = {"linewidth": 1.2, "linestyle": style.DASHES[2]}
TICKS_MS = (0.01, 0.1, 1, 10)


@dataclasses.dataclass(frozen=True)
class Plan:
    force: tuple[SweepTask, ...]
    sheet: dict[str, tuple[SweepTask, ...]]
    speed: dict[str, tuple[SweepTask, ...]]

    @property
    def all(self) -> list[SweepTask]:
        groups = [self.force, *self.sheet.values(), *self.speed.values()]
        return [task for group in groups for task in group]


def plan(case: Case, latencies: Sequence[float] = LATENCIES_S, speeds: Sequence[float] = SPEEDS_M_S) -> Plan:
    alone, bounds = sweep.unlimited(case), sweep.bounds_s(case, Skin())
    by_speed = {"6 ms": PAPER_S, "UART": bounds["UART"], "pin": bounds["pin"]}
    leads = [case.run.lead_s + number * case.control.period_s for number in range(INSTANTS)]

    def moving(speed: float) -> Case:
        # Its base is far below: the force of the foam alone is the question.
        return alone.but(link={"speed_m_s": speed}, foam={"base_n_m": 1e-3})

    return Plan(
        force=tuple(SweepTask(alone, latency_s=latency) for latency in latencies),
        sheet={way: tuple(SweepTask(case.but(run={"lead_s": lead}), way) for lead in leads) for way in ("uart", "pin")},
        speed={
            name: tuple(SweepTask(moving(speed), latency_s=latency) for speed in speeds)
            for name, latency in by_speed.items()
        },
    )


def draw(case: Case, tasks: Plan, found: dict[SweepTask, SweepPoint], folder: Path) -> Path:
    with matplotlib.rc_context(style.SETTINGS):
        return style.save(_force(case, tasks, found), folder / "arm-force.svg")


def _axes(x: str, y: str) -> tuple[Figure, Any]:
    figure = style.new(4.8)
    place = figure.subplots()
    place.set_xlabel(x)
    place.set_ylabel(y)
    place.grid()
    return figure, place


def _latencies(place: Any, case: Case) -> None:
    for name, bound in sweep.bounds_s(case, Skin()).items():
        place.axvline(1e3 * bound, color=COLORS[name], label=f"{BOUND_OF}{name}", **BOUND)
    place.set_xscale("log")
    least, most = place.get_xlim()
    ticks = [ms for ms in TICKS_MS if least <= ms <= most]
    place.set_xticks(ticks, map("{:g}".format, ticks))
    place.xaxis.set_minor_locator(NullLocator())
    place.set_ylim(bottom=0)


def _force(case: Case, tasks: Plan, found: dict[SweepTask, SweepPoint]) -> Figure:
    figure, place = _axes("from the closed switch to the controller, ms", "force on the human arm, N")
    place.set_title(f"The arm meets a person at {case.link.speed_m_s:g} m/s", loc="left")
    late = [1e3 * task.latency_s for task in tasks.force]
    points = [found[task] for task in tasks.force]
    peak, reacts = [point.peak_force_n for point in points], [point.force_before_n for point in points]
    place.plot(late, peak, color=style.BLACK, lw=2, label="peak")
    place.plot(late, reacts, color=style.GRAY, lw=2, label="when the controller reacts")
    for way, name in (("uart", "UART"), ("pin", "pin")):
        some = [found[task] for task in tasks.sheet[way]]
        takes, forces = [1e3 * point.takes_s for point in some], [point.peak_force_n for point in some]
        label = f"peak by the {name}, {len(some)} touches through the gateware"
        place.plot(takes, forces, "o", ms=5, color=COLORS[name], label=label, zorder=3)
    place.plot(1e3 * PAPER_S, 12, "*", color=style.INK, ms=10, label="paper: 12 N when it reacts, after 6 ms")
    _latencies(place, case)
    for line in place.get_lines():
        if (name := str(line.get_label())).startswith(BOUND_OF):
            at = line.get_xdata()[0]
            words = f"longest: {name.removeprefix(BOUND_OF)} "
            place.annotate(
                words, (at, 1), (-3, 0), xycoords=place.get_xaxis_transform(), textcoords="offset points",
                rotation=90, ha="right", va="top", fontsize=style.SMALL, color=style.SOFT,
            )  # fmt: skip
            line.set_label("_")
    figure.legend(loc="outside lower center", ncols=2)
    return figure
