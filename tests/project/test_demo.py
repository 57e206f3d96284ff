"""`make sim`: what it runs, and that it says so when gateware and model differ."""

import sys

import numpy as np
import pytest

from contactfpga_sim import demo


def assert_all_said(out, runs, picture):
    for name, engines in runs.items():
        assert name in out
        assert all(engine in out for engine in engines)
    assert "agree with the golden model in every clock" in out
    said = " ".join(out.split())
    assert all(line in said for line in demo.LEGEND)
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_two_engines_and_two_scenes(monkeypatch, capsys, tmp_path):
    picture = tmp_path / "scenes.png"
    monkeypatch.setattr(demo, "RUNS", {"fingertip": ("compiled", "Amaranth"), "palm": ("compiled",)})
    monkeypatch.setattr(sys, "argv", ["demo", "--picture", str(picture)])
    assert demo.main() == 0
    assert_all_said(capsys.readouterr().out, demo.RUNS, picture)


def test_without_its_tools_the_scenes_through_cocotb_are_left_out_and_that_is_said(monkeypatch, capsys, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    engine = next(name for name in demo.ENGINES if name.startswith("cocotb"))
    assert not demo._available(engine)
    assert "left out: it needs Verilator, perl, make and c++" in capsys.readouterr().out


def test_a_difference_is_reported(monkeypatch, capsys, tmp_path):
    def wrong(skin, timeline, cycles):
        pieces = [(cycle, np.roll(cells, 1, axis=1), stuck) for cycle, cells, stuck in timeline.pieces]
        return right(skin, type(timeline)(pieces), cycles)

    right = demo.ENGINES["compiled"]
    monkeypatch.setitem(demo.ENGINES, "compiled", wrong)
    monkeypatch.setattr(demo, "RUNS", {"fingertip": ("compiled",)})
    monkeypatch.setattr(sys, "argv", ["demo", "--picture", str(tmp_path / "scenes.png")])
    assert demo.main() == 1
    reported = " ".join(capsys.readouterr().out.split())
    assert "1 of 1 runs differ" in reported
    assert "expected row" in reported
