"""Other people's labellers on our bench: the sources are those that are stated, and a wrong record is seen."""

import dataclasses
import re
import shutil
from pathlib import Path

import measure_rivals
import numpy as np
import pytest
from rivals import campaign, exactness, linkruncca, placement
from rivals.house import DEVICES, NO_COLLISIONS, all_departures, native
from rivals.rival import Rival, RivalError, Sheet, git

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "rivals.md").read_text(encoding="utf-8")
CLONE = ROOT / measure_rivals.CLONES / "linkruncca"
RIVAL = linkruncca.LINK_RUN_CCA

SILENT = """
module top(input clk, rst, pressed, input [1:0] x, y, output reg found, output [14:0] zone);
  always @(posedge clk) found <= rst & pressed;
  assign zone = 0;
endmodule
"""
"""A labeller that finds nothing."""


@pytest.fixture
def clone(tmp_path):
    """A clone with one source, and the rival that it is one of."""
    if shutil.which("git") is None:
        pytest.skip("git is not installed")
    folder = tmp_path / "clone"
    folder.mkdir()
    (folder / "labeller.v").write_text(SILENT)
    for command in (("init", "--quiet"), ("add", "."), ("commit", "--quiet", "--message", "first")):
        git("-C", str(folder), "-c", "user.name=a", "-c", "user.email=a@b", *command)
    commit = git("-C", str(folder), "rev-parse", "HEAD")
    return folder, dataclasses.replace(RIVAL, commit=commit, sources=("labeller.v",), url=str(folder))


def refused(capfd, *arguments):
    """What the command says in its one line when it ends with status 1."""
    assert measure_rivals.main(arguments) == 1
    out, err = capfd.readouterr()
    assert not out
    assert err.startswith("measure_rivals: ")
    assert err.count("\n") == 1
    return err


# ---- what is measured


@pytest.mark.parametrize("rival", measure_rivals.RIVALS.values(), ids=lambda rival: rival.name)
def test_every_rival_is_stated_exactly(rival):
    assert re.fullmatch(r"[0-9a-f]{40}", rival.commit)
    assert rival.url.startswith("https://")
    assert rival.sources
    assert rival.commit in PAGE


def test_the_clone_at_the_commit_is_taken(clone):
    folder, rival = clone
    rival.check(folder)
    assert len(rival.digest(folder)) == 64


def test_another_commit_is_refused_with_the_way_there(clone):
    folder, rival = clone
    with pytest.raises(RivalError, match=rf"is at commit {rival.commit[:7]}; .* checkout {RIVAL.commit}"):
        dataclasses.replace(rival, commit=RIVAL.commit).check(folder)


def test_a_changed_clone_is_refused(clone):
    folder, rival = clone
    before = rival.digest(folder)
    (folder / "labeller.v").write_text(SILENT + "\n")
    assert rival.digest(folder) != before
    with pytest.raises(RivalError, match=r"local changes \(labeller.v\)"):
        rival.check(folder)


# ---- what is missing


def test_a_folder_that_is_no_clone(capfd, tmp_path):
    assert f"git clone {RIVAL.url} {tmp_path}" in refused(capfd, "--clone", str(tmp_path))


def test_without_ghdl_it_says_how_to_install_it(capfd, clone, monkeypatch):
    folder, rival = clone
    monkeypatch.setitem(measure_rivals.RIVALS, "linkruncca", rival)
    monkeypatch.setattr(linkruncca.shutil, "which", lambda _: None)
    assert "apt install ghdl" in refused(capfd, "--clone", str(folder))


@pytest.mark.parametrize("arguments", [["--sizes", "5"], ["--seeds", "0"], ["--rival", "nobody"]])
def test_what_cannot_be_measured_is_refused(capfd, arguments):
    with pytest.raises(SystemExit):
        measure_rivals.main(arguments)
    assert "choose from" in capfd.readouterr().err


# ---- conversion


def test_latches_are_refused():
    latch = SILENT.replace("assign zone = 0;", "reg q; always @* if (x[0]) q = y[0]; assign zone = q;")
    with pytest.raises(native.CompileFailed, match=r"(?i)latch"):
        exactness.check_rival(latch, Sheet(4, 2, 1), frames(1))


# ---- exactness


def frames(count):
    return np.random.default_rng(1).random((count, 4, 4)) < 0.5


@pytest.mark.slow
def test_a_labeller_that_finds_nothing_is_wrong_in_every_frame_that_has_a_zone(monkeypatch):
    some = frames(50)
    some[7] = False
    assert exactness.check_rival(SILENT, Sheet(4, 2, 1), some).wrong == 49
    rival = dataclasses.replace(RIVAL, convert=lambda *_: SILENT, converter=lambda: "none")
    monkeypatch.setitem(campaign.FRAMES, 4, 0)
    monkeypatch.setattr(campaign, "OURS", ())
    monkeypatch.setattr(Rival, "digest", lambda *_: "")
    (row,) = campaign.measure(rival, ROOT, [4], list(DEVICES), 1).rows
    assert (row.checked.wrong, row.checked.frames, row.sizes) == (65_535, 65_536, {})


def test_every_kind_of_wrong_record_is_seen():
    some = frames(50)
    right = all_departures(some, 8)
    assert exactness.wrong_frames(right.frame, right.moments, some) == 0
    changed = right.moments.copy()
    changed[3, 1] += 1
    assert exactness.wrong_frames(right.frame, changed, some) == 1
    assert exactness.wrong_frames(right.frame[1:], right.moments[1:], some) == 1
    twice = np.r_[0, np.arange(len(right.frame))]
    assert exactness.wrong_frames(right.frame[twice], right.moments[twice], some) == 1
    late = right.frame.copy()
    late[0] += 1
    assert exactness.wrong_frames(late, right.moments, some) == 2


@pytest.mark.slow
@pytest.mark.parametrize("labeller", campaign.OURS)
def test_ours_are_right_on_the_same_frames(labeller):
    checked = exactness.check_ours(labeller, 8, exactness.frames_for(8, 1000))
    assert checked.wrong == 0
    assert checked.after_last_row == checked.after_last_cell > 0


# ---- settings


def test_plain_tells_nothing_and_told_only_what_is_true():
    for device in DEVICES:
        assert placement.before(device, placement.PLAIN, collides=False) == ()
        ours, theirs = (placement.before(device, placement.OURS, collides) for collides in (False, True))
        assert NO_COLLISIONS in ours
        assert theirs == tuple(command for command in ours if command != NO_COLLISIONS)


def test_a_rival_is_placed_between_the_same_registers_as_ours():
    netlists = placement.rival(SILENT, Sheet(4, 2, 1))
    assert netlists.bare.count("module \\top\n") == netlists.registered.count("module \\top\n") == 1
    assert "module \\labeller\n" in netlists.registered
    assert re.search(r"cell \\labeller ", netlists.registered)


# ---- the page


@pytest.mark.campaign
@pytest.mark.skipif(not CLONE.is_dir(), reason="no clone in build/rivals/linkruncca")
@pytest.mark.skipif(shutil.which("ghdl") is None, reason="ghdl is not installed")
def test_link_run_cca_is_exact_and_uses_words_that_are_read_while_written(monkeypatch, capfd):
    monkeypatch.chdir(ROOT)
    assert measure_rivals.main(["--clone", str(CLONE), "--sizes", "8", "--seeds", "1"]) == 0
    out, _ = capfd.readouterr()
    (line,) = re.findall(r"^\| 8x8 \| LinkRunCCA \|.* clocks \|.* clocks \|$", out, re.MULTILINE)
    _, _, _, frames, wrong, scrambled, after_cell, after_row, _ = line.split("|")
    assert int(wrong) == 0
    assert int(scrambled.replace(",", "")) > int(frames.replace(",", "")) // 4
    assert (after_cell.strip(), after_row.strip()) == ("15 clocks", "22 clocks")
    assert "not measured" not in out
