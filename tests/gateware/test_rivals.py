"""Labellers of others on our bench: every wrong record is seen, and docs/rivals.md says of ours what is so today."""

import csv
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
import rivals
from study_pages import cells, section
from zone_oracles import cells_of, zones_by_scipy

from contactfpga_hdl.board.sizes import DEVICES
from contactfpga_hdl.board.synthesis import NO_COLLISIONS
from contactfpga_sim.model.golden import all_departures

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "rivals.md").read_text(encoding="utf-8")
DRAWN = re.findall(r"^[^:\n]*: areas [^;]*; right is (.*)\.\n\n```text\n([.#\n]+)\n```", PAGE, re.MULTILINE)
"""The right areas and the picture of each frame on the page."""
SILENT = """
module top(input clk, rst, pressed, input [2:0] x, y, output reg found, output [22:0] zone);
  always @(posedge clk) found <= rst & pressed;
  assign zone = 0;
endmodule
"""
"""A labeller that finds nothing."""


def table(name):
    with (ROOT / "docs" / "tables" / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture
def silent(tmp_path):
    (tmp_path / "silent.v").write_text(SILENT)
    return tmp_path / "silent.v"


# ---- the command


@pytest.mark.slow
def test_a_labeller_that_finds_nothing_is_wrong_in_every_frame_that_has_a_zone(silent, monkeypatch, capsys):
    monkeypatch.setitem(rivals.FRAMES, 8, 20)
    frames = rivals.frames_for(8, 20)
    assert rivals.main(["--verilog", str(silent), "--sizes", "8", "--devices"]) == 0
    rows = [line.split(" | ")[1:5] for line in capsys.readouterr().out.splitlines()[2:]]
    assert rows[0] == ["silent.v", str(len(frames)), str(frames.any((1, 2)).sum()), "not tried"]
    assert rows[1:] == [[f"`{name}`", str(len(frames)), "0", "uses none"] for name in rivals.OURS]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--verilog", "no.v", "--sizes", "4"], "No such file or directory: 'no.v'"),
        (["--verilog", "no.v"], "no.v is for one size; say which with --sizes N"),
        (["--clone", "nowhere"], f"git clone {rivals.URL} FOLDER"),
        (["--clone", "."], f"git -C . checkout -f {rivals.COMMIT}"),
    ],
)
def test_what_cannot_be_measured_is_refused(arguments, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for name in rivals.SOURCES:
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).write_text("-- of another commit")
    assert rivals.main(arguments) == 1
    out, err = capsys.readouterr()
    assert not out
    assert re.fullmatch(rf"rivals: .*{re.escape(said)}.*\n$", err)


def test_the_sources_are_those_that_the_page_states():
    stated = (ROOT / "docs" / "tables" / "rivals-rivals_made_of.csv").read_text(encoding="utf-8")
    assert f"<{rivals.URL}> at `{rivals.COMMIT}`" in stated
    assert f"`{rivals.SHA256}`" in stated


def test_the_page_shows_rows_of_its_files():
    for name, first in (("rivals-rivals_exact", 2), ("rivals-rivals", 4)):
        for row in table(name):
            if row["sheet"] == "16x16":
                cells = [row["labeller"], *list(row.values())[first:]]
                assert f"| {' | '.join(cells)} |" in PAGE


# ---- exactness


def test_latches_are_refused():
    latch = SILENT.replace("assign zone = 0;", "reg q; always @* if (x[0]) q = y[0]; assign zone = q;")
    with pytest.raises(rivals.native.CompileFailed, match=r"(?i)latch"):
        rivals.check_rival(latch, rivals.Sheet(8), np.zeros((1, 8, 8), bool))


def test_every_kind_of_wrong_record_is_seen():
    some = np.random.default_rng(1).random((50, 4, 4)) < 0.5
    right = all_departures(some, 8)
    assert rivals.wrong_frames(right.frame, right.moments, some) == 0
    changed = right.moments.copy()
    changed[3, 1] += 1
    assert rivals.wrong_frames(right.frame, changed, some) == 1
    assert rivals.wrong_frames(right.frame[1:], right.moments[1:], some) == 1
    twice = np.r_[0, np.arange(len(right.frame))]
    assert rivals.wrong_frames(right.frame[twice], right.moments[twice], some) == 1
    late = right.frame.copy()
    late[0] += 1
    assert rivals.wrong_frames(late, right.moments, some) == 2


@pytest.mark.slow
@pytest.mark.parametrize("labeller", rivals.OURS)
def test_ours_are_as_exact_and_as_late_as_the_page_says(labeller):
    (row,) = (
        row for row in table("rivals-rivals_exact") if (row["sheet"], row["labeller"]) == ("16x16", f"`{labeller}`")
    )
    found = rivals.check_ours(labeller, 16, rivals.frames_for(16, 200))
    assert f"{found.wrong} {row['wrong']}" == "0 0"
    late = [f"{clocks} clocks" for clocks in (found.after_last_cell, found.after_last_row)]
    assert late == [row["last record after the last cell"], row["after the last row"]]


def test_the_frames_on_the_page_have_the_zones_that_it_says_are_right():
    assert len(DRAWN) == 4
    for said, text in DRAWN:
        areas = [
            int(area)
            for part in said.split(", ")
            for count, _, area in [part.rpartition(" x ")]
            for _ in range(int(count or 1))
        ]
        assert sorted(areas) == [area for area, _, _ in zones_by_scipy(cells_of(text))]


@pytest.mark.slow
@pytest.mark.parametrize("labeller", rivals.OURS)
def test_ours_are_right_on_the_frames_of_the_page(labeller):
    frames = np.zeros((len(DRAWN), 32, 32), bool)
    for whole, (_, text) in zip(frames, DRAWN, strict=True):
        cells = cells_of(text)
        whole[: cells.shape[0], : cells.shape[1]] = cells
    assert rivals.check_ours(labeller, 32, frames).wrong == 0


# ---- size


def test_ours_are_as_large_as_the_page_on_performance_says():
    head, _, *rows = cells(section("performance.md", "gateware"))
    sizes = {(design, device): dict(zip(head[2:], rest)) for design, device, *rest in rows}
    for row in table("rivals-rivals"):
        if row["labeller"] != rivals.NAME:
            for device in DEVICES:
                theirs = sizes[f"labeller {row['labeller']}", device.title][row["sheet"]]
                assert row[f"{device.title}, {rivals.BUILDS}"] == theirs


def test_plain_tells_yosys_nothing_and_our_builds_only_what_is_true():
    for device in DEVICES:
        assert rivals.before(device, rivals.PLAIN, collides=False) == ()
        ours, theirs = (rivals.before(device, rivals.BUILDS, collides) for collides in (False, True))
        assert NO_COLLISIONS in ours
        assert theirs == tuple(command for command in ours if command != NO_COLLISIONS)


def test_a_rival_is_placed_between_the_same_registers_as_ours():
    netlists = rivals.netlists_of(SILENT, rivals.Sheet(8))
    assert netlists.bare.count("module \\top\n") == netlists.registered.count("module \\top\n") == 1
    assert "module \\labeller\n" in netlists.registered
    assert re.search(r"cell \\labeller ", netlists.registered)


@pytest.mark.campaign
@pytest.mark.skipif(not (ROOT / rivals.CLONE).is_dir(), reason="no clone in build/rivals/linkruncca")
@pytest.mark.skipif(shutil.which("ghdl") is None, reason="ghdl is not installed")
def test_link_run_cca_is_exact_and_uses_words_that_are_read_while_written(monkeypatch, capfd):
    monkeypatch.chdir(ROOT)
    assert rivals.main(["--sizes", "8", "--seeds", "1"]) == 0
    exact, sizes = capfd.readouterr().out.split("\n\n")
    (line,) = (line for line in exact.splitlines() if "LinkRunCCA" in line)
    frames, wrong, scrambled, *late = line.strip("| ").split(" | ")[2:]
    assert wrong == "0"
    assert int(scrambled.replace(",", "")) > int(frames.replace(",", "")) // 4
    assert late == ["15 clocks", "22 clocks"]
    assert "LinkRunCCA" in sizes
