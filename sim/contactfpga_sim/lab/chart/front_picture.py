"""The chart's first picture: time from the touch to the last byte against wrong counts and errors of place.

Its points are the scores of the benchmark's entries, by the model under which an entry counts worse.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import NullLocator

from contactfpga import picture_style as style

WIDTH_IN = 390 / 96
"""Width of a phone, where the picture fits."""

KITS = ("domes, 6.4 mm", "soft kit")
"""Entries with the design of the starter and the fast kit, and with the soft kit's levels."""


Offset = tuple[float, float]


class Row(NamedTuple):
    """Entries that differ in one setting."""

    color: str
    mark: str
    entries: Mapping[str, str]
    """Entries by the words at their marks."""
    spot: Offset = (6, 0)
    others: Mapping[str, Offset] = {}
    """Offset of the words from their mark, in points, and that of some words."""


def _pitches(name: str) -> dict[str, str]:
    return {pitch: f"{name}, {pitch} mm" for pitch in ("8", "6.4", "5", "4")}


ROWS = {
    "domes of 0.4 N, by pitch in mm": Row(style.BLUE, "o", _pitches("domes"), (0, 9)),
    "domes at 6.4 mm, by force": Row(
        style.PURPLE,
        "s",
        {f"{force} N": f"domes of {force} N, 6.4 mm" for force in ("0.2", "0.6", "1")},
        (1, -10),
        {"0.2 N": (0, 9)},
    ),
    "one level of force, by pitch": Row(style.GREEN, "^", _pitches("one level"), others={"4": (-5, -4)}),
    "three levels, by pitch": Row(
        style.VERMILLION, "D", _pitches("three levels"), (-6, 0), {"4": (0, -10), "8": (4, 8)}
    ),
    "three levels of the soft kit": Row(style.VERMILLION, "s", {"soft": "soft kit"}, (-1, 12)),
    "analog array at 6.4 mm (model)": Row(style.BROWN, "v", {"array": "analog array"}, (-2, -10)),
    "microcontroller, OpenCV (models)": Row(style.SKY, "P", {"MCU, OpenCV": "microcontroller", "": "OpenCV"}, (1, -20)),
}
FOREIGN = Row(style.BLACK, "*", {})
"""Entries that are not ours, under their own names."""


class Panel(NamedTuple):
    label: str
    field: str
    factor: float
    ticks: tuple[float, ...]
    ends: tuple[float, float]


PANELS = (
    Panel("scenes with a wrong count, %", "wrong", 100.0, (2, 5, 10, 20, 50, 100), (1.5, 150)),
    Panel("error of place, mm", "place_mm", 1.0, (0.1, 0.2, 0.5, 1, 2, 5, 10, 20), (0.1, 30)),
)
TICKS_MS, ENDS_MS = (5, 10, 20, 30), (5, 36)
BITS_MS = 19 * 10 / 3e3
"""Milliseconds that the bits of the shortest frame with a zone need at 3 Mbaud."""


ENOUGH = 30
"""Scenes with a right count from which a family's error of place counts."""


class Spot(NamedTuple):
    """An entry in a panel."""

    late_ms: float
    """Median of all scenes."""
    worst: float
    low: float
    high: float
    mean: float
    """Of the worst family, with its 95 % interval, and of all scenes."""


Lines = Sequence[dict[str, str]]


def placed(lines: Lines, panel: Panel) -> Spot:
    """Where the lines of an entry's scores stand in a panel."""

    def value(line: dict[str, str], end: str = "") -> float:
        return panel.factor * float(line[panel.field + end])

    def right(line: dict[str, str]) -> float:
        return int(line["scenes"]) * (1 - float(line["wrong"])) if panel.field == "place_mm" else math.inf

    of = [line for line in lines if line["family"] != "all" and right(line) >= ENOUGH]
    worst = max(of or lines, key=value)
    every = max((line for line in lines if line["family"] == "all"), key=value)
    late = min(1e3 * float(every["median_s"]), ENDS_MS[1])  # which also stands for never
    found = (value(worst), value(worst, "_low"), value(worst, "_high"), value(every))
    return Spot(late, *(max(one, panel.ends[0]) for one in found))  # which also stands for none


def bound(lines: Lines) -> bool:
    """Whether these scores are a least error of any method, which has no time."""
    return lines[0]["kind"] == "bound"


def save(scores: Path, path: Path) -> Path:
    """Draw scores as :func:`contactfpga_sim.apps.score.write` writes them; equal scores give equal files."""
    with open(scores, newline="", encoding="utf-8") as file, matplotlib.rc_context(style.SETTINGS):
        return style.save(picture(csv.DictReader(file)), path)


def picture(lines: Iterable[dict[str, str]]) -> Figure:
    by: dict[str, list[dict[str, str]]] = {}
    for line in lines:
        by.setdefault(line["entry"], []).append(line)
    ours = {entry for row in ROWS.values() for entry in row.entries.values()}
    foreign = FOREIGN._replace(entries={entry: entry for entry in by if entry not in ours and not bound(by[entry])})
    figure = style.new(8.2, WIDTH_IN)
    for axes, panel in zip(figure.subplots(2, 1, sharex=True), PANELS, strict=True):
        _axes(axes, panel)
        for row in (*ROWS.values(), foreign):
            _row(axes, panel, row, by, words=panel is PANELS[0] or row is foreign)
        for at in (placed(by[kit], panel) for kit in KITS if kit in by):
            axes.plot(at.late_ms, at.worst, "o", ms=13, mfc="none", mec=style.INK, mew=1.2, zorder=6, clip_on=False)
        for entry in filter(lambda entry: panel is PANELS[1] and bound(by[entry]), by):
            least = max(float(line[panel.field]) for line in by[entry])
            axes.axhline(least, color=style.SOFT, ls="--", lw=1)
            below: Any = {"xytext": (0, -2), "textcoords": "offset points", "ha": "right", "va": "top"}
            below |= {"xycoords": axes.get_yaxis_transform(), "fontsize": style.SMALL}
            axes.annotate(f"{entry}: {least:.2f} mm", (0.99, least), **below)
    axes.set_xlabel("touch of the foam to the last byte, ms:\nmedian of all scenes (without USB)")
    marks = [Line2D([], [], color=row.color, marker=row.mark, lw=1, ms=6) for row in ROWS.values()]
    marks += [Line2D([], [], color=style.SOFT, marker="_", ls="", ms=7)]
    marks += [Line2D([], [], color=style.INK, marker="o", mfc="none", ls="", ms=11)]
    words = [*ROWS, "below a mark: the mean of all families", "the kits: starter and fast, and soft"]
    figure.legend(marks, words, loc="outside lower left", ncols=1)
    return figure


def _axes(axes: Any, panel: Panel) -> None:
    axes.set(xscale="log", yscale="log", xlim=ENDS_MS, ylim=panel.ends)
    axes.set_title(f"{panel.label}, in the worst family", loc="left")
    axes.set_xticks(TICKS_MS, TICKS_MS)
    axes.set_yticks(panel.ticks, map("{:g}".format, panel.ticks))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_minor_locator(NullLocator())
    axes.grid()
    axes.text(0.01, 0.02, f"← bits alone: {BITS_MS:.2f} ms", transform=axes.transAxes, fontsize=style.SMALL)


def _row(axes: Any, panel: Panel, row: Row, by: Mapping[str, Lines], words: bool) -> None:
    spots = {word: placed(by[entry], panel) for word, entry in row.entries.items() if entry in by}
    for word, at in spots.items():
        axes.plot([at.late_ms] * 2, [at.low, at.high], color=row.color, lw=0.8, alpha=0.5)
        axes.plot(at.late_ms, at.worst, row.mark, color=row.color, ms=6, mew=0, zorder=3)
        axes.plot(at.late_ms, at.mean, "_", color=row.color, ms=7, zorder=3)
        if words and word:
            spot = row.others.get(word, row.spot)
            side = "left" if spot[0] > 0 else "right" if spot[0] else "center"
            place = {"xytext": spot, "textcoords": "offset points", "ha": side, "va": "center"}
            axes.annotate(word, (at.late_ms, at.worst), fontsize=style.SMALL, **place)
        axes.set_xlim(min(axes.get_xlim()[0], 0.8 * at.late_ms or ENDS_MS[0]), ENDS_MS[1])
    axes.plot([at.late_ms for at in spots.values()], [at.worst for at in spots.values()], color=row.color, lw=1)
