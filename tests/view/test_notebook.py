"""What frames, contacts and recordings look like in a notebook; and the example notebook runs."""

import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
from tracker_frames import frame, pressed

from contactfpga import Skin
from contactfpga.tracking.tracker import Tracker
from contactfpga.wire.protocol import Frame
from contactfpga.zones.zone import Zones

ROOT = Path(__file__).resolve().parents[2]
SVG = "{http://www.w3.org/2000/svg}"


def drawn(svg):
    """Circles as (x, y, radius) in mm and boxes as (x, y, width, height, color)."""
    root = ElementTree.fromstring(svg)
    circles = [tuple(float(one.get(name)) for name in ("cx", "cy", "r")) for one in root.iter(f"{SVG}circle")]
    boxes = [
        (*(float(one.get(name)) for name in ("x", "y", "width", "height")), one.get("fill"))
        for one in root.iter(f"{SVG}rect")
        if one.get("x") is not None
    ]
    return circles, boxes, " ".join(one.text for one in root.iter(f"{SVG}text"))


def test_zones_are_circles_of_their_area():
    circles, boxes, text = drawn(frame(2_000_000, [(3, 4, 9), (10.5, 2, 2)])._repr_svg_())
    rims = circles[::2]
    assert rims == [pytest.approx((105, 20, np.sqrt(200 / np.pi)), abs=2e-3), pytest.approx((30, 40, 16.926), abs=2e-3)]
    assert len(boxes) == 1
    assert "2 zones, 11 cells pressed" in text
    assert "2.000000 s" in text


def test_pressed_cells_are_boxes_where_they_are_known():
    cells = np.zeros((16, 16), bool)
    cells[2, 3:5] = True
    zones = pressed(0, cells, skin=Skin(report="cells", pitch_x_mm=5.0))
    zones.frame.__dict__["bitmap"] = cells
    _, boxes, _ = drawn(zones._repr_svg_())
    assert {box[:4] for box in boxes[1:]} == {(12.5, 15.0, 5.0, 10.0), (17.5, 15.0, 5.0, 10.0)}


@pytest.mark.parametrize("column", [0.25, 11.25, 11.75])
def test_a_zone_over_the_seam_is_drawn_at_both_ends(column):
    skin = Skin(rows=6, columns=12, surface="cylinder", radius_mm=60 / np.pi, closed=True)
    records = np.array([[4, round(4 * column), 8, 0]], np.int64)
    circles, _, _ = drawn(Zones(Frame(0, 0, frozenset(), 0, 0, 1, 4, records, None), skin.sheet)._repr_svg_())
    assert {(round(x, 1), round(y, 1)) for x, y, _ in circles} == {
        (10 * column, 20.0),
        (10 * column - 120 if column > 6 else 10 * column + 120, 20.0),
    }


def test_a_large_sheet_stays_light():
    svg = frame(0, [(30, 30)], skin=Skin(rows=64, columns=64))._repr_svg_()
    assert len(svg) < 4000


def test_text_is_escaped():
    from contactfpga import notebook

    assert "<script>" not in notebook.table(["<script>"], [["<script>"]], "<script>")
    assert "<b>" not in notebook.sheet((2, 2), (1.0, 1.0), "<b>")


def test_tracks_are_a_table_by_their_ids():
    shown = Tracker().update(frame(0, [(3, 4, 9)]))._repr_html_()
    assert re.findall(r"<td>(.*?)</td>", shown)[:4] == ["#1", "30.00", "40.00", "9"]


def test_forces_are_a_table_with_their_intervals():
    from contactfpga.robot import haptics

    touch = haptics.Touch((0.01, 0.02, 0.0), (0.0, 0.0, 1.0))
    wrench = haptics.Wrench((0.0, 0.0, -5.0), (-0.1, 0.05, 0.0))
    shown = haptics.contacts(wrench, [touch])._repr_html_()
    cells = re.findall(r"<td>(.*?)</td>", shown)
    assert cells[:4] == ["0", "10.00", "20.00", "0.00"]
    assert float(cells[4]) == pytest.approx(5.0, abs=1e-3)


def test_pictures_need_no_further_package():
    code = (
        "import sys; import contactfpga; from contactfpga.notebook import sheet; sheet((4, 4), (1, 1), 'a')\n"
        "assert not {'matplotlib', 'viser', 'IPython'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=250)


@pytest.mark.slow
def test_the_example_notebook_runs(tmp_path):
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    pytest.importorskip("mcap")
    notebook = nbformat.read(ROOT / "examples/touches.ipynb", as_version=4)
    nbformat.validate(notebook)
    assert all(not cell.get("outputs") for cell in notebook.cells), "it is kept without outputs"
    client = nbclient.NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(tmp_path)}})
    client.execute()
    shown = {kind for cell in notebook.cells for output in cell.get("outputs", []) for kind in output.get("data", {})}
    assert {"image/svg+xml", "text/html"} <= shown
