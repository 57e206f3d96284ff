"""Pictures of a run, after the paper's Figs. 6 and 7: the arm's speed, and the torque between motor and arm."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from contactfpga import picture_style as style
from contactfpga_sim.lab.arm.run import Result

LOOKS: tuple[dict[str, Any], ...] = (
    {"color": style.BLACK, "linestyle": style.DASHES[0], "linewidth": 1.5},
    {"color": style.VERMILLION, "linestyle": style.DASHES[1], "linewidth": 1.5},
    {"color": style.BLUE, "linestyle": style.DASHES[2], "linewidth": 1.5},
    {"color": style.SKY, "linestyle": style.DASHES[0], "linewidth": 3.0},
    {"color": style.ORANGE, "linestyle": style.DASHES[1], "linewidth": 1.5},
    {"color": style.GREEN, "linestyle": style.DASHES[3], "linewidth": 1.5},
)
"""Of the runs: one that takes the same course as another is seen beneath it."""

DRAWN = {"speed": ("speed_rad_s", "angular speed, rad/s"), "torque": ("sensor_nm", "torque between motor and arm, Nm")}
NAMES = {"speed": "arm-fig6-speed", "torque": "arm-fig7-torque"}
FROM_S, TO_S = -5e-3, 40e-3
"""What the enlarged part shows."""


def pictures(found: dict[str, Result], folder: Path, suffixes: tuple[str, ...] = ("png", "svg")) -> list[Path]:
    """Both pictures in each format into ``folder``."""
    folder.mkdir(parents=True, exist_ok=True)
    with matplotlib.rc_context(style.SETTINGS):
        figures = {name: course(found, *DRAWN[name]) for name in DRAWN}
        return [
            style.save(figure, folder / f"{NAMES[name]}.{end}") for name, figure in figures.items() for end in suffixes
        ]


def course(found: dict[str, Result], field: str, label: str) -> Figure:
    """A quantity over time, around the contact above and whole below."""
    figure = style.new(6.4)
    near, whole = figure.subplots(2, 1, sharey=True)
    for look, (name, result) in zip(LOOKS, found.items()):
        time, values = 1e3 * result.course["time_s"], result.course[field]
        for place in (near, whole):
            place.plot(time, values, label=name, **look)
            _mark(place, result, field, look["color"])
    for place in (near, whole):
        place.axhline(0, color=style.SOFT, linewidth=0.8)
        place.grid()
        place.set_ylabel(label)
    near.set_xlim(1e3 * FROM_S, 1e3 * TO_S)
    near.set_title("around the contact", loc="left")
    whole.set_xlim(left=1e3 * FROM_S)
    whole.set_title("the whole run", loc="left")
    whole.set_xlabel("time from the touch, ms")
    lines = [line for line in near.get_lines() if line.get_label() in found]
    keys = {"a switch closes": "o", "the controller reacts": "x"}
    marks = [Line2D([], [], color=style.SOFT, marker=mark, linestyle="", fillstyle="none") for mark in keys.values()]
    names = [*(line.get_label() for line in lines), *keys]
    figure.legend(lines + marks, names, loc="outside lower center", ncols=4)
    return figure


def _mark(place: Any, result: Result, field: str, color: str) -> None:
    for seconds, mark in ((result.outcome.closes_s, "o"), (result.outcome.reacts_s, "x")):
        if seconds is not None:
            at = int(result.course["time_s"].searchsorted(seconds - 1e-9))
            place.plot(1e3 * seconds, result.course[field][at], mark, color=color, ms=6, fillstyle="none", zorder=3)
