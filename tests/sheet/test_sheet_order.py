"""What board houses and assemblers are sent is within their rules, read from the files by another library."""

import csv
import math
import re

import cv2
import numpy as np
import pytest

pytest.importorskip("gerbonara", reason="gerbonara is not installed")

from gerbonara import ExcellonFile, GerberFile
from gerbonara.utils import MM
from random_sheet import drawn, refused
from sample import sample
from traced_board import PIXEL_MM, TracedBoard, drawn_layer, written

from contactfpga import Skin
from contactfpga.design.circuit import Circuit
from contactfpga.design.sheet import houses, orders

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::SyntaxWarning")

TURNED = {"U": (90, 7 * 1.27), "J": (90, None), "D": (0, 2.2), "R": (0, 1.6), "C": (0, 1.6), "SW": (0, None)}


def widths(path):
    """Widths of the lines that a Gerber file draws, in mm."""
    found = GerberFile.open(path).objects
    return [MM(thing.aperture.diameter, thing.aperture.unit) for thing in found if type(thing).__name__ == "Line"]


def least_sizes(folder):
    tracks = [width for name in ("F_Cu.gtl", "B_Cu.gbl") for width in widths(folder / f"sheet-{name}")]
    prints = [width for name in ("F_Silkscreen.gto", "B_Silkscreen.gbo") for width in widths(folder / f"sheet-{name}")]
    return min(tracks), min(prints)


def check_print_and_holes(folder):
    """Print keeps away from all openings of the mask, and no hole of a via lies in one."""
    (a, b), (c, d) = GerberFile.open(folder / "sheet-Edge_Cuts.gm1").bounding_box(MM)
    vias = [hole for hole in ExcellonFile.open(folder / "sheet-PTH.drl").objects if hole.tool.diameter < 0.5]
    away = 2 * round(max(house.bare_mm for house in houses.HOUSES) / PIXEL_MM) - 1  # a pixel for rounding
    for layer, end in ("F", "t"), ("B", "b"):
        openings = drawn_layer(folder / f"sheet-{layer}_Mask.g{end}s", (a, b), (c, d))
        ink = drawn_layer(folder / f"sheet-{layer}_Silkscreen.g{end}o", (a, b), (c, d))
        grown = cv2.dilate(openings.pixels, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (away, away)))
        met = np.argwhere(grown & ink.pixels)
        assert not len(met), f"print on {layer} near a pad at {met[0][::-1] * PIXEL_MM} mm"
        labels = openings.labels()
        assert not [hole for hole in vias if openings.at(labels, MM(hole.x, hole.unit), MM(hole.y, hole.unit))]


def check_placement(board):
    """Each soldered part is in both lists, its place is the middle of its pads, and its rotation takes the pads of
    KiCad's library, pin 1 at the upper left, onto them."""
    placed = {row["Designator"]: row for row in board.rows("cpl")}
    assert set(placed) == set(board.values)
    for name, row in placed.items():
        assert (float(row["Mid X"]), float(row["Mid Y"])) == pytest.approx(board.middle(name), abs=2e-3), name
        letter = name.rstrip("0123456789")
        last = {"U": "8", "J": "3", "SW": "2"}.get(letter, "2")
        (x1, y1), (x2, y2) = board.places[name, "1"], board.places[name, last]
        library = math.radians({"U": -90, "J": -90}.get(letter, 0))  # down, or to the right, y up
        mirrored = -library if row["Layer"] == "Bottom" else library
        wanted = mirrored + math.radians(float(row["Rotation"]))
        if letter != "SW":
            assert math.cos(math.atan2(y2 - y1, x2 - x1) - wanted) == pytest.approx(1, abs=1e-6), name


@pytest.mark.parametrize("seed", sample(range(20), quick=[0, 4], slow=[1, 2]))
def test_files_are_within_the_rules_of_two_houses(tmp_path, seed):
    skin, part = drawn(seed)
    if refused(skin, part):
        return
    written(tmp_path, skin, part)
    track, ink = least_sizes(tmp_path)
    drill = min(hole.tool.diameter for hole in ExcellonFile.open(tmp_path / "sheet-PTH.drl").objects)
    for house in houses.HOUSES:
        assert min(0.2, track) >= house.track_mm
        assert ink >= house.print_mm - 1e-9
        assert drill >= house.drill_mm
    check_print_and_holes(tmp_path)
    check_placement(TracedBoard(tmp_path))
    assert all(GerberFile.open(path).objects for path in tmp_path.glob("sheet-*.g*"))


def test_a_list_of_parts_has_numbers_that_a_maker_has_and_no_row_is_too_long():
    from contactfpga.design.sheet import lay_out

    odd = Circuit(series_ohm=41.0, column_pull_ohm=47_000.0)
    layout = lay_out(Skin(rows=16, columns=16, row_drive="74hc595", column_read="74hc165"), odd)
    rows = list(csv.DictReader(orders.parts_list(layout).splitlines()))
    numbers = {row["Comment"]: row["Manufacturer Part Number"] for row in rows}
    assert numbers["47000"] == "RC0603FR-0747KL"
    assert numbers["10000"] == "RC0603FR-0710KL"
    assert numbers["41"] == ""  # no such resistor in the series
    assert (numbers["BAT54WS"], numbers["74HC165"]) == ("BAT54WS-E3-08", "SN74HC165DR")
    assert not any("DOME" in row["Comment"] for row in rows)
    assert max(int(row["Quantity"]) for row in rows) <= 200
    assert all(len(row["Designator"].split(",")) == int(row["Quantity"]) for row in rows)


@pytest.mark.parametrize(
    ("size", "said"),
    [
        ((399, 499), None),
        ((501, 300), r"501 x 300 mm is larger than listed by JLCPCB \(500 x 400 mm\): order it from PCBWay"),
        ((654, 724.2), r"JLCPCB \(500 x 400 mm\) and PCBWay \(1100 x 500 mm\): ask a house for an offer"),
    ],
)
def test_a_board_that_a_house_does_not_list_is_named_with_the_limit(size, said):
    sentence = houses.too_large(*size)
    assert re.search(said, sentence) if said else sentence == ""
