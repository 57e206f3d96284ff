"""The tables and the picture of places by the order of closings, for docs/tracking.md."""

from __future__ import annotations

from pathlib import Path

from contactfpga import picture_style as style
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.order import scores
from contactfpga_sim.lab.order.scores import AFTER_MS, GROWING, MOVING, TIMED, Case, Mean

Found = dict[Case, list[Mean]]

SETTLED, RISING = -1, AFTER_MS.index(10.0)

WORST = "30 %"

LINES = ("solid", "solid", *style.DASHES, "solid", style.DASHES[1], "solid")
"""Styles of the barycenter's line and of those of TIMED, of which the fast frame rates lie on each other."""


def compute() -> Found:
    return scores.measured()


def places_table(found: Found) -> writer.Table:
    """Worst first. The page shows the worst condition alone."""
    errors = "barycenter, mm", "place, mm", "place over barycenter, %"
    head = ("touches", "number", *errors, "in the ellipse, %", "in it after 10 ms, %")
    worst = sorted(GROWING, key=lambda case: -found[case][SETTLED].ratio)
    rows = [(case.title, *_cells(found[case][SETTLED]), _covered(found[case][RISING])) for case in worst]
    return writer.Table(head, rows, lambda row: "," not in row[0] or WORST in row[0])


def _cells(one: Mean) -> tuple[str, ...]:
    ratio = f"{100 * one.ratio:.1f} ± {100 * one.half:.1f}"
    return f"{one.touches}", f"{one.barycenter:.2f}", f"{one.place:.2f}", ratio, _covered(one)


def _covered(one: Mean) -> str:
    return f"{100 * one.covered:.0f} ± {100 * one.covered_half:.0f}"


def moves_table(found: Found) -> writer.Table:
    head = ("a finger", "number", "flagged, %", "barycenter, mm", "place, mm", "place over barycenter, %")
    rows = []
    for case in MOVING:
        one = found[case][SETTLED]
        number, *errors, _ = _cells(one)
        rows.append((case.title, number, f"{100 * one.moved:.0f}", *errors))
    return writer.Table(head, rows)


def times_table(found: Found) -> writer.Table:
    """Errors in mm, and of the last switches' barycenters."""
    head = ("error in mm after", *(f"{after:g} ms" for after in AFTER_MS), "settled")
    last = found[TIMED[len(scores.RATES_HZ) - 1]]
    rows = [("barycenter", *(f"{one.barycenter:.2f}" for one in last))]
    rows += [(case.title, *(f"{one.place:.2f}" for one in found[case])) for case in TIMED]
    return writer.Table(head, rows, lambda row: not row[0].startswith("3,000"))  # as 1,000 and 10,000


def draw(folder: Path, found: Found) -> Path:
    import matplotlib

    lines = {"barycenter": [one.barycenter for one in found[TIMED[len(scores.RATES_HZ) - 1]]]}
    lines |= {case.title: [one.place for one in found[case]] for case in TIMED}
    with matplotlib.rc_context(style.SETTINGS):
        figure = style.new(3.4)
        axes = figure.subplots()
        colors = (style.GRAY, *(one for one in style.PALETTE if one != style.GRAY))
        for (title, errors), color, dashes in zip(lines.items(), colors, LINES, strict=True):
            axes.plot(AFTER_MS, errors[:SETTLED], color=color, ls=dashes, marker="o", ms=3.5, label=title)
        axes.set(xscale="log", ylim=(0, 4.0), xlabel="time since the first switch closed, ms", ylabel="mean error, mm")
        axes.set_xticks(AFTER_MS, [f"{after:g}" for after in AFTER_MS])
        axes.minorticks_off()
        axes.grid(True)
        axes.legend(ncols=2)
        return style.save(figure, folder / "order.svg")
