"""Pins that a netlist drives and reads: what it drives is told apart, and the replay sees a fault in any of it."""

import re
import shutil

import pytest

from contactfpga.boards import BOARDS
from contactfpga.skin import Skin
from contactfpga_sim.model.board import native
from contactfpga_sim.model.board.compiled import model_of
from contactfpga_sim.model.sheet.matrix import Contention
from contactfpga_sim.verify.cosim.compare import Mismatch
from contactfpga_sim.verify.netlist import extract
from contactfpga_sim.verify.netlist.extract import WrongPins
from contactfpga_sim.verify.netlist.replay import RUNS, replay, stimulus

SKIN = Skin(rows=2, columns=1, scan="reversal", precharge_us=0.25)
ICEBOX = r"""module contactfpga (inout columns_0__io, inout [1:0] \rows_0__io , output tx);
tran(\rows_0__io [0], \rows_0__io[0] );
assign n1 = \rows_0__io[0] ;
assign \rows_0__io[0]  = n5 ? n6 : 1'bz;
assign n2 = \rows_0__io[1] ;
assign \rows_0__io[1]  = n5 ? n7 : 1'bz;
assign n3 = columns_0__io;
assign columns_0__io = n8 ? n9 : 1'bz;
assign tx = n9 ? n10 : 1'bz;
endmodule
"""


def test_lines_of_an_unpacked_bitstream():
    text = extract.of_icebox(ICEBOX, SKIN)
    assert "input columns_0__io, output columns_0__o, output columns_0__oe" in text
    assert r"input [1:0] \rows_0__io , output [1:0] rows_0__o, output [1:0] rows_0__oe" in text
    for assigned in (
        "rows_0__o[0] = n6",
        "rows_0__oe[0] = n5",
        "rows_0__o[1] = n7",
        "columns_0__o = n9",
        "columns_0__oe = n8",
    ):
        assert f"assign {assigned};" in text
    assert r"assign n1 = \rows_0__io[0] ;" in text, "what is read stays"
    assert "assign tx = n9 ? n10 : 1'bz;" in text, "and so do other pins"
    assert text.count("1'bz") == 1


def test_a_line_without_a_buffer_of_its_own_is_refused():
    with pytest.raises(WrongPins, match="expected is one"):
        extract.of_icebox(ICEBOX, SKIN.replace(rows=3))
    with pytest.raises(WrongPins, match="the netlist has 0 places like"):
        extract.of_icebox(ICEBOX.replace("n5 ?", "n5 &"), SKIN)


@pytest.mark.parametrize(("diodes", "driven"), [("col2row", "& columns_o"), ("row2col", "& ~columns_o")])
def test_a_column_that_is_driven_to_the_wrong_level_is_not_driven_right(diodes, driven):
    assert f"assign columns_drive = columns_oe {driven};" in extract.wrapper(SKIN.replace(diodes=diodes))[1]


def test_columns_that_are_driven_both_ways_have_the_level_of_the_first_one_and_the_guard_column_the_other():
    skin = SKIN.replace(columns=3, self_test=True)
    text = extract.wrapper(skin)[1]
    assert "assign columns_level = columns_o[0];" in text
    assert "assign columns_drive = columns_oe & ~(columns_o ^ {3{columns_level}});" in text
    text = extract.wrapper(skin.replace(guard=True))[1]
    assert "assign columns_drive = columns_oe & ~(columns_o ^ {~columns_level, {3{columns_level}}});" in text


# ---- whole boards

BOARD = BOARDS["ulx3s-12f"]
SHEET = next(skin for name, skin in RUNS if skin.scan == "reversal" and name == BOARD.name).replace(rows=3, columns=4)


@pytest.fixture(scope="module")
def synthesized(tmp_path_factory):
    return extract.synthesized(BOARD, SHEET, tmp_path_factory.mktemp("ulx3s"))


@pytest.mark.campaign
def test_the_synthesized_netlist_does_what_the_golden_model_says(synthesized, record_property):
    out = replay(SHEET, model_of(SHEET, synthesized), stimulus(SHEET, 1500, []))
    assert out.changes > 3000
    record_property("cases", out.frames)


@pytest.mark.campaign
@pytest.mark.parametrize("fields", [{"guard": True}, {"self_test": True}], ids=["guard", "self_test"])
def test_columns_that_are_driven_both_ways_do_what_the_golden_model_says(fields, tmp_path, record_property):
    skin = SHEET.replace(**fields)
    whole = extract.synthesized(BOARD, skin, tmp_path)
    out = replay(skin, model_of(skin, whole), stimulus(skin, 600, []))
    assert out.changes > 1000
    record_property("cases", out.frames)
    inverted, count = re.subn(r"assign columns_level = ", "assign columns_level = ~", whole.files["top.v"])
    assert count == 1
    broken = native.Netlist(whole.files | {"top.v": inverted}, whole.read)
    with pytest.raises((Mismatch, Contention)):
        replay(skin, model_of(skin, broken), stimulus(skin, 200, []))


@pytest.mark.campaign
@pytest.mark.parametrize(
    ("name", "planted", "error"),
    [("columns", "1'b0", Mismatch), ("columns", "1'b1", Contention), ("rows", "1'b1", Mismatch)],
)
def test_an_output_enable_that_is_stuck_is_seen(synthesized, name, planted, error):
    text = synthesized.files["chip.v"]
    wrong, count = re.subn(rf"(assign {name}_0__oe\[1\] = )[^;]+;", rf"\g<1>{planted};", text)
    assert count == 1
    broken = native.Netlist(synthesized.files | {"chip.v": wrong}, synthesized.read)
    with pytest.raises(error):
        replay(SHEET, model_of(SHEET, broken), stimulus(SHEET, 200, []))


@pytest.mark.campaign
@pytest.mark.timeout(1800)
@pytest.mark.skipif(shutil.which("icebox_vlog") is None, reason="no icebox_vlog on PATH")
def test_the_netlist_taken_out_of_a_bitstream_does_what_the_golden_model_says(tmp_path, record_property):
    name, skin = next((name, skin) for name, skin in RUNS if skin.scan == "reversal" and name == "icebreaker")
    out = replay(skin, model_of(skin, extract.from_bitstream(BOARDS[name], skin, tmp_path)), stimulus(skin, 2000, []))
    assert out.changes > 3000
    record_property("cases", out.frames)
