"""Faults by name, commands, and slots of a self-test, from bytes to what a program sees."""

import random

import numpy as np
import pytest
from model_board import DirectPort, ModelBoard
from wire import Wire, last_byte

import contactfpga
from contactfpga.driver.conversation import Conversation, frames_in
from contactfpga.wire import faults
from contactfpga.wire.faults import Faults
from contactfpga.zones.batch import Batch
from contactfpga.zones.run import Run

GUARD = contactfpga.Skin(guard=True)
TESTED = contactfpga.Skin(scan="reversal", precharge_us=1.0, self_test=True)
BOTH = TESTED.replace(guard=True)
ROW_3, COLUMN_7, STUCK_2 = 1 << 3, 1 << 16 + 7, 1 << 32 + 2
JOINED = 1 << 49
FLAGGED = ["fault"]


class Line:
    """A board whose bytes go straight to a conversation."""

    def __init__(self, skin=GUARD, expected=None):
        self.board, self.host, self.now = ModelBoard(skin), Conversation("x", expected), 0.0

    def give(self, *packets):
        return self.host.receive(b"".join(packets), self.now)

    def hello(self):
        return self.give(self.board.hello(), self.board.report())

    def tell(self, word):
        self.board.word = word
        return self.give(self.board.report())

    def faults(self, flagged=True):
        """Of the next frame."""
        (event,) = self.give(self.board.frame(flags=FLAGGED if flagged else ()))
        return event[0].faults


@pytest.mark.parametrize(
    ("word", "names"),
    [
        (ROW_3, ("row 3 open",)),
        (ROW_3 | COLUMN_7 | STUCK_2, ("column 2 stuck", "column 7 open", "row 3 open")),
        (0xFFFF, ("guard column open",)),
        (0xFFFF << 16, ("guard row open",)),
        (0xFFFF_FFFF, ("all lines open",)),
        (0xFFFE << 16, tuple(sorted(f"column {column} open" for column in range(1, 16)))),
        (1 << 32 + 16, ("guard column stuck",)),
        (JOINED, ("joined lines",)),
    ],
)
def test_a_flagged_frame_says_which_lines_are_faulty(word, names):
    line = Line(BOTH)
    line.hello()
    line.tell(word)
    assert line.faults() == names
    assert line.faults(flagged=False) == ()
    assert line.host.lines.reported.names == names


def test_lines_whose_switches_are_all_masked_are_not_counted_among_all():
    masked = GUARD.replace(mask=tuple((row, 15) for row in range(16)))
    for expected, names in (
        (masked, ("guard row open",)),
        (None, tuple(sorted(f"column {c} open" for c in range(15)))),
    ):
        line = Line(masked, expected)
        line.hello()
        line.tell(0x7FFF << 16)
        assert line.faults() == names


def test_the_only_line_that_is_checked_is_named_itself():
    assert Faults(rows_open=(0,)).named(1, 5).names == ("row 0 open",)


def test_a_board_without_guard_lines_says_stuck():
    line = Line(contactfpga.Skin())
    line.give(line.board.hello())
    assert line.faults() == ("stuck",)
    tested = Line(TESTED)
    tested.hello()
    assert tested.faults() == ("stuck",)
    tested.tell(1)
    assert tested.faults() == ("joined lines",)


def test_a_fault_whose_name_has_not_come_is_reported_without():
    line = Line()
    line.give(line.board.hello())
    assert line.faults() == ("unnamed fault",)
    line.tell(0)
    assert line.faults() == ("unnamed fault",)
    line.tell(ROW_3)
    assert line.faults() == ("row 3 open",)


def test_names_hold_for_the_frames_that_a_report_overtook_and_no_longer():
    line = Line()
    line.hello()
    line.tell(ROW_3)
    line.tell(0)
    assert [line.faults(), line.faults(), line.faults(flagged=False)] == [("row 3 open",), ("row 3 open",), ()]
    assert line.faults() == ("unnamed fault",)  # another one, whose report was lost
    line.tell(ROW_3)
    line.tell(0)
    line.hello()  # says once more that there is none
    assert line.faults() == ("unnamed fault",)


@pytest.mark.parametrize("skin", [GUARD, GUARD.replace(pitch_x_mm=5.0)])
def test_a_restart_and_another_skin_forget_names(skin):
    line = Line()
    line.hello()
    line.tell(ROW_3)
    line.faults()
    line.board = ModelBoard(skin)
    line.now += 1.0
    line.give(line.board.hello())
    assert line.host.lines.reported is None
    assert line.faults() == ("unnamed fault",)


def test_reports_are_delivered_only_when_they_differ():
    line = Line()
    assert [type(event).__name__ for event in line.hello()] == ["Hello"]
    assert line.tell(ROW_3) == [Faults(rows_open=(3,))]
    assert [type(event).__name__ for event in line.hello()] == ["Hello"]
    assert line.tell(0) == [Faults()]
    assert line.host.stats.fault_reports == 4


def test_reports_that_cannot_be_are_refused_and_those_of_other_boards_unknown():
    line = Line()
    line.hello()
    wire = line.board.wire
    short, undigit = b"\x81" * 6 + last_byte(9), b"\x01" * 7 + last_byte(9)
    filled = b"\x80" * 6 + b"\xff" + b"\x80" + last_byte(9)
    many = b"\xff" * 7 + last_byte(9)
    line.give(*(wire.seal(plain) for plain in (short, undigit, filled, many)))
    assert line.host.stats.damaged == {"length": 2, "content": 1}  # 49 bits are all there are: none can be too many
    plain = Line(contactfpga.Skin())
    plain.give(plain.board.hello(), plain.board.wire.seal(b"\x81" + last_byte(9)))
    assert plain.host.stats.unknown_kinds == 1


def test_encoders_agree_with_an_independent_one():
    for skin, word in ((GUARD, ROW_3 | STUCK_2), (BOTH, JOINED | 1), (TESTED, 1)):
        bits = faults.fault_bits(skin.rows, skin.columns, skin.guard, skin.self_test)
        assert Wire(skin).seal(faults.encode_faults(word, bits)) == Wire(skin).report(word)
        assert Wire(skin).seal(faults.encode_slot(300, 5, 32)) == Wire(skin).slot(300, 5, 0)


def said(zones):
    """What the board said: how sure the host is of its clock depends on the pieces."""
    return {name: value for name, value in zones.to_dict().items() if not name.startswith("host_")}


def test_frames_in_runs_have_the_faults_of_those_one_by_one():
    """Whatever the pieces; reports between them, lost ones, frames that a report overtook."""
    rng = random.Random("runs")
    board = ModelBoard(GUARD)
    packets, flagged = [board.hello()], False
    for _ in range(900):
        if rng.random() < 0.03:
            board.word = rng.choice([0, ROW_3, STUCK_2])
            packets += [board.report()] * rng.choice([0, 1, 1])
        if rng.random() < 0.05:
            flagged = not flagged
        packets.append(board.frame(flags=FLAGGED if flagged else ()))
    one, many = Conversation("x"), Conversation("x")
    singles = [zones for packet in packets for zones in frames_in(one.receive(packet, 0.0))]
    pieces = [b"".join(packets[start : start + 50]) for start in range(0, len(packets), 50)]
    items = [event for piece in pieces for event in many.receive(piece, 0.0) if isinstance(event, Run)]
    assert [said(zones) for zones in frames_in(items)] == [said(zones) for zones in singles]
    assert Batch.of(items).faults == tuple(zones.faults for zones in singles)
    assert {zones.faults for zones in singles} == {(), ("row 3 open",), ("column 2 stuck",), ("unnamed fault",)}
    assert sum(len(run) > 8 for run in items) > 10
    assert np.array_equal(Batch.of(items).frames["fault"], ["fault" in zones.flags for zones in singles])


# ---- the logger


@pytest.mark.parametrize(
    ("skin", "said", "warnings"),
    [
        (GUARD, (ROW_3, ROW_3, ROW_3 | COLUMN_7, 0), ["fault: row 3 open", "fault: column 7 open, row 3 open"]),
        (contactfpga.Skin(), (2, 2, 0), ["columns that read pressed while no row was driven: 2"]),
    ],
    ids=["lines by name", "a number of columns"],
)
def test_the_logger_tells_of_faults_as_they_come_and_go(caplog, skin, said, warnings):
    caplog.set_level("INFO", "contactfpga")
    port = DirectPort(skin)
    with contactfpga.open(port) as board:
        name = board.port
        caplog.clear()
        for port.word in said:
            port.send(port.report() if skin.guard else port.hello(stuck=port.word))
            board.read()
    assert [(record.levelname, record.getMessage()) for record in caplog.records] == [
        *(("WARNING", f"{name}: {warning}") for warning in warnings),
        ("INFO", f"{name}: no fault any more"),
    ]


# ---- commands


def test_a_command_is_acknowledged_by_the_first_frame_scanned_after_it():
    port = DirectPort(TESTED)
    with contactfpga.open(port) as board:
        sequence = board.next().sequence
        zones = board.command(1, value=77)
        assert port.commanded == [(1, 77)]
        assert zones.sequence == sequence + 1
        assert board.hello.commands == b"\x01"
        board.read()
        assert port.commanded == [(1, 77)], "a read sends none"


def test_a_command_as_pulses():
    port = DirectPort(TESTED.replace(baud=6_000_000))
    with contactfpga.open(port) as board:
        board.command(1)
        assert port.commanded == [(1, 0)]


def test_a_board_that_lacks_a_command_says_what_to_do():
    with contactfpga.open(DirectPort(GUARD)) as board:
        with pytest.raises(contactfpga.NoSuchCommand, match="takes no self-test; build its Skin with self_test = true"):
            board.command(1)
        with pytest.raises(contactfpga.NoSuchCommand, match="takes no command 99; it takes none"):
            board.command(99)
        for what, value in ((128, 0), (1.5, 0), (1, -1), (1, 1 << 21)):
            with pytest.raises(ValueError, match="must be a whole number from 0 to"):
                board.command(what, value)


def test_the_sample_is_moved_by_a_command():
    port = DirectPort(contactfpga.Skin(report="cells"))
    with contactfpga.open(port) as board:
        sequence = board.next().sequence
        assert board.sample_at(17).sequence == sequence + 1
        board.sample_at()
        assert port.commanded == [(2, 17), (2, 0)]
        with pytest.raises(ValueError, match="value of a command is -1"):
            board.sample_at(-1)
    with contactfpga.open(DirectPort(contactfpga.Skin())) as board:
        with pytest.raises(
            contactfpga.NoSuchCommand, match=r'no sample at; build its Skin with report = "cells" or ruler$'
        ):
            board.sample_at(17)


class Lossy(DirectPort):
    """Loses what the host sends, or its answers."""

    lose = 0
    lose_answers = 0

    def write(self, data):
        if self.lose:
            self.lose -= 1
            return
        super().write(data)
        if self.lose_answers:
            self.lose_answers -= 1
            self._out = b""


def test_a_lost_command_is_sent_again_and_a_read_does_not_acknowledge_it():
    port = Lossy(TESTED)
    with contactfpga.open(port) as board:
        port.lose = 2
        board.command(1, timeout=5.0)
        assert port.commanded == [(1, 0)]
        port.lose_answers = 1
        board.command(1, 5, timeout=5.0)
        assert port.commanded[1:3] == [(1, 5), (1, 5)], "it may be taken more than once"
        port.lose = 1000
        with pytest.raises(contactfpga.ReadTimeout):
            board.command(1, 9, timeout=2.0)
        port.lose = 0
        board.read(3.0)
        assert (1, 9) not in port.commanded, "given up is given up"


def test_a_recording_takes_no_command(tmp_path):
    model = ModelBoard(TESTED)
    model.word = 1
    (tmp_path / "x.bin").write_bytes(model.hello() + model.report() + model.frame(flags=FLAGGED))
    with contactfpga.open(f"replay://{tmp_path}/x.bin") as board:
        assert board.next().faults == ("joined lines",)
        assert board.faults == Faults(joined=True)
        with pytest.raises(contactfpga.NoSuchCommand, match="is a recording"):
            board.command(1)
