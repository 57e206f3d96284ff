"""Pictures of the cover's formulas: error over computing time on this machine."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullLocator

from contactfpga import picture_style as style
from contactfpga_sim.lab.cover import formulas as measured

LEAST_SHARE = 1e-3
"""Errors below are on a linear scale, which shows 0."""

SHORTER = 1e-9
"""Smallest gain, of the axes' length, that counts as a shorter line, above rounding."""

Point = tuple[float, float]


def study(path: Path) -> Path:
    """Error over time of the compression-time rules and the sensitivity models."""
    with matplotlib.rc_context(style.SETTINGS):
        figure = style.new(7.6)
        above, below = figure.subplots(2, 1, height_ratios=(1.25, 1))
        _rules(above)
        _models(below)
        return style.save(figure, path)


def _rules(place: Any) -> None:
    """Rule names in a column on the right, joined by lines without crossings."""
    found = []
    for rules, color in ((measured.RULES, style.BLUE), (measured.FAILING, style.VERMILLION)):
        for name, rule in rules.items():
            error = abs(measured.relative_errors(rule)[0])
            if math.isfinite(error):
                takes = 1e6 * measured.seconds(lambda rule=rule: rule(measured.BLOWS[0]))  # type: ignore[misc]
                found.append((max(error, measured.FLOOR), takes, name.replace("*", ""), color))
    found.sort(reverse=True)
    place.set(
        xscale="log", yscale="log", xlim=(0.3, 2 * max(takes for _, takes, _, _ in found)), ylim=(measured.FLOOR / 3, 1)
    )
    to_axes = place.transData + place.transAxes.inverted()
    names = [(1.03, 0.99 - 0.94 * number / (len(found) - 1)) for number in range(len(found))]
    ends = uncrossed([tuple(to_axes.transform((takes, error))) for error, takes, _, _ in found], names)
    for (error, takes, name, color), end in zip(found, ends, strict=True):
        place.plot(takes, error, "o", ms=6, color=color, zorder=3)
        place.annotate(
            name,
            (takes, error),
            xytext=end,
            textcoords="axes fraction",
            va="center",
            fontsize=style.SMALL,
            arrowprops={"arrowstyle": "-", "lw": 0.5, "color": color, "relpos": (0, 0.5), "alpha": 0.7},
        )
    errors = [10.0**power for power in range(-13, 1, 2)]
    place.set_yticks(errors, [f"< {measured.FLOOR:g}", *map(_power, errors[1:])])
    _times(place)
    place.set_ylabel("error of the compression time")
    place.set_title("Rules: chosen from (blue), failing (red)", loc="left")


def uncrossed(starts: Sequence[Point], ends: Sequence[Point]) -> list[Point]:
    """The ends reordered so that no two lines from start to end cross.

    Swapping two ends of crossing lines shortens them, so the loop ends.
    """
    found = list(ends)
    while longer := [
        (a, b)
        for a, b in itertools.combinations(range(len(starts)), 2)
        if math.dist(starts[a], found[b]) + math.dist(starts[b], found[a]) + SHORTER
        < math.dist(starts[a], found[a]) + math.dist(starts[b], found[b])
    ]:
        a, b = longer[0]
        found[a], found[b] = found[b], found[a]
    return found


def _models(place: Any) -> None:
    """Every model with both balls; errors at several offsets share a column."""
    place.set_xscale("log")
    place.set_yscale("symlog", linthresh=LEAST_SHARE)
    marks = dict(zip(measured.BALLS, ("o", "x")))
    colors = dict(zip(measured.LADDER, style.PALETTE))
    for model, color in colors.items():
        for name, ball in measured.BALLS.items():
            sheet = measured.PaddedSheet(measured.SWITCH, measured.THICKNESS_M, ball)
            takes = 1e6 * measured.seconds(lambda sheet=sheet, model=model: sheet.force_n(model, 3e-3))  # type: ignore
            errors = [abs(one) for one in measured.sense_errors(model, ball) if math.isfinite(one)]
            place.plot([takes] * len(errors), errors, marks[name], ms=6, color=color, clip_on=False, zorder=3)
    place.axhline(0, color=style.SOFT, linewidth=0.8)
    place.axhline(0.05, color=style.SOFT, linewidth=1, linestyle=style.DASHES[2])
    place.set(xlim=(1, 5e3), ylim=(-LEAST_SHARE / 5, 10))
    place.yaxis.set_major_formatter(FuncFormatter(lambda share, _: f"{100 * share:g} %"))
    _times(place)
    place.set_ylabel("error of the closing force")
    place.set_title("Models, at five offsets from 0 to 1.414 thicknesses", loc="left")
    keys = {str(model): Line2D([], [], color=color, marker="s", linestyle="") for model, color in colors.items()}
    keys |= {name: Line2D([], [], color=style.INK, marker=mark, linestyle="") for name, mark in marks.items()}
    keys["tolerance, 5 %"] = Line2D([], [], color=style.SOFT, linewidth=1, linestyle=style.DASHES[2])
    place.legend(list(keys.values()), list(keys), loc="center left", bbox_to_anchor=(1.01, 0.5))


def _times(place: Any) -> None:
    least, most = place.get_xlim()
    ticks = [us for us in (1, 10, 100, 1000, 10_000) if least <= us <= most]
    place.set_xticks(ticks, [f"{us:,}" for us in ticks])
    place.xaxis.set_minor_locator(NullLocator())
    place.yaxis.set_minor_locator(NullLocator())
    place.set_xlabel("time, µs")
    place.grid()


def _power(value: float) -> str:
    return "1" if value == 1 else f"{value:.0e}".replace("e-0", "e-")
