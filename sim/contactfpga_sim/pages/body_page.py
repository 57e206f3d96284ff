"""The tables and pictures of docs/body.md.

python -m contactfpga_sim.pages.body_page docs/body.md docs/images
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from contactfpga.console import interrupt, outputs
from contactfpga_sim.pages import writer
from contactfpga_sim.studies.body import folding, outages, registering

POINTS = (3, 4, 6, 10)
SWEEPS = (1, 2, 5, 10)


def outages_table() -> str:
    """What becomes of a link."""
    rows = [("fault", "states of the link", "told after, s", "ok again after, s")]
    with tempfile.TemporaryDirectory() as folder:
        for outage in outages.OUTAGES:
            seen = outages.play(outage, Path(folder))
            states = ", ".join(f"`{one}`" for one in seen.statuses)
            rows.append((outage.name, states, f"{seen.noticed_s:.3f}", f"{seen.back_s:.3f}"))
    return writer.table_of(rows)


def registration_table() -> str:
    """How well a sheet is found."""
    head = ("sheet", "points", "refused, %", "wrongly mirrored, %", "middle off by, mm", "turned by, degrees")
    rows: list[tuple[str, ...]] = [(*head, "residual, mm")]
    with tempfile.TemporaryDirectory() as folder:
        for name, skin in registering.SKINS.items():
            flat = skin.radius_mm is None
            for points in POINTS:
                found = registering.study(skin, points, Path(folder), normals=flat)
                first = f"{name}{', with normals' if flat else ''}" if points == POINTS[0] else ""
                shares = (f"{100 * found.refused:.0f}", f"{100 * found.wrong:.0f}")
                errors = (f"{found.middle_mm:.2f}", f"{found.turned_deg:.2f}", f"{found.residual_mm:.2f}")
                rows.append((first, str(points), *shares, *errors))
    return writer.table_of(rows)


def folds_table() -> str:
    """How many zones are marked."""
    head = ("times over the range", "folds, %", "touches apart from the fold, %", "touches joined with it, %")
    rows: list[tuple[str, ...]] = [(*head, "touches within it, %", "touches, joint straight, %")]
    for sweeps in SWEEPS:
        found = folding.rates(sweeps)
        values = (found.folds, found.apart, found.joined, found.within, found.straight)
        rows.append((str(sweeps), *(f"{100 * value:.1f}" for value in values)))
    return writer.table_of(rows)


TABLES: writer.Tables = {"outages": outages_table, "registration": registration_table, "folds": folds_table}


def main() -> int:
    """Write the tables into the page named on the command line."""
    parser = argparse.ArgumentParser(description="Write the tables and pictures of the page on bodies.")
    parser.add_argument("page", type=Path)
    parser.add_argument("folder", type=Path)
    args = parser.parse_args()
    page = writer.page(args.page)
    outputs.folder(args.folder, "folder")
    writer.write(page, TABLES)
    print(f"wrote {page}")
    return 0


if __name__ == "__main__":
    sys.exit(interrupt.guarded(main))
