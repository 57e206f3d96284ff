"""The diagrams show what commands and pages say elsewhere."""

import contextlib
import io
import json
import re
from pathlib import Path

import pytest
import svg_texts
from study_pages import section

from contactfpga.design import kits
from contactfpga.tools import cli
from contactfpga_sim.lab.diagrams import cutaway

DOCS = Path(__file__).resolve().parents[2] / "docs"
TIMES = section("kits.md", "times")
KIT = kits.kit("starter")


def words(name):
    return svg_texts.read(DOCS / "images" / f"{name}.svg").words


def middle(one):
    return one.corners.mean(axis=0)


@pytest.mark.parametrize("port", ["contact", "last byte on the wire", "host's USB controller", "decision"])
def test_times_are_those_of_the_page(port):
    """The median is shown, and in parentheses the worst."""
    (row,) = re.findall(rf"^\| starter \| closed switch to the [^|]*{port}[^|]*\|(.*)\|$", TIMES, re.MULTILINE)
    median, _, worst = (round(float(cell)) for cell in row.split("|"))
    assert f"{median} µs ({worst})" in {one.text for one in words("together")}


def test_the_wiring_is_the_table_that_the_command_prints():
    """Beside each pin of the board is the name of its wire, below the name of its connector."""
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        assert cli.main(["build", "--kit", "starter", "--wiring", "--json"]) == 0
    table = {one["wire"]: one["pin"] for one in json.loads(said.getvalue())["wires"] if one["pin"]}
    picture = words("wiring")
    connectors = {one.text: middle(one) for one in picture if one.text.startswith("PMOD")}
    shown = {}
    for one in picture:
        if one.text in table:
            x, y = middle(one)
            above = max((name for name, place in connectors.items() if place[1] < y), key=lambda n: connectors[n][1])
            row = [other for other in picture if abs(middle(other)[1] - y) < 3 and other.text.isdigit()]
            number = min(row, key=lambda other: abs(middle(other)[0] - x))
            shown[one.text] = f"{above} {number.text}"
    assert shown == table


def test_the_wiring_shows_where_the_sheet_has_each_column():
    """Beside the pins of the sheet, in their order, as in the list that ``contactfpga sheet`` writes."""
    texts = [one.text for one in sorted(words("wiring"), key=lambda one: middle(one)[1]) if middle(one)[0] > 375]
    columns = [text for text in texts if re.fullmatch(r"(guard )?column( \d+)?", text)]
    assert columns == [*(f"column {number}" for number in range(KIT.skin.columns)), "guard column"]


def test_the_map_of_a_packet_has_as_many_bytes_as_a_frame():
    numbers = [int(one.text) for one in sorted(words("packet"), key=lambda one: middle(one)[0]) if one.text.isdigit()
               and middle(one)[1] < 85 * 0.75]  # fmt: skip
    (row,) = re.findall(r"^\| kind 5 \|(.*)\|$", (DOCS / "protocol.md").read_text(encoding="utf-8"), re.MULTILINE)
    record = int(row.split("|")[1])
    assert sum(numbers) == 13 + record
    assert numbers[1] == record


def test_the_cutaway_is_to_scale():
    """The bar of 10 mm against the pitch, by the places of their words' middles and the drawn bars."""
    text = (DOCS / "images" / "cutaway.svg").read_text(encoding="utf-8")
    said = {one.text for one in words("cutaway")}
    assert {"pitch 6.4 mm", "cap 5.8 mm", "10 mm", "metal dome of 5 mm,", "foam of 2 mm,"} <= said
    corners = r'd="M ([\d.]+) ([\d.]+) \nL ([\d.]+) [\d.]+ \nL [\d.]+ ([\d.]+) \nL [\d.]+ [\d.]+ \nz\n" clip'
    boxes = [tuple(map(float, found)) for found in re.findall(corners, text)]
    tiles = sorted(box for box in boxes if abs((box[2] - box[0]) / (box[1] - box[3]) + 5.8 / 2) < 0.01)
    assert len(tiles) == cutaway.CELLS
    assert tiles[1][0] - tiles[0][0] == pytest.approx((tiles[0][2] - tiles[0][0]) * 6.4 / 5.8, rel=1e-3)
