"""A fault in the files is seen by the trace, and by KiCad."""

import os
import re
import subprocess
import sys

import pytest

pytest.importorskip("gerbonara", reason="gerbonara is not installed")
pytest.importorskip("cv2", reason="OpenCV is not installed")

import traced_board
from traced_board import TracedBoard, lines_of, written

from contactfpga import Skin
from contactfpga.design.sheet import check

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::SyntaxWarning")

SMALL = Skin(rows=3, columns=4, pitch_x_mm=6.4, pitch_y_mm=6.4)


@pytest.fixture
def folder(tmp_path):
    written(tmp_path, SMALL)
    return tmp_path


def changed(path, old, new):
    text = path.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))


def test_a_missing_via_is_seen(folder):
    found = re.search(r"^317N2_3 .*VIA.*X([+-]\d{6})Y([+-]\d{6})", (folder / "sheet.ipc").read_text(), re.MULTILINE)
    x, y = (int(um) / 1e3 for um in found.groups())
    changed(folder / "sheet-PTH.drl", f"X{x:.6f}Y{y:.6f}\n", "")
    assert TracedBoard(folder).disagreements() == ["N2_3 is in 2 pieces"]


def test_a_bridge_between_two_columns_is_seen(folder):
    path = folder / "sheet-F_Cu.gtl"
    x, y = TracedBoard(folder).switches["SW1"]
    ends = ((x + 1.66, 2), (x + 4.74, 1))
    bridge = "".join(f"X{round(at * 1e6)}Y{round((y + 1.66) * 1e6)}D0{code}*\n" for at, code in ends)
    text = path.read_text()
    code = re.search(r"%ADD(\d+)C,0.200000\*%", text)[1]
    changed(path, f"\nD{code}*\n", f"\nD{code}*\n{bridge}")
    # it also meets row 0, which comes down between them
    assert TracedBoard(folder).disagreements() == ["joined: ['COL0', 'COL1', 'ROW0']"]


def test_a_diode_the_wrong_way_is_seen(folder):
    # KiCad would not mind: the pads of the first diode change their numbers in the electrical test's file
    path = folder / "sheet.ipc"
    lines = path.read_text().split("\n")
    first = [number for number, line in enumerate(lines) if re.search(r" D1 +-[12] ", line)]
    assert len(first) == 2
    for number in first:
        line = lines[number]
        lines[number] = line[:27] + {"1": "2", "2": "1"}[line[27]] + line[28:]
    path.write_text("\n".join(lines))
    with pytest.raises(AssertionError, match="diode at 0, 0 lies the wrong way"):
        lines_of(TracedBoard(folder), SMALL)


@pytest.mark.skipif(not check.there(), reason="KiCad 6 is not installed")
def test_kicad_sees_a_missing_via_and_copper_too_near(folder):
    board = folder / "sheet.kicad_pcb"
    text = board.read_text()
    via = re.search(r"^\(via .*\n", text, re.MULTILINE)[0]
    wide = re.search(r"^\(segment .*\(width 0.2\) \(layer \"F.Cu\"\).*\n", text, re.MULTILINE)[0]
    board.write_text(text.replace(via, "").replace(wide, wide.replace("(width 0.2)", "(width 6)")))
    said = " ".join(check.findings(board))
    assert "unconnected_items" in said
    assert "clearance" in said


@pytest.mark.skipif(not check.there(), reason="KiCad 6 is not installed")
def test_a_file_that_is_no_board_is_refused_in_a_sentence(tmp_path):
    (tmp_path / "sheet.kicad_pcb").write_text("(nothing)")
    with pytest.raises(ValueError, match=r"KiCad cannot read .*sheet\.kicad_pcb"):
        check.findings(tmp_path / "sheet.kicad_pcb")


def test_without_kicad_the_check_names_what_to_install(monkeypatch, folder):
    monkeypatch.setattr(check, "PYTHON", "/nowhere/python3")
    assert not check.there()
    with pytest.raises(Exception, match="apt install --no-install-recommends kicad"):
        check.findings(folder / "sheet.kicad_pcb")


def test_the_same_skin_gives_the_same_bytes(folder, tmp_path):
    other = tmp_path / "again"
    other.mkdir()
    script = (
        "import sys; from pathlib import Path; from contactfpga import Skin; from traced_board import written; "
        "written(Path(sys.argv[1]), Skin(rows=3, columns=4, pitch_x_mm=6.4, pitch_y_mm=6.4))"
    )
    for seed in ("1", "2"):
        env = os.environ | {"PYTHONHASHSEED": seed, "PYTHONPATH": os.path.dirname(traced_board.__file__)}
        subprocess.run([sys.executable, "-c", script, str(other)], check=True, env=env, timeout=250)
        for path in other.iterdir():
            assert path.read_bytes() == (folder / path.name).read_bytes(), path.name
