"""The page's tables against a new run of what is quick, and what they have to show."""

import re
from pathlib import Path

from contactfpga_sim.lab import writer
from contactfpga_sim.lab.haptics import tables

PAGE = Path(__file__).resolve().parents[2] / "docs" / "haptics.md"


def section(name):
    text = PAGE.read_text(encoding="utf-8")
    lines = re.search(rf"<!-- figures: {name} -->\n(.*?)\n<!-- end -->", text, re.DOTALL)[1].splitlines()
    return [line.strip("| ").split(" | ") for line in lines[2:]]


def test_the_page_has_the_arrangements_of_a_new_run():
    text = PAGE.read_text(encoding="utf-8")
    assert writer.update(text, {"layouts": tables.layouts_table}) == text


def test_stated_radii_cover_95_of_100_contacts():
    for _, _, _, _, _, theory, covers in section("places"):
        assert 93 <= float(covers.removesuffix(" %")) <= 97
        assert not theory or float(theory) <= 1.5


def test_wrong_assumptions_are_on_the_page_with_what_they_cost():
    rows = section("wrong")
    assert len(rows) >= 5
    assert all(float(row[5].removesuffix(" %")) < 95 for row in rows)
