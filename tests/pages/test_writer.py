"""Tables in pages: only what is between their markers is written."""

from contactfpga_sim.pages import writer

PAGE = "a\n<!-- figures: one -->\nold\n<!-- end -->\nb\n<!-- figures: two -->\nkept\n<!-- end -->\n"


def test_only_sections_that_are_known_are_written():
    assert writer.update(PAGE, {"one": lambda: "new"}) == PAGE.replace("old", "new")


def test_what_a_page_does_not_show_is_not_measured(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(PAGE)
    writer.write(page, {"one": lambda: "new", "three": lambda: 1 / 0})
    assert page.read_text() == PAGE.replace("old", "new")


def test_a_table_is_there_as_soon_as_it_is_measured(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(PAGE)
    before = []
    writer.write(page, {"one": lambda: "new", "two": lambda: before.append(page.read_text()) or "newer"})
    assert before == [PAGE.replace("old", "new")]


def test_a_table_from_cells():
    assert writer.table_of([("a", "b"), ("1", ""), ("2", "x y")]) == "| a | b |\n|---|---|\n| 1 |  |\n| 2 | x y |"
