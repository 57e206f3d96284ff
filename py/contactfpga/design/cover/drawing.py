"""Pictures of the cover by matplotlib; the same input gives the same file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from contactfpga import picture_style as style
from contactfpga.design.cover import line, medium, point
from contactfpga.design.cover.numerics import Floats
from contactfpga.design.cover.point import Switch
from contactfpga.design.cover.task import FIRST_DESIGN, WORST_M, Task
from contactfpga.picture_style import save

COLORS = {"halfspace": style.BLUE, "bonded": style.VERMILLION, "frictionless": style.GREEN}
LIMIT: dict[str, Any] = {"color": style.SOFT, "linewidth": 1.0, "linestyle": style.DASHES[2]}
FITS = "#cfe3d4"

FIRST_M, MOST_N = 5e-3, 200.0
"""Thickness of the paper's cover, and the largest drawn force."""

THIN_M = 1e-3
"""Least thickness and pitch on the map of designs."""


def draw(folder: Path, suffix: str, task: Task = FIRST_DESIGN, data: tuple[Floats, Floats] | None = None) -> list[Path]:
    """Write every picture into ``folder`` as ``png`` or ``svg``; Fig. 9 needs ``data``: forces (N), deformations
    (m)."""
    with matplotlib.rc_context(style.SETTINGS):
        figures = {"cover-force": force(task.switch), "cover-map": design_map(task)}
        if data:
            figures["cover-line"] = deformation(*data)
        return [save(figure, folder / f"{name}.{suffix}") for name, figure in figures.items()]


def force(switch: Switch) -> Figure:
    """The curves of the paper's Fig. 8 over three media: force over offset, 5 mm thick, and over thickness."""
    figure = style.new(3.5)
    left, right = figure.subplots(1, 2, sharey=True)
    offsets, depths = np.linspace(0, 10e-3, 201), np.linspace(2e-3, 20e-3, 181)
    for name, dashes in zip(medium.MEDIA, style.DASHES):
        look: dict[str, Any] = {"color": COLORS[name], "label": name, "linestyle": dashes}
        left.plot(1e3 * offsets, _closing(switch, offsets, np.full(201, FIRST_M), name), **look)
        right.plot(1e3 * depths, _closing(switch, np.full(181, WORST_M), depths, name), **look)
    left.axvline(1e3 * WORST_M, **LIMIT)
    right.axvline(1e3 * FIRST_M, **LIMIT)
    left.set(ylabel="force that closes the switch, N", ylim=(0, MOST_N), xlim=(0, 10))
    left.set_xlabel("distance from the switch, mm")
    right.set(xlabel="thickness of the cover, mm", xlim=(0, 20))
    left.set_title(f"cover {1e3 * FIRST_M:g} mm thick", loc="left")
    right.set_title(f"{1e3 * WORST_M:.2f} mm from the switch", loc="left")
    least_n = point.least_force_n(switch, WORST_M)
    right.plot(1e3 * point.best_thickness_m(WORST_M), least_n, "o", ms=5, color=style.INK)
    lines = [*left.get_lines()[:3], Line2D([], [], **LIMIT), right.get_lines()[-1]]
    other = f"{1e3 * WORST_M:.2f} mm, the farthest place, and {1e3 * FIRST_M:g} mm: the other panel's"
    names = [*medium.MEDIA, other, f"least by halfspace: {least_n:.0f} N"]
    figure.legend(lines, names, loc="outside lower center", ncols=3, title=f"Forces above {MOST_N:g} N are cut off")
    return figure


def design_map(task: Task) -> Figure:
    """The force felt everywhere over thickness and pitch, by half-space and bonded layer, and the limits."""
    figure = style.new(4.2)
    places = figure.subplots(1, 2, sharey=True)
    thickness = np.linspace(THIN_M, 2 * task.thickness_m, 120)
    pitch = np.linspace(THIN_M, 2 * task.pitch_m, 120)
    levels = [5, 10, 20, 50, 100, 200, 500]
    named = []
    for place, name in zip(places, ("halfspace", "bonded")):
        forces = _closing(task.switch, pitch[:, None] / math.sqrt(2), thickness[None, :], name)
        fits = (forces <= task.force_n) & (pitch[:, None] <= task.pitch_m) & (thickness <= task.thickness_m)
        place.contourf(1e3 * thickness, 1e3 * pitch, fits.astype(float), levels=[0.5, 1.5], colors=[FITS])
        lines = place.contour(1e3 * thickness, 1e3 * pitch, forces, levels=levels, colors=COLORS[name], linewidths=0.8)
        tops = [_top(1e3 * thickness, 1e3 * pitch, forces <= level) for level in levels if (forces <= level).any()]
        named.append((place, lines, tops))
        place.contour(1e3 * thickness, 1e3 * pitch, forces, levels=[task.force_n], colors=style.INK, linewidths=2)
        place.axvline(1e3 * task.thickness_m, **LIMIT)
        place.axhline(1e3 * task.pitch_m, **LIMIT)
        place.set_title(name, loc="left")
        place.set_xlabel("thickness, mm")
        place.set(xlim=(0, 2e3 * task.thickness_m), ylim=(0, 2e3 * task.pitch_m))
    places[0].set_ylabel("pitch, mm")
    title = f"Force felt everywhere, for thickness and pitch from {1e3 * THIN_M:g} mm on"
    figure.suptitle(title, x=0.02, ha="left", fontsize=style.LARGE)
    keys = {
        f"closes everywhere at {task.force_n:g} N": Line2D([], [], color=style.INK, linewidth=2),
        f"at most {1e3 * task.thickness_m:g} mm thick, pitch {1e3 * task.pitch_m:g} mm": Line2D([], [], **LIMIT),
        "within all limits": Patch(facecolor=FITS),
    }
    figure.legend(list(keys.values()), list(keys), loc="outside lower center", ncols=3)
    figure.draw_without_rendering()  # the names turn with the lines, and need to know how these will lie
    for place, lines, tops in named:
        for text in place.clabel(lines, fmt="%g N", fontsize=style.SMALL, colors=style.INK, manual=tops):
            if float(text.get_text().removesuffix(" N")) > task.force_n:  # on the card, where a limit may cross it
                text.set_bbox({"facecolor": style.CARD, "edgecolor": "none", "pad": 0.5})
    return figure


def _top(thickness: Floats, pitch: Floats, inside: np.ndarray) -> tuple[float, float]:
    high = np.where(inside.any(axis=0), pitch[len(pitch) - 1 - inside[::-1].argmax(axis=0)], 0.0)
    column = int(np.argmax(np.minimum(high, 0.85 * pitch[-1])))
    return float(thickness[column]), float(high[column])


def deformation(force_n: Floats, deformation_m: Floats) -> Figure:
    """Measured points and their line, as in the paper's Fig. 9."""
    fitted = line.fit(force_n, deformation_m)
    figure = style.new(4.0)
    place = figure.subplots()
    place.plot(force_n, 1e3 * deformation_m, "o", ms=4, color=style.BLUE)
    ends = np.array([min(0.0, force_n.min()), force_n.max()])
    place.plot(ends, 1e3 * (fitted.offset_m + ends / fitted.stiffness_n_m), color=style.INK, lw=1)
    place.set_title(f"{fitted.stiffness_n_m / 1e3:.4g} N/mm, correlation {fitted.correlation:.4f}", loc="left")
    place.set_xlabel("force, N")
    place.set_ylabel("deformation, mm")
    return figure


def _closing(switch: Switch, offset_m: Floats, thickness_m: Floats, within: str) -> Floats:
    """Point force in N that closes a switch; NaN if none does."""
    ratio = offset_m / thickness_m
    spread = medium.spread(within, ratio)
    limit = medium.first_zero(within)
    pressed = spread > 0 if limit is None else ratio < limit
    return np.where(pressed, switch.closing_pa * thickness_m**2 / np.where(pressed, spread, 1.0), np.nan)
