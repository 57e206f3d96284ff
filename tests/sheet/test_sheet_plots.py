"""The Gerbers are those that KiCad plots of the board that goes with them, and the netlists say the same."""

import re
import subprocess

import cv2
import numpy as np
import pytest

pytest.importorskip("gerbonara", reason="gerbonara is not installed")

from gerbonara import ExcellonFile, GerberFile
from gerbonara.utils import MM
from traced_board import PIXEL_MM, TracedBoard, drawn_layer, written

from contactfpga import Skin
from contactfpga.design.sheet import check

pytestmark = pytest.mark.filterwarnings("ignore")

SKINS = {
    "registers": (Skin(rows=5, columns=6, row_drive="74hc595", column_read="74hc165", guard=True), "tact"),
    "pins": (Skin(rows=3, columns=4, pitch_x_mm=6.4, pitch_y_mm=6.4, guard=True), "dome"),
}
PLOT = """
import sys
import pcbnew
board = pcbnew.LoadBoard(sys.argv[1])
plots = pcbnew.PLOT_CONTROLLER(board)
options = plots.GetPlotOptions()
options.SetOutputDirectory(sys.argv[2])
options.SetUseGerberX2format(True)
options.SetDrillMarksType(pcbnew.PCB_PLOT_PARAMS.NO_DRILL_SHAPE)
layers = dict(top_copper=pcbnew.F_Cu, bottom_copper=pcbnew.B_Cu, top_mask=pcbnew.F_Mask, bottom_mask=pcbnew.B_Mask,
              top_paste=pcbnew.F_Paste, bottom_paste=pcbnew.B_Paste, top_print=pcbnew.F_SilkS,
              bottom_print=pcbnew.B_SilkS, edge=pcbnew.Edge_Cuts)
for name, layer in layers.items():
    plots.SetLayer(layer)
    plots.OpenPlotfile(name, pcbnew.PLOT_FORMAT_GERBER, name)
    plots.PlotLayer()
plots.ClosePlot()
drill = pcbnew.EXCELLON_WRITER(board)
drill.SetFormat(True)
drill.CreateDrillandMapFilesSet(sys.argv[2], True, False)
"""
LAYERS = {
    f"{name}_{kind}": f"{layer}_{file}"
    for name, layer, side in (("top", "F", "t"), ("bottom", "B", "b"))
    for kind, file in (
        ("copper", f"Cu.g{side}l"),
        ("mask", f"Mask.g{side}s"),
        ("paste", f"Paste.g{side}p"),
        ("print", f"Silkscreen.g{side}o"),
    )
}


@pytest.fixture(scope="module", params=sorted(SKINS))
def folder(request, tmp_path_factory):
    place = tmp_path_factory.mktemp("plots")
    skin, part = SKINS[request.param]
    written(place, skin, part)
    return place


@pytest.fixture(scope="module")
def plotted(folder):
    if not check.there():
        pytest.skip("KiCad 6 is not installed")
    out = folder / "kicad"
    out.mkdir()
    subprocess.run([check.PYTHON, "-c", PLOT, str(folder / "sheet.kicad_pcb"), f"{out}/"], check=True, timeout=250)
    return out


def one(folder, pattern):
    (found,) = folder.glob(pattern)
    return found


@pytest.mark.parametrize("name", LAYERS)
def test_each_layer_is_the_one_that_kicad_plots(folder, plotted, name):
    edges = [GerberFile.open(path) for path in (folder / "sheet-Edge_Cuts.gm1", one(plotted, "*edge.gbr"))]
    (low, high), (other, _) = (edge.bounding_box(MM) for edge in edges)
    # KiCad's page begins elsewhere
    moved = np.subtract(other, low)
    theirs = drawn_layer(one(plotted, f"*{name}.gbr"), np.add(low, moved), np.add(high, moved)).pixels
    if not theirs.any():  # nothing to paste on the top: no stencil
        assert name == "top_paste"
        assert not (folder / f"sheet-{LAYERS[name]}").exists()
        return
    ours = drawn_layer(folder / f"sheet-{LAYERS[name]}", low, high).pixels
    differs = cv2.morphologyEx(ours ^ theirs, cv2.MORPH_OPEN, np.ones((2, 2), np.uint8))
    assert not differs.any(), f"{np.argwhere(differs)[:3] * PIXEL_MM} mm"


@pytest.mark.parametrize("name", ["PTH", "NPTH"])
def test_the_holes_are_those_that_kicad_drills(folder, plotted, name):
    found = []
    for path in (folder / f"sheet-{name}.drl", one(plotted, f"*-{name}.drl")):
        holes = [(MM(h.x, h.unit), MM(h.y, h.unit), round(h.tool.diameter, 3)) for h in ExcellonFile.open(path).objects]
        corner = np.min(np.array(holes), axis=0)
        found.append(sorted((round(x - corner[0], 2), round(y - corner[1], 2), size) for x, y, size in holes))
    for a, b in zip(*found, strict=True):
        assert a == pytest.approx(b, abs=0.011)


def test_both_netlists_say_the_same(folder):
    text = (folder / "sheet.net").read_text()
    nodes = set()
    for name, body in re.findall(r'\(net \(code "\d+"\) \(name "([^"]+)"\)(.*?)(?=\(net |\Z)', text, re.DOTALL):
        nodes |= {(ref, pin, name) for ref, pin in re.findall(r'\(ref "(\w+)"\) \(pin "(\w+)"\)', body)}
    board = TracedBoard(folder)
    said = {(ref, pin): board.said[places[0]] for (ref, pin), places in board.pads.items()}
    assert {(ref, pin, name) for (ref, pin), names in said.items() for name in names if name} == nodes


def test_parts_on_the_back_are_mirrored(folder):
    """Seen from above, through the board, the pins of a chip on the back go round clockwise."""
    board = TracedBoard(folder)
    for chip in board.parts("U"):
        x, y = np.array([board.places[chip, str(pin)] for pin in range(1, 17)]).T
        assert np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) < 0
