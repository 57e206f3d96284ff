"""Tables and pictures of docs/haptics.md and docs/haptics_limits.md."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import matplotlib
import numpy as np

from contactfpga import picture_style as style
from contactfpga.robot.haptics import Cylinder, rate
from contactfpga.robot.haptics.rate import Rating, Requirements, compared
from contactfpga_sim.apps import pool
from contactfpga_sim.lab import knobs, writer
from contactfpga_sim.lab.failures import tables
from contactfpga_sim.lab.haptics import breaks, coverage, felt
from contactfpga_sim.lab.haptics.coverage import Coverage, CoverageCase
from contactfpga_sim.lab.haptics.felt import METHODS, SETTINGS, TIMES_S, Setting

LINK = Requirements(Cylinder(0.038), (-0.075, 0.075))
RING_M = 0.03
CONTACTS = 1000

NAMED = (
    "hexapod at mid-length, 45 degrees",
    "hexapod at mid-length, 60 degrees",
    "hexapod at one end, 45 degrees",
    "two rings at the quarters, 55 degrees",
    "two rings at the ends, 45 degrees",
)


def layouts_table() -> str:
    found = compared(LINK, RING_M)
    rows = [["units", "a unit bears", "error of the place", "error of the force", "smallest force seen"]]
    rows += [_layout(one) for one in found if one.layout.name in NAMED]
    rows.append(_layout(found[0], "best of all: "))
    return writer.table_of(rows)


def _layout(rating: Rating, before: str = "") -> list[str]:
    return [
        before + rating.layout.name,
        f"{rating.bears_n:.1f} N",
        f"{1e3 * rating.place_m:.3f} mm",
        f"{rating.force_n:.3f} N",
        f"{rating.seen_n:.3f} N",
    ]


def places_table() -> str:
    rows = [["method", "pitch", "error", "the barycenter's", "stated radius", "over theory", "covers"]]
    for case, found in _covered(coverage.RIGHT):
        theory = "" if math.isnan(found.theory_m) else f"{found.radius_m / found.theory_m:.2f}"
        lengths = [f"{1e3 * one:.2f} mm" for one in (found.rms_m, found.barycenter_m, found.radius_m)]
        rows.append([case.method, f"{case.pitch_mm:g} mm", *lengths, theory, _percent(found.covered)])
    return writer.table_of(rows)


def wrong_table() -> str:
    rows = [["method", "what it does not know", "error", "the barycenter's", "stated radius", "covers", "reports it"]]
    for case, found in _covered(coverage.WRONG):
        lengths = [f"{1e3 * one:.2f} mm" for one in (found.rms_m, found.barycenter_m, found.radius_m)]
        rows.append([_named(case), case.wrong, *lengths, _percent(found.covered), _percent(found.disagreed)])
    return writer.table_of(rows)


def _covered(cases: Sequence[CoverageCase]) -> Iterator[tuple[CoverageCase, Coverage]]:
    with pool.executor() as workers:
        yield from zip(cases, workers.map(coverage.run, cases, itertools.repeat(CONTACTS)), strict=True)


def _named(case: CoverageCase) -> str:
    return f"{case.method}, {case.pitch_mm:g} mm"


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"


END_TO_END = 100
"""Contacts per line; `make campaign` presses 1,000 in all."""

APART_MM = (30.0, 60.0, 100.0)


@functools.cache
def found(setting: Setting, count: int = END_TO_END, times_s: tuple[float, ...] = TIMES_S) -> dict[str, np.ndarray]:
    """(contacts, times) errors in m by method."""
    with pool.executor() as workers:
        each = list(workers.map(felt.errors, itertools.repeat(setting), range(count), itertools.repeat(times_s)))
    return {method: np.array([one[method] for one in each]) for method in METHODS}


def interval(errors: np.ndarray) -> tuple[float, float, float]:
    """RMS with its 95 % interval from the spread of squares."""
    squares = errors[~np.isnan(errors)] ** 2
    mean, half = squares.mean(), 1.96 * squares.std(ddof=1) / math.sqrt(len(squares))
    return math.sqrt(mean), math.sqrt(max(0.0, mean - half)), math.sqrt(mean + half)


def pairs_table() -> writer.Table:
    rows = []
    for kind in felt.KINDS:
        for apart in APART_MM:
            each = [felt.two(apart, seed, kind) for seed in range(END_TO_END)]
            off = np.array([one for pair in each for one in pair.off_n])
            middle, low, high = interval(off)
            rows.append([kind, f"{apart:g} mm", f"{middle:.2f} N", f"{low:.2f} to {high:.2f} N"])
    head = ("contacts", "apart", "error of a push", "95 % interval")
    return writer.Table(head, rows, lambda row: row[1] == f"{APART_MM[1]:g} mm")


def breaks_table() -> writer.Table:
    """The page shows knobs whose first method fails unnoticed."""
    swept = knobs.sweeps(breaks.__name__)
    rows = [row for name, methods in swept.items() for row in tables.rows(breaks.KNOBS[name], methods)]
    return writer.Table(
        tables.HEAD,
        rows,
        lambda row: row[0] and "**not noticed" in row[6],
        ("knob", "breaks at", "reported", "what helps"),
    )


def draw(folder: Path) -> list[Path]:
    placed = rate.draw(folder / "haptics-place.svg", LINK, compared(LINK, RING_M))
    return [placed, _front(folder / "haptics-front.svg")]


COLORS = (style.SKY, style.ORANGE, style.PURPLE, style.BLACK)
MARKS = "o^sD"


def _front(path: Path) -> Path:
    with matplotlib.rc_context(style.SETTINGS):
        figure = style.new(3.4)
        panels = figure.subplots(1, len(SETTINGS), sharey=True)
        for panel, setting in zip(panels, SETTINGS):
            for (method, errors), color, mark in zip(found(setting).items(), COLORS, MARKS):
                middle = [1e3 * interval(errors[:, at])[0] for at in range(len(TIMES_S))]
                panel.loglog([1e3 * one for one in TIMES_S], middle, marker=mark, ms=4, color=color, label=method)
            noisy = ", noisy" if setting.spread else ""
            panel.set_title(f"pitch {setting.pitch_mm:g} mm{noisy}", loc="left", fontsize=style.NORMAL)
            panel.set(xlabel="ms after the first switch closed", xticks=(0.3, 1, 3, 10), yticks=(0.01, 0.1, 1))
            panel.minorticks_off()
            panel.xaxis.set_major_formatter("{x:g}")
            panel.yaxis.set_major_formatter("{x:g}")
        panels[0].set(ylabel="error of the place, mm")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(METHODS))
        return style.save(figure, path)
