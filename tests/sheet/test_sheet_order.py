"""What board houses and assemblers are sent is within their rules, read from the files by another library."""

import collections
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
from contactfpga.design.sheet import houses, lay_out, orders

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::SyntaxWarning")


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
        # from pin 1 to this one the library goes right (0 degrees), or down
        other, library = {"U": ("8", -90), "J": ("3", -90)}.get(name.rstrip("0123456789"), ("2", 0))
        (x1, y1), (x2, y2) = board.places[name, "1"], board.places[name, other]
        wanted = math.radians((-library if row["Layer"] == "Bottom" else library) + float(row["Rotation"]))
        if not name.startswith("SW"):
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


def test_the_list_of_parts_counts_what_is_soldered_and_has_numbers_that_makers_have():
    odd = Circuit(series_ohm=41.0, column_pull_ohm=47_000.0)
    skin = Skin(rows=12, columns=20, row_drive="74hc595", column_read="74hc165", guard=True)
    rows = list(csv.DictReader(orders.parts_list(lay_out(skin, odd)).splitlines()))
    assert all(len(row["Designator"].split(",")) == int(row["Quantity"]) <= 200 for row in rows)
    found = collections.Counter()
    for row in rows:
        found[row["Comment"], row["Manufacturer Part Number"]] += int(row["Quantity"])
    assert found["BAT54WS", "BAT54WS-E3-08"] == 12 * 20 + 12 + 20
    assert found["74HC595", "SN74HC595DR"] == math.ceil(13 / 8)
    assert found["74HC165", "SN74HC165DR"] == math.ceil(21 / 8)
    assert found["41", ""] == 13 + 21  # the maker has no such resistor
    assert found["47000", "RC0603FR-0747KL"] == 21
    assert found["10000", "RC0603FR-0710KL"] == 1
    assert not any("DOME" in value for value, _ in found)


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
