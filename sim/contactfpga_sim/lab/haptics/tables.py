"""The tables and pictures of docs/haptics.md."""

from __future__ import annotations

import math
from pathlib import Path

from contactfpga.robot.haptics import Cylinder, rate
from contactfpga.robot.haptics.rate import Rating, Requirements, compared
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.haptics import coverage, felt_tables
from contactfpga_sim.lab.haptics.coverage import Case

LINK = Requirements(Cylinder(0.038), (-0.075, 0.075))
RING_M = 0.03
CONTACTS = 1000
"""Of each line of the table of places."""

NAMED = (
    "hexapod at mid-length, 45 degrees",
    "hexapod at mid-length, 60 degrees",
    "hexapod at one end, 45 degrees",
    "two rings at the quarters, 55 degrees",
    "two rings at the ends, 45 degrees",
)


def layouts_table() -> str:
    """Arrangements of the page's link, and the best of all."""
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
    """Places as each method finds them, where its assumptions hold."""
    rows = [["method", "pitch", "error", "the barycenter's", "stated radius", "over theory", "covers"]]
    for case in coverage.RIGHT:
        found = coverage.run(case, CONTACTS)
        theory = "" if math.isnan(found.theory_m) else f"{found.radius_m / found.theory_m:.2f}"
        lengths = [f"{1e3 * one:.2f} mm" for one in (found.rms_m, found.barycenter_m, found.radius_m)]
        rows.append([case.method, f"{case.pitch_mm:g} mm", *lengths, theory, _percent(found.covered)])
    return writer.table_of(rows)


def wrong_table() -> str:
    """The same where they do not."""
    rows = [["method", "what it does not know", "error", "the barycenter's", "stated radius", "covers", "reports it"]]
    for case in coverage.WRONG:
        found = coverage.run(case, CONTACTS)
        lengths = [f"{1e3 * one:.2f} mm" for one in (found.rms_m, found.barycenter_m, found.radius_m)]
        rows.append([_named(case), case.wrong, *lengths, _percent(found.covered), _percent(found.disagreed)])
    return writer.table_of(rows)


def _named(case: Case) -> str:
    return f"{case.method}, {case.pitch_mm:g} mm"


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"


def draw(folder: Path) -> list[Path]:
    """The arrangements of units, and what is felt."""
    return [rate.draw(folder / "haptics-place.svg", LINK, compared(LINK, RING_M)), *felt_tables.draw(folder)]
