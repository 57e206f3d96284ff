"""`make bitstream-replay`: netlists of boards against the golden model. Place and route is not needed here."""

import re
import shutil
import sys

import numpy as np
import pytest

from contactfpga.boards import BOARDS
from contactfpga.boards.spec import bitstream_path
from contactfpga.design import kits
from contactfpga.errors import MissingTool
from contactfpga.skin import Skin, SkinError
from contactfpga_hdl.board import build
from contactfpga_sim.model.board import native
from contactfpga_sim.model.board.compiled import model_of
from contactfpga_sim.model.scenes.shapes import variants
from contactfpga_sim.verify.cosim.compare import Mismatch
from contactfpga_sim.verify.netlist import ecp5_cells, extract
from contactfpga_sim.verify.netlist import replay as bitstream_replay
from contactfpga_sim.verify.netlist.replay import RUNS, replay, stimulus

ICEBREAKER, ULX3S = BOARDS["icebreaker"], BOARDS["ulx3s-12f"]
SMALL = ULX3S.skin.replace(rows=3, columns=3, report="cells", settle_us=20.0, clock_hz=50_000_000)
"""With its clock from the PLL."""
LEVELS = Skin(rows=3, columns=4, report="cells", guard=True, ruler=64, harder=(16, 4), precharge_us=1.0, settle_us=30.0)


@pytest.fixture(scope="module")
def synthesized(tmp_path_factory):
    return extract.synthesized(ULX3S, SMALL, tmp_path_factory.mktemp("ulx3s"))


@pytest.mark.campaign
def test_the_synthesized_netlist_does_what_the_golden_model_says(synthesized, record_property):
    frames = stimulus(SMALL, 600, [])
    out = replay(SMALL, model_of(SMALL, synthesized), frames)
    assert out.frames == 600
    assert out.packets > 100
    assert out.changes > 10 * out.packets
    record_property("cases", out.frames)


@pytest.mark.campaign
def test_one_wrong_table_in_the_netlist_is_seen(synthesized):
    text = synthesized.files["chip.v"]
    table = re.search(r"\.INIT\(16'h([0-9a-f]{4})\)\s*\) \\core\.transmitter", text)
    planted = text[: table.start(1)] + f"{int(table[1], 16) ^ 0xFFFF:04x}" + text[table.end(1) :]
    broken = native.Netlist(synthesized.files | {"chip.v": planted}, synthesized.read)
    assert broken.key != synthesized.key
    with pytest.raises(Mismatch):
        replay(SMALL, model_of(SMALL, broken), stimulus(SMALL, 50, []))


@pytest.mark.campaign
@pytest.mark.skipif(shutil.which("icebox_vlog") is None, reason="icebox_vlog is not installed")
def test_the_soft_kits_bitstream_reads_levels_as_the_golden_model_says(tmp_path, record_property):
    skin = kits.kit("soft").skin
    out = replay(skin, model_of(skin, extract.from_bitstream(ICEBREAKER, skin, tmp_path)), stimulus(skin, 40, []))
    assert out.packets > 40
    record_property("cases", out.frames)


@pytest.mark.slow
@pytest.mark.parametrize("skin", [Skin(), LEVELS], ids=["zones", "levels"])
def test_the_gateware_itself_passes_with_no_reset_before_cycle_0(skin):
    assert bitstream_replay.reset_clocks(skin, model_of(skin)) == 0
    assert replay(skin, model_of(skin), stimulus(skin, 3 * bitstream_replay.BATCH // 2, [])).packets > 200


@pytest.mark.parametrize("made", [extract.synthesized, extract.from_bitstream])
def test_rows_that_float_are_refused(made, tmp_path):
    with pytest.raises(SkinError, match=r"diodes is 'none'; rows that float are not simulated"):
        made(ULX3S, SMALL.replace(diodes="none", precharge_us=0), tmp_path)


# ---- frames


def test_frames_are_shapes_recordings_and_random_ones():
    skin = Skin(rows=8, columns=8)
    recorded = np.zeros((3, 5, 20), bool)
    recorded[1, 2, 15:18] = True
    frames = stimulus(skin, 300, [recorded])
    shapes = [cells for _, cells in variants(8, 8)]
    assert all((frames[index * 3] == shapes[index % len(shapes)]).all() for index in range(100))
    assert (frames[2::3].sum(axis=(1, 2)) == 3).any()
    assert len({cells.tobytes() for cells in frames[1::3]}) > 90


def test_the_sheets_fit_their_boards():
    for name, skin in RUNS:
        BOARDS[name].check(skin)
    every = RUNS[0][1].derived
    assert every.frame_clocks >= every.max_frame_bytes * 10 * every.bit_clocks


# ---- tools


def test_without_icebox_the_board_is_left_out(monkeypatch, capsys):
    monkeypatch.setenv("PATH", "")
    monkeypatch.setattr(sys, "argv", ["bitstream_replay", "icebreaker"])
    assert bitstream_replay.main() == 0
    assert "left out     a netlist from the bitstream needs icebox_vlog" in capsys.readouterr().out
    with pytest.raises(MissingTool, match="sudo apt install fpga-icestorm"):
        extract.from_bitstream(ICEBREAKER, ICEBREAKER.skin, None)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [(["--skin", "x.toml"], "--skin needs the board"), (["--frames", "0"], "'0' is not a whole number from 1")],
)
def test_arguments_that_cannot_work_are_refused(arguments, message, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["bitstream_replay", *arguments])
    with pytest.raises(SystemExit):
        bitstream_replay.main()
    assert message in capsys.readouterr().err


def test_a_difference_or_a_failed_build_is_a_failure(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["bitstream_replay", "ulx3s-12f", "--frames", "1"])
    for error in (Mismatch("line", (7, 0), None), build.BitstreamFailed("it does not fit")):

        def fails(*_, error=error):
            raise error

        monkeypatch.setattr(extract, "synthesized", fails)
        assert bitstream_replay.main() == 1
        assert f"FAILED       {error}" in capsys.readouterr().out


def test_a_bitstream_that_packs_to_other_bytes_is_reported(tmp_path, monkeypatch):
    monkeypatch.setattr("shutil.which", lambda name, **_: name)
    monkeypatch.setattr(build, "build", lambda *_: bitstream_path(ICEBREAKER, tmp_path).write_bytes(b"one"))
    monkeypatch.setattr(extract, "_run", lambda *_: (tmp_path / "packed.bin").write_bytes(b"two"))
    with pytest.raises(extract.WrongBitstream, match=r"contactfpga\.bin: unpacked and packed again it has other bytes"):
        extract.from_bitstream(ICEBREAKER, ICEBREAKER.skin, tmp_path)


def test_the_plls_dividers_in_the_bitstream_are_compared_and_its_output_stubbed():
    skin = ICEBREAKER.skin.replace(clock_hz=24_000_000)
    dividers = ".DIVR(4'b0000),\n  .DIVF(7'b0111111),\n  .DIVQ(3'b101),\n  .FILTER_RANGE(3'b001)"
    nets = ".PACKAGEPIN(n7),\n  .PLLOUTGLOBAL(n2),\n  .LOCK(n159)"
    cell = f"wire n2;\nSB_PLL40_PAD #(\n  {dividers}\n) PLL_12_31 (\n  {nets}\n);\nendmodule\n"
    stubbed = "wire n2;\nassign n2 = clk12_0__io;\nassign n159 = 1'b1;\nendmodule\n"
    assert extract._without_pll(cell, ICEBREAKER, skin) == stubbed
    for wrong in (cell.replace("DIVQ(3'b101)", "DIVQ(3'b100)"), "wire n2;\nendmodule\n"):
        with pytest.raises(extract.WrongBitstream, match="PLL"):
            extract._without_pll(wrong, ICEBREAKER, skin)


@pytest.mark.parametrize(
    "use",
    ["DP16KD #(.DATA_WIDTH_A(36)) x();", 'DP16KD #(.REGMODE_B("OUTREG")) x();', 'TRELLIS_IO #(.DIR("BIDIR")) x();'],
)
def test_a_use_of_a_cell_without_a_model_is_refused(use):
    unknown = native.Netlist(
        {"top.v": f"module top(input clk); {use} endmodule", "cells.v": ecp5_cells.cells()},
        "read_verilog -defer cells.v; read_verilog top.v; hierarchy -check -top top",
    )
    with pytest.raises(native.CompileFailed, match="has_no_model"):
        native.load(model_of(SMALL, unknown))
