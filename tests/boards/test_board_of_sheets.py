"""Several sheets on the pins of a board."""

import json
import re

import pytest

from contactfpga import Skin, SkinError, examples
from contactfpga.boards import BOARDS, wiring
from contactfpga.skin.several import Several
from contactfpga.tools.cli import main
from contactfpga_hdl.board.board_top import SheetsTop
from contactfpga_hdl.board.build import plan_for

ICEBREAKER = BOARDS["icebreaker"]
EXAMPLE = str(examples() / "two-sheets.toml")
SKIN = Skin(rows=2, columns=2, labeller="single", settle_us=4.0, row_drive="74hc595", column_read="74hc165")


@pytest.mark.slow
def test_each_wire_has_a_pin_of_its_own_in_the_constraints():
    several = Several((SKIN, SKIN, SKIN))
    pins = ICEBREAKER.pins(several)
    used = [pin for of_port in pins.values() for pin in of_port]
    assert len(used) == len(set(used)) == 21
    assert pins["row_clock_0"] == ICEBREAKER.row_side[:1]
    assert pins["row_clock_1"] == ICEBREAKER.row_side[4:5]
    assert pins["column_clock_1"] == ICEBREAKER.column_side[3:4]
    plan = plan_for(ICEBREAKER, several)
    placed = re.findall(r"^set_io (\S+?)(?:__io|_0__io)?(?:\[0\])? (\w+)", plan.files["contactfpga.pcf"], re.MULTILINE)
    assert len({pin for _, pin in placed}) == len(placed) == 21 + 4  # contact, rx, tx, clock
    assert all(any(name.startswith(port) for name, _ in placed) for port in pins)


def test_each_sheet_has_its_alive_and_a_pull_at_its_data():
    """A sheet with guard lines, one without."""
    safe = SKIN.replace(guard=True, alive=True)
    board = BOARDS["ulx3s-12f"]
    several = Several((safe, SKIN, safe.replace(diodes="row2col")))
    pins = board.pins(several)
    assert (pins["alive_0"], pins["alive_2"]) == (board.column_side[-1:], board.column_side[-2:-1])
    used = [pin for of_port in pins.values() for pin in of_port]
    assert len(used) == len(set(used)) == 3 * 7 + 2
    top = SheetsTop(board, several)
    top._MustUse__silence = True  # nobody elaborates it
    modes = {resource.name: resource.attrs.get("PULLMODE") for resource in top._resources()}
    assert [modes[f"column_data_{number}"] for number in range(3)] == ["UP", None, "DOWN"]
    assert modes["column_clock_0"] is None


def test_more_wires_than_pins_are_refused():
    wide = SKIN.replace(columns=16, column_chains=8)
    with pytest.raises(SkinError, match=r"2 sheets take 14 \+ 14 wires, iCEBreaker has 23 free pins.*fewer chains"):
        ICEBREAKER.check(Several((wide, wide)))


def test_the_rates_are_checked_as_of_one_sheet():
    slow = SKIN.replace(baud=2_500_000, clock_hz=10_000_000)
    with pytest.raises(SkinError):
        BOARDS["ulx3s-12f"].check(Several((SKIN.replace(baud=12_000_000, clock_hz=24_000_000),) * 2))
    with pytest.raises(SkinError):
        ICEBREAKER.check(Several((slow, slow)))


def test_the_table_of_wires_names_the_sheets(capsys):
    assert main(["build", "icebreaker", "--sheets", EXAMPLE, "--wiring", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    leads = {wire["wire"]: wire["leads_to"] for wire in found["wires"]}
    assert leads["row_latch_1"] == "sheet 1: RCLK 12 of every 74HC595"
    assert leads["column_data_1[1]"] == "sheet 1: QH 9 of chip 0, chain 1, 74HC165"
    assert [skin.get("columns") for skin in found["sheets"]] == [None, 24]
    outputs = [(one["sheet"], one["leads_to"]) for one in found["outputs"] if one["chip"] == "74HC595"]
    assert outputs == [(0, f"row {row}") for row in range(16)] + [(1, f"row {row}") for row in range(12)]
    assert main(["build", "icebreaker", "--sheets", EXAMPLE, "--wiring"]) == 0
    printed = capsys.readouterr().out
    assert "iCEBreaker, sheet 1: 12x24" in printed
    assert len(wiring.wires(ICEBREAKER, Several.load(EXAMPLE))) == 19


def test_one_skin_and_several_are_not_built_together(capsys):
    assert main(["build", "icebreaker", "--sheets", EXAMPLE, "--skin", EXAMPLE]) == 1
    assert "give --skin or --sheets, not both" in capsys.readouterr().err
