"""Real builds, with the extra `boards` (102 MB of place and route that `make test` does not install)."""

import importlib.util
import re
import subprocess
from pathlib import Path

import pytest

from contactfpga.boards import BOARDS, pll
from contactfpga.boards.spec import bitstream_path
from contactfpga.design import kits
from contactfpga.skin import Skin
from contactfpga.tools import cli
from contactfpga_hdl.board import build, pnr_report, tools

INSTALLED = all(importlib.util.find_spec(f"yowasp_nextpnr_{family}") for family in ("ice40", "ecp5"))
pytestmark = [
    pytest.mark.campaign,
    pytest.mark.skipif(not INSTALLED, reason="place and route is not installed; run: make bitstreams"),
]


MARGINS = dict.fromkeys(BOARDS, 1.5) | {"ulx3s-12f-ft232h": 1.25}
"""Fmax over the clock that each board needs, as docs/boards.md promises."""


@pytest.mark.parametrize("name", BOARDS)
def test_the_default_sheet_fits_and_meets_its_timing(name, tmp_path, capsys):
    assert cli.main(["build", name, "--output", str(tmp_path)]) == 0
    board = BOARDS[name]
    found = pnr_report.read(tmp_path, build.LOG)
    assert found.needed_mhz == pytest.approx(board.skin.clock_hz / 1e6, rel=0.01)
    assert found.fmax_mhz > MARGINS[name] * found.needed_mhz
    bitstream = bitstream_path(board, tmp_path)
    assert bitstream.stat().st_size > 30_000
    assert f"bitstream    {bitstream}" in capsys.readouterr().out
    assert Skin.load(tmp_path / "skin.toml") == board.skin


@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", kits.names())
def test_a_kit_fits_and_meets_its_timing(name, tmp_path):
    kit = kits.kit(name)
    assert cli.main(["build", "--kit", name, "--output", str(tmp_path)]) == 0
    found = pnr_report.read(tmp_path, build.LOG)
    assert found.fmax_mhz > MARGINS[kit.board.name] * found.needed_mhz
    assert Skin.load(tmp_path / "skin.toml") == kit.skin


@pytest.mark.timeout(600)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_icestick_routes_from_any_seed(seed, tmp_path):
    board = BOARDS["icestick"]
    found = build.build(board.skin, board, tmp_path, seed)
    assert found.logic_cells[0] > 0.75 * found.logic_cells[1]


@pytest.mark.timeout(600)
@pytest.mark.parametrize("seed", [1, 2, 3, 4, 5])
def test_the_fastest_board_keeps_its_margin_from_any_seed(seed, tmp_path):
    board = BOARDS["ulx3s-12f-ft232h"]
    found = build.build(board.skin, board, tmp_path, seed)
    assert found.fmax_mhz > MARGINS[board.name] * found.needed_mhz


def test_64x64_on_shift_registers_fits_the_icebreaker(tmp_path):
    example = Path(__file__).resolve().parents[2] / "examples" / "icebreaker-64x64.toml"
    assert cli.main(["build", "icebreaker", "--skin", str(example), "--output", str(tmp_path)]) == 0
    found = pnr_report.read(tmp_path, build.LOG)
    assert found.fmax_mhz > 1.5 * found.needed_mhz
    page = (example.parents[1] / "docs" / "boards.md").read_text()
    assert f"| {found.block_rams[0]} of {found.block_rams[1]} | " in page


@pytest.mark.parametrize(("name", "clock_hz", "columns"), [("icebreaker", 24_000_000, 16), ("icestick", 48_000_000, 8)])
def test_another_clock_comes_from_the_pll(name, clock_hz, columns, tmp_path):
    """At 48 MHz, whose times have more bits, 16 columns do not fit the iCEStick."""
    board = BOARDS[name]
    found = build.build(board.skin.replace(clock_hz=clock_hz, columns=columns), board, tmp_path)
    assert found.needed_mhz == pytest.approx(clock_hz / 1e6, rel=0.001)
    assert found.met


@pytest.mark.parametrize("megahertz", [18, 24, 30, 48, 60, 81, 99, 132, 270])
def test_dividers_of_an_ice40_are_those_of_icepll(megahertz):
    said = run_tool("yowasp-icepll", "-i", "12", "-o", str(megahertz))
    expected = {name: int(value) for name, value in re.findall(r"^(DIV[RFQ]|FILTER_RANGE): +(\d+)", said, re.MULTILINE)}
    assert len(expected) == 4
    assert pll.dividers("SB_PLL40_PAD", 12_000_000, megahertz * 1_000_000) == expected


@pytest.mark.parametrize("megahertz", [10, 15, 30, 40, 50, 60, 75, 100, 125, 200, 250, 400])
def test_dividers_of_an_ecp5_are_those_of_ecppll(megahertz):
    said = run_tool("yowasp-ecppll", "-i", "25", "-o", str(megahertz))
    names = {"Refclk divisor": "CLKI_DIV", "Feedback divisor": "CLKFB_DIV", "clkout0 divisor": "CLKOP_DIV"}
    expected = {names[name]: int(value) for name, value in re.findall(r"^([\w ]+ divisor): (\d+)", said, re.MULTILINE)}
    assert len(expected) == 3
    assert pll.dividers("EHXPLLL", 25_000_000, megahertz * 1_000_000) == expected


def run_tool(name, *arguments):
    return subprocess.run([tools.tool(name), *arguments], capture_output=True, text=True, check=True).stdout


def test_a_sheet_that_does_not_fit_leaves_no_bitstream(tmp_path, capsys):
    skin = tmp_path / "skin.toml"
    skin.write_text(Skin(rows=8, columns=8).to_toml())
    bitstream = Path(tmp_path / "out" / "contactfpga.bin")
    bitstream.parent.mkdir()
    bitstream.write_bytes(b"an older one")
    assert cli.main(["build", "icestick", "--skin", str(skin), "--output", str(bitstream.parent)]) == 1
    assert "iCEStick: the design does not fit: " in capsys.readouterr().err
    assert not bitstream.exists()
