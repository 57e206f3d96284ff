"""Pictures of a run, after the paper's Figs. 6 and 7: the arm's speed, and the torque between motor and arm."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
from matplotlib.figure import Figure

from contactfpga.cover.drawing import SETTINGS, save
from contactfpga_sim.studies.arm.run import Result

COLOURS = ("#333333", "#d1495b", "#2b6f9e", "#e0a030", "#8a6fb0", "#66a182")
DRAWN = {"speed": ("speed_rad_s", "angular speed, rad/s"), "torque": ("sensor_nm", "torque between motor and arm, Nm")}
NAMES = {"speed": "arm-fig6-speed", "torque": "arm-fig7-torque"}
FROM_S, TO_S = -5e-3, 40e-3
"""What the enlarged part shows."""


def pictures(found: dict[str, Result], folder: Path, suffixes: tuple[str, ...] = ("png", "svg")) -> list[Path]:
    """Both pictures in each format into ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    with matplotlib.rc_context(SETTINGS):
        figures = {name: course(found, *DRAWN[name]) for name in DRAWN}
        return [save(figure, folder / f"{NAMES[name]}.{end}") for name, figure in figures.items() for end in suffixes]


def course(found: dict[str, Result], field: str, label: str) -> Figure:
    """A quantity over time, whole on the left and around the contact on the right."""
    figure = Figure(figsize=(9, 3.4))
    whole, near = figure.subplots(1, 2, sharey=True)
    for colour, (name, result) in zip(COLOURS, found.items()):
        time, values = 1e3 * result.course["time_s"], result.course[field]
        for place in (whole, near):
            place.plot(time, values, color=colour, lw=1.2, label=name)
            _mark(place, result, field, colour)
    for place in (whole, near):
        place.axhline(0, color="#999999", lw=0.6)
        place.set_xlabel("time from the touch, ms")
    whole.set_ylabel(label)
    whole.set_xlim(left=1e3 * FROM_S)
    near.set_xlim(1e3 * FROM_S, 1e3 * TO_S)
    near.legend(fontsize=7)
    near.set_title("o: a switch closes   x: the controller reacts", fontsize=8)
    figure.tight_layout()
    return figure


def _mark(place: Any, result: Result, field: str, colour: str) -> None:
    for seconds, mark in ((result.outcome.closes_s, "o"), (result.outcome.reacts_s, "x")):
        if seconds is not None:
            at = int(result.course["time_s"].searchsorted(seconds - 1e-9))
            place.plot(1e3 * seconds, result.course[field][at], mark, color=colour, ms=5, fillstyle="none")
