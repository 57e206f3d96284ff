"""Real builds, with the extra `boards` (102 MB of place and route that `make test` does not install)."""

import importlib.util
from pathlib import Path

import pytest

from contactfpga import cli
from contactfpga.skin import Skin
from contactfpga_hdl import build
from contactfpga_hdl.boards import BOARDS

INSTALLED = all(importlib.util.find_spec(f"yowasp_nextpnr_{family}") for family in ("ice40", "ecp5"))
pytestmark = [
    pytest.mark.campaign,
    pytest.mark.skipif(not INSTALLED, reason="place and route is not installed; run: make bitstreams"),
]


@pytest.mark.parametrize("name", BOARDS)
def test_the_default_sheet_fits_and_meets_its_timing(name, tmp_path, capsys):
    assert cli.main(["build", name, "--output", str(tmp_path)]) == 0
    board = BOARDS[name]
    report = build.read_report(board, tmp_path)
    assert report.needed_mhz == pytest.approx(board.clock_hz / 1e6, rel=0.01)
    assert report.fmax_mhz > 1.5 * report.needed_mhz
    assert report.bitstream.stat().st_size > 30_000
    assert f"bitstream    {report.bitstream}" in capsys.readouterr().out
    assert Skin.load(tmp_path / "skin.toml") == board.skin


def test_a_sheet_that_does_not_fit_leaves_no_bitstream(tmp_path, capsys):
    skin = tmp_path / "skin.toml"
    skin.write_text(Skin(rows=8, columns=8).to_toml())
    bitstream = Path(tmp_path / "out" / "contactfpga.bin")
    bitstream.parent.mkdir()
    bitstream.write_bytes(b"an older one")
    assert cli.main(["build", "icestick", "--skin", str(skin), "--output", str(bitstream.parent)]) == 1
    assert "iCEStick: the design does not fit: " in capsys.readouterr().err
    assert not bitstream.exists()
