"""The tables and the picture of places by the order of closings, for docs/tracking.md."""

from __future__ import annotations

from pathlib import Path

from contactfpga import picture_style as style
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.order import scores
from contactfpga_sim.lab.order.scores import AFTER_MS, GROWING, MOVING, TIMED, Case, Mean

Found = dict[Case, list[Mean]]

SETTLED = -1

WORST = "30 %"


def compute() -> Found:
    return scores.measured()


def places_table(found: Found) -> writer.Table:
    """Worst first. The page shows the worst condition alone."""
    head = ("touches", "number", "barycenter, mm", "place, mm", "place over barycenter, %", "within the ellipse, %")
    worst = sorted(GROWING, key=lambda case: -found[case][SETTLED].ratio)
    rows = [(case.title, *_cells(found[case][SETTLED])) for case in worst]
    return writer.Table(head, rows, lambda row: "," not in row[0] or WORST in row[0])


def _cells(one: Mean) -> tuple[str, ...]:
    ratio = f"{100 * one.ratio:.1f} ± {100 * one.half:.1f}"
    return f"{one.touches}", f"{one.barycenter:.2f}", f"{one.place:.2f}", ratio, f"{100 * one.covered:.0f}"


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
    return writer.Table(head, rows)


def draw(folder: Path, found: Found) -> Path:
    import matplotlib

    lines = {"barycenter": [one.barycenter for one in found[TIMED[len(scores.RATES_HZ) - 1]]]}
    lines |= {case.title: [one.place for one in found[case]] for case in TIMED}
    with matplotlib.rc_context(style.SETTINGS):
        figure = style.new(3.4)
        axes = figure.subplots()
        for (title, errors), color in zip(lines.items(), (style.GRAY, *style.PALETTE)):
            axes.plot(AFTER_MS, errors[:SETTLED], color=color, marker="o", ms=4, label=title)
        axes.set(xscale="log", ylim=(0, 3.6), xlabel="time since the first cell closed, ms", ylabel="mean error, mm")
        axes.set_xticks(AFTER_MS, [f"{after:g}" for after in AFTER_MS])
        axes.minorticks_off()
        axes.grid(True)
        axes.legend(ncols=2)
        return style.save(figure, folder / "order.svg")
