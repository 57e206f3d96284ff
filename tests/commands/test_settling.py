"""`wire --settle` on the compiled gateware and a sheet with slow lines, through the driver; the image is computed by
hand from the circuit."""

import argparse
import json
import math
import tomllib

import numpy as np
import pytest
from model_board import DirectPort
from planted_sheets import CIRCUIT as COMMON_CIRCUIT
from planted_sheets import SKIN as COMMON
from sample import sample

import contactfpga
from contactfpga import Skin
from contactfpga.design.circuit import Circuit
from contactfpga.tools.commands.wire import settle
from contactfpga.tools.console import flags
from contactfpga_sim.model.board.virtual import VirtualBoard
from contactfpga_sim.model.sheet.line import ColumnLine

SKIN = Skin(rows=4, columns=4, report="cells", settle_us=20.0, precharge_us=0.5)
SETTLE, CLOCKS_PER_US = 240, 12
CIRCUIT = Circuit(line_pf=300, switch_ohm=3000)
SLOW_ROW, SLOW_COLUMN = 2, 1
FACTOR = 3.0


def predicted(pressed):
    """(4, 4) of clocks, 0 where nothing is pressed: once released a column goes exponentially to where it comes to
    rest, as fast as the number of pressed switches in its row lets it, a slow line by a factor slower."""
    line, clocks = ColumnLine.of(CIRCUIT, 4, 4), np.zeros((4, 4), int)
    for row, column in zip(*pressed.nonzero(), strict=True):
        count = pressed[row].sum()
        slower = FACTOR ** (int(row == SLOW_ROW) + int(column == SLOW_COLUMN))
        seconds = -line.press_s[count] * slower * math.log(1 - line.threshold / line.pulled[count])
        clocks[row, column] = math.floor(seconds * 12e6) + 1
    return clocks


def board_of(scene):
    slow = {"slow_rows": {SLOW_ROW: FACTOR}, "slow_columns": {SLOW_COLUMN: FACTOR}}
    return contactfpga.open(VirtualBoard(SKIN, scene, circuit=CIRCUIT, **slow), skin=SKIN)


def arguments(seconds, in_json=True):
    return argparse.Namespace(seconds=seconds, timeout=1.0, json=in_json)


def all_but_one():
    pressed = np.ones((4, 4), bool)
    pressed[1, 2] = False
    return pressed


@pytest.mark.slow
def test_the_image_is_what_the_circuit_predicts_in_json_and_in_a_terminal(capsys):
    pressed = all_but_one()
    with board_of(lambda _: pressed) as board:
        assert settle.measure(board, arguments(0.07)) == 0
        assert board.next().cells.tolist() == pressed.tolist(), "it samples at the end of the settle time again"
        answer = json.loads(capsys.readouterr().out)
        assert settle.measure(board, arguments(0.07, in_json=False)) == 0
    lines = capsys.readouterr().out.splitlines()
    expected = predicted(pressed)
    assert expected[SLOW_ROW, SLOW_COLUMN] > 150
    assert [[cell or 0 for cell in row] for row in answer["clocks"]] == expected.tolist()
    assert answer["us"][0][0] == expected[0, 0] / CLOCKS_PER_US
    assert (answer["settle_clocks"], answer["first_clocks"], answer["clock_hz"]) == (SETTLE, 2, 12_000_000)
    assert (answer["slow"]["rows"], answer["slow"]["columns"]) == ([SLOW_ROW], [SLOW_COLUMN])
    assert answer["back_clocks"] == [None, None, 2, None]
    assert answer["findings"] == []
    longest_us = expected.max() / CLOCKS_PER_US
    assert 1.3 * longest_us <= answer["proposal"]["settle_us"] < 1.3 * longest_us + 0.011
    tenths = [[str((cell - 1) * 10 // SETTLE) if cell else "·" for cell in row] for row in expected.tolist()]
    assert [line.split() for line in lines[1:5]] == tenths
    assert [line.partition(":")[0] for line in lines[6:9]] == ["15 of 16 cells measured", "slow row 2", "slow column 1"]
    assert tomllib.loads(lines[-1]) == {"settle_us": answer["proposal"]["settle_us"]}


@pytest.mark.slow
def test_the_sheet_of_a_file_has_its_circuits_times(run, tmp_path):
    cells, file = np.ones((2, 4, 4), bool), tmp_path / "skin.toml"
    cells[:, 0] = False
    np.savez(tmp_path / "plate.npz", pressed=cells, rate_hz=1.0)
    file.write_text(SKIN.to_toml() + "[circuit]\nline_pf = 300\nswitch_ohm = 3000\nlow_v = 0.8\n")
    port = f"sim://?scene={tmp_path / 'plate.npz'}&skin={file}"
    clocks = json.loads(run("wire", "--settle", "--json", "--seconds", "0.05", "--skin", file, port)[1])["clocks"]
    assert clocks[0] == [None] * 4
    assert {cell for row in clocks[1:] for cell in row} == {predicted(cells[0])[1, 0]}


ERRORS = [KeyboardInterrupt(), contactfpga.ReadTimeout("no frame came")]


@pytest.mark.parametrize("error", sample(ERRORS, quick=ERRORS[:1], slow=ERRORS[1:]))
def test_what_was_found_is_reported_and_the_board_left_as_it_was(capsys, error):
    """It ends while the board samples early, in the middle of a frame. Other tests compile this board as well."""
    pressed, stops = np.ones((COMMON.rows, COMMON.columns), bool), [0.03125]

    def scene(now):
        if stops and now > stops[0]:
            stops.clear()
            raise error
        return pressed

    with contactfpga.open(VirtualBoard(COMMON, scene, circuit=COMMON_CIRCUIT), skin=COMMON) as board:
        assert settle.measure(board, arguments(None)) == 0
        assert not stops
        for _ in range(3):
            board.next()
        assert board.read().cells.all()
    answer = json.loads(capsys.readouterr().out)
    assert sum(cell is not None for row in answer["clocks"] for cell in row) >= 9
    assert [finding["sentence"] for finding in answer["findings"]] == [str(error)] * bool(str(error))


class Dying(DirectPort):
    """Answers some commands, and then is unplugged."""

    answers = 10

    def write(self, data):
        self.answers -= 1
        if self.answers < 0:
            raise contactfpga.PortLost("the board was unplugged")
        super().write(data)


def test_a_board_that_is_unplugged_is_reported(capsys):
    with contactfpga.open(Dying(SKIN), skin=SKIN) as board:
        assert settle.measure(board, arguments(None, in_json=False)) == 1
    said = capsys.readouterr().out
    assert "fault the board was unplugged" in said
    assert "may still sample at other instants than its Skin states, so that cells read wrongly" in said
    assert "Nothing was measured" in said


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"report": "moments"}, "sends zones, not cells"),
        ({"debounce": "sym_defer_pk"}, "debounces ('sym_defer_pk'), which hides what one frame shows"),
        (
            {"column_read": "74hc165", "precharge_us": 0.0, "settle_us": 0.5, "release_us": 9},
            "cannot be sampled before 10; build",
        ),
    ],
)
def test_a_board_that_cannot_be_measured_is_refused(run, monkeypatch, changes, sentence):
    skin = SKIN.replace(**changes)
    monkeypatch.setattr(flags, "opened", lambda args: contactfpga.open(DirectPort(skin), skin=skin))
    assert sentence in run("wire", "--settle", "--seconds", 1)[2]


def test_two_measurements_at_once_are_refused(run):
    assert "two measurements" in run("wire", "--settle", "--bounce", "sim://")[2]
    assert "tells of no settle time" in run("wire", "--settle", "--once", "sim://")[2]
