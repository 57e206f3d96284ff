"""docs/rivals.md shows rows of its files, and pictures with the zones that it says are right."""

import csv
import re
from pathlib import Path

from zone_oracles import cells_of, zones_by_scipy

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "rivals.md").read_text(encoding="utf-8")
DRAWN = re.findall(r"^[^:\n]*: areas [^;]*; right is (.*)\.\n\n```text\n([.#\n]+)\n```", PAGE, re.MULTILINE)
"""The right areas and the picture of each frame on the page."""


def table(name):
    with (ROOT / "docs" / "tables" / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_the_page_shows_rows_of_its_files():
    for name, first in (("rivals-rivals_exact", 2), ("rivals-rivals", 4)):
        for row in table(name):
            if row["sheet"] == "16x16":
                cells = [row["labeller"], *list(row.values())[first:]]
                assert f"| {' | '.join(cells)} |" in PAGE


def test_the_frames_on_the_page_have_the_zones_that_it_says_are_right():
    assert len(DRAWN) == 4
    for said, text in DRAWN:
        areas = [
            int(area)
            for part in said.split(", ")
            for count, _, area in [part.rpartition(" x ")]
            for _ in range(int(count or 1))
        ]
        assert sorted(areas) == [area for area, _, _ in zones_by_scipy(cells_of(text))]
