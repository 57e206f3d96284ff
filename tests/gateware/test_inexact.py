"""Labellers of others that are not exact: each fault on the page is there, and none of ours has it."""

import re
from pathlib import Path

import measure_inexact
import measure_rivals
import numpy as np
import pytest
from rivals import campaign, exactness
from rivals.inexact import INEXACT
from zone_oracles import cells_of, zones_by_scipy

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "rivals.md").read_text(encoding="utf-8")
EXAMPLE = ROOT / "scripts/rivals/lone_cells.py"
MODELS = {one.name: one.model for one in INEXACT}


def drawn(name):
    """(R, C) bool: the frame that the page draws for a labeller."""
    (text,) = re.findall(rf"^{re.escape(name)}: areas .*\n\n```text\n([.#\n]+)\n```", PAGE, re.MULTILINE)
    return cells_of(text)


@pytest.mark.parametrize("name", MODELS)
def test_the_frame_on_the_page_is_wrong_in_the_model_and_right_in_ours(name):
    cells = drawn(name)
    right = zones_by_scipy(cells)
    assert sorted(MODELS[name](cells)) != right
    assert measure_inexact.exact(cells[None]) == [right]


@pytest.mark.parametrize(("name", "smaller"), [("detectinator", 6), ("ObNoDog", 7)])
def test_no_smaller_frame_is_wrong(name, smaller):
    """Of sheets with fewer cells, and of the sheets with as many that come before it."""
    shape = drawn(name).shape
    for rows, columns in measure_inexact.sheets(smaller, smaller):
        if (rows * columns, rows) < (shape[0] * shape[1], shape[0]):
            places = np.arange(rows * columns)
            for number in range(1 << len(places)):
                cells = (number >> places & 1).astype(bool).reshape(rows, columns)
                assert sorted(MODELS[name](cells)) == zones_by_scipy(cells)


def test_the_search_finds_the_frame_of_the_page():
    found = measure_inexact.fault(INEXACT[0])
    assert np.array_equal(found.cells, drawn("detectinator"))
    assert found.right == zones_by_scipy(found.cells)


@pytest.mark.slow
@pytest.mark.parametrize("labeller", campaign.OURS)
def test_our_gateware_is_right_on_every_fault(labeller):
    frames = np.zeros((len(MODELS), 32, 32), bool)
    for whole, cells in zip(frames, map(drawn, MODELS), strict=True):
        whole[: cells.shape[0], : cells.shape[1]] = cells
    assert exactness.check_ours(labeller, 32, frames).wrong == 0


# ---- a rival of your own


def test_a_rival_is_entered_in_twenty_lines():
    assert len(EXAMPLE.read_text().splitlines()) <= 20
    assert measure_rivals.entered(EXAMPLE).name in PAGE


@pytest.mark.slow
def test_the_example_gets_a_row_beside_ours(monkeypatch, capsys):
    monkeypatch.setitem(campaign.FRAMES, 8, 20)
    monkeypatch.setattr(measure_rivals, "TABLES", (measure_rivals.exactness_table,))
    assert measure_rivals.main(["--enter", str(EXAMPLE), "--sizes", "8", "--devices"]) == 0
    rows = [line.split(" | ") for line in capsys.readouterr().out.splitlines() if line.startswith("| 8x8")]
    assert [row[1] for row in rows] == ["lone cells", "`run`", "`serial`"]
    assert int(rows[0][3]) > 0
    assert [row[3] for row in rows[1:]] == ["0", "0"]


def test_a_file_without_a_rival_is_refused(capfd, tmp_path):
    for text, said in ((None, "no such file"), ("", "has no RIVAL")):
        if text is not None:
            (tmp_path / "mine.py").write_text(text)
        assert measure_rivals.main(["--enter", str(tmp_path / "mine.py")]) == 1
        assert said in capfd.readouterr().err
