"""The page's tables against a new run of what is quick, and what they have to show."""

from pathlib import Path

from study_pages import outdated, section

PAGE = Path(__file__).resolve().parents[2] / "docs" / "haptics.md"


def rows_of(name):
    return [line.strip("| ").split(" | ") for line in section("haptics.md", name).splitlines()[2:]]


def test_the_page_has_the_arrangements_of_a_new_run():
    assert not outdated("haptics", "layouts")


def test_stated_radii_cover_95_of_100_contacts():
    for _, _, _, _, _, theory, covers in rows_of("places"):
        assert 93 <= float(covers.removesuffix(" %")) <= 97
        assert not theory or float(theory) <= 1.5


def test_wrong_assumptions_are_on_the_page_with_what_they_cost():
    rows = rows_of("wrong")
    assert len(rows) >= 5
    assert all(float(row[5].removesuffix(" %")) < 95 for row in rows)
