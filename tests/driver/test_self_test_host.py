"""A self-test from the host: which slots make one, what is lost, and what `doctor --self-test` says."""

import json

import pytest
from model_board import DirectPort

import contactfpga
from contactfpga import Skin
from contactfpga.driver import driver
from contactfpga.instruments.self_test import merged
from contactfpga.tools import cli

SKIN = Skin(rows=3, columns=2, scan="reversal", precharge_us=1.0, self_test=True)
COUNT = 6


class SlotPort(DirectPort):
    """Sends its slots after a command, before the answer; ``answers`` are (rows, columns) as bits, slot by slot."""

    def __init__(self, skin=SKIN):
        super().__init__(skin)
        self.answers = [(0, 0)] + [(1 << row, 0) for row in range(3)] + [(0, 1 << column) for column in range(2)]
        self.moments = []
        self.lost = []  # by command the numbers of slots that are lost

    def write(self, data):
        before = len(self.commanded)
        super().write(data)
        self._seconds += 0.01
        for _ in self.commanded[before:]:
            lost = self.lost.pop(0) if self.lost else ()
            slots = [self.wire.slot(number, *word) for number, word in enumerate(self.answers) if number not in lost]
            self._out = b"".join(slots) + self._out


def test_a_whole_sheet_has_no_findings():
    with contactfpga.open(SlotPort()) as board:
        test = board.self_test()
        assert (test.findings, test.faults, test.untested) == ((), (), ())
        assert [slot.number for slot in test.slots] == list(range(COUNT))
        assert (test.rows, test.columns, test.guard, test.mask, test.pressed) == (3, 2, False, None, frozenset())
        assert board.next().sequence >= 0, "frames go on"


def test_what_follows_what_is_named():
    port = SlotPort()
    port.answers[1] = (0b011, 0)
    port.answers[2] = (0b011, 0)
    port.answers[3] = (0b100, 0b01)
    with contactfpga.open(port, SKIN) as board:
        test = board.self_test()
        crossing = "row 2 and column 0 joined, or the diode at (2, 0) is bridged"
        assert test.faults == (crossing, "rows 0 and 1 joined")
        assert test.mask == frozenset()
        port.answers = [(0, 0b10), *port.answers[1:]]
        again = board.self_test()
        assert [finding.kind for finding in merged([test, again])] == ["fault", "fault", "untested"]
        port.answers[0] = (0b100, 0)
        assert "row 2 is held at the released level" in board.self_test().faults
        port.answers[0], port.answers[4] = (0, 0), (0, 0)
        assert "column 0 is held at the selecting level" in board.self_test().faults


def test_lines_that_are_masked_whole_are_no_finding():
    skin = SKIN.replace(mask=((0, 1), (1, 1), (2, 1)))
    port = SlotPort(skin)
    port.answers[-1] = (0, 0)
    with contactfpga.open(port, skin) as board:
        assert board.self_test().findings == ()


def test_a_test_of_which_slots_are_lost_is_asked_for_again():
    port = SlotPort()
    port.lost = [(0,), (3,), (5,)]
    with contactfpga.open(port) as board:
        assert [slot.number for slot in board.self_test(timeout=5.0).slots] == list(range(COUNT))
    assert len(port.commanded) == 4
    port = SlotPort()
    port.lost = [(2,)] * 100
    with contactfpga.open(port) as board, pytest.raises(contactfpga.ReadTimeout, match="not heard as a whole"):
        board.self_test(timeout=2.0)


def test_boards_without_a_self_test_say_so():
    with contactfpga.open(DirectPort(Skin())) as board, pytest.raises(contactfpga.NoSuchCommand, match="self-test"):
        board.self_test()


@pytest.fixture
def doctor(monkeypatch, capsys):
    """Runs `doctor --self-test` on a port; returns status and output."""

    def doctor(port, *arguments):
        opened = contactfpga.open
        monkeypatch.setattr(driver, "open", lambda *_, **__: opened(port, SKIN))
        status = cli.main(["doctor", "--self-test", "--seconds", "0.001", *arguments])
        return status, capsys.readouterr().out

    return doctor


def test_doctor_prints_each_finding_once_and_what_was_not_pressed(doctor):
    port = SlotPort()
    port.answers[4:] = [(0b101, 0b11), (0b010, 0b11)]
    status, out = doctor(port)
    assert status == 1
    assert out.splitlines()[1:] == [
        "fault columns 0 and 1 joined",
        "note  3 switches were not seen pressed by a self-test, so their diodes are not tested",
    ]
    status, out = doctor(port, "--json")
    answer = json.loads(out)
    assert (status, answer["faults"], answer["tests"]) == (1, 1, 1)
    assert answer["pressed"] == [[0, 0], [1, 1], [2, 0]]
    assert answer["findings"][0] == {"verdict": "fault", "sentence": "columns 0 and 1 joined"}
    status, out = doctor(SlotPort())
    assert status == 0
    assert "no line follows another one" in out


def test_doctor_watches_or_tests(capsys):
    assert cli.main(["doctor", "--watch", "--self-test", "sim://"]) == 1
    assert "give --watch or --self-test, not both" in capsys.readouterr().err
