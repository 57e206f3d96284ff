"""Tables in pages: only what is between their markers is written."""

import pytest

from contactfpga.tools.console.outputs import OutputError
from contactfpga_sim.lab import writer

PAGE = "a\n<!-- figures: one -->\nold\n<!-- end -->\nb\n<!-- figures: two -->\nkept\n<!-- end -->\n"


def test_only_sections_that_are_known_are_written():
    assert writer.update(PAGE, {"one": lambda: "new"}) == PAGE.replace("old", "new")


def test_a_section_states_what_it_was_made_by():
    made = writer.update(PAGE, {"one": lambda: "new"}, "12ab")
    assert made == PAGE.replace("old", "new").replace("figures: one", "figures: one of 12ab")
    assert writer.update(made, {"one": lambda: "old"}) == made.replace("new", "old")
    assert writer.sections(made) == {"one": ("new", "12ab"), "two": ("kept", "")}


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


def test_a_page_is_looked_for_before_anything_is_measured_for_it(tmp_path):
    with pytest.raises(OutputError, match=r"^--page is '.*none.md'; there is no such page$"):
        writer.page(tmp_path / "none.md", "--page")
    assert not list(tmp_path.iterdir())
    (tmp_path / "page.md").write_text(PAGE)
    assert writer.page(tmp_path / "page.md").read_text() == PAGE


AFTER = "| c |\n|---|\n| 5 |\n\nafter"
LONG = f'    a command\n\n| a | b, µs |\n|---|---|\n| 1, 2 |  |\n| 3 | x y |\n| 4 | "z" |\n\n{AFTER}'


@pytest.mark.parametrize(
    ("columns", "shown", "rows"),
    [
        ((), ["| a | b, µs |", "|---|---|", "| 3 | x y |", '| 4 | "z" |'], "3 rows"),
        (("b, us",), ["| b, µs |", "|---|", "| x y |", '| "z" |'], "3 rows, 2 columns"),
    ],
)
def test_what_a_page_leaves_out_of_a_table_is_in_a_file_beside_it(tmp_path, columns, shown, rows):
    file = tmp_path / "tables" / "page-one.csv"
    table = writer.Table(
        ("a", "b, us"), [("1, 2", ""), ("3", "x y"), ("4", '"z"')], lambda row: row[0] != "1, 2", columns,
        "    a command", AFTER,
    )  # fmt: skip
    text = table.on_page(file)
    assert text.splitlines()[2:8] == [*shown, "", f"All [{rows}](tables/page-one.csv)."]
    assert text.partition("csv).\n")[2] == LONG.partition('"z" |\n')[2]
    assert file.read_text() == 'a,"b, µs"\n"1, 2",\n3,x y\n4,"""z"""\n'
    (tmp_path / "page.md").write_text(f"a\n<!-- figures: one -->\n{text}\n<!-- end -->\nb\n")
    assert writer.whole(tmp_path / "page.md", "one") == LONG == writer.spelled(str(table))


def test_a_table_that_is_shown_whole_has_no_file(tmp_path):
    for chosen in ({}, {"shown": lambda row: True, "columns": ("a", "b")}):
        table = writer.Table(("a", "b"), [("1", "2")], **chosen)
        assert table.on_page(tmp_path / "one.csv") == str(table) == "| a | b |\n|---|---|\n| 1 | 2 |"
    assert not list(tmp_path.iterdir())
