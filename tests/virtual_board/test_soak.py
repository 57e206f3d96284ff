"""The soak's own run, for a few seconds, and that it sees what it looks for."""

import pytest
from slow_skin import SLOW

from contactfpga.driver.board import Board
from contactfpga_sim.lab.reader import soak


@pytest.mark.campaign  # it has a board to compile, and then takes its time
def test_some_seconds_of_it(capsys):
    assert soak.main(["--seconds", "6"]) == 0
    *_, last = capsys.readouterr().out.splitlines()
    frames = int(last.split()[0].replace(",", ""))
    assert frames > 100
    assert last.endswith(" 0 faults")


@pytest.mark.slow  # a board is compiled for it
def test_frames_that_come_twice_are_seen(capsys, monkeypatch):
    first = []

    def same(self, timeout=1.0):
        first.append(first[0] if first else self._frames.next(timeout))
        return first[0]

    monkeypatch.setattr(Board, "read", same)
    monkeypatch.setattr(soak, "SKIN", SLOW)
    assert soak.main(["--seconds", "20"]) == 1  # ends with the period of 1 s in which it is seen
    assert "asked for a new frame" in capsys.readouterr().err


@pytest.mark.slow  # a board is compiled for it
def test_a_soak_without_a_frame_has_failed(capsys, monkeypatch):
    monkeypatch.setattr(soak, "SKIN", SLOW)
    assert soak.main(["--seconds", "0.000001"]) == 1
    assert "no frame came" in capsys.readouterr().err


@pytest.mark.campaign
@pytest.mark.timeout(2 * 3600)
def test_an_hour_of_it():
    assert soak.main([]) == 0
