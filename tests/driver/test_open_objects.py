"""What a program sees of open boards, bodies and recordings: how they print, and what they refuse."""

import copy
import math
import pickle

import pytest
from recorded_stream import StreamPort

import contactfpga
from contactfpga.recordings import Session
from contactfpga.robot.body import Body


@pytest.fixture
def opened():
    with contactfpga.open(StreamPort()) as board:
        yield board


def test_a_board_says_what_it_is(opened):
    assert repr(opened) == "<Board the virtual board: 16x16 cells>"
    opened.close()
    assert repr(opened) == "<Board the virtual board was closed; open it again>"


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, pickle.dumps])
def test_a_board_stays_in_its_process(opened, copied):
    """The end of a copy would close the port of the board."""
    with pytest.raises(TypeError, match="cannot be copied or sent to another process; open its port there"):
        copied(opened)
    assert opened.next()


def test_a_batch_is_as_long_as_its_frames(opened):
    batch = opened.batch()
    assert len(batch) == len(batch.frames) > 1
    first, last = batch.frames["sequence"][0], batch.frames["sequence"][-1]
    assert repr(batch) == f"<Batch: frames {first} to {last} ({len(batch)}), {len(batch.zones)} zones>"
    assert batch != opened.batch()  # and no question of what arrays are


@pytest.mark.parametrize("span", [-1, math.nan, math.inf, "long"])
def test_the_time_of_a_batch_is_a_number_of_seconds(opened, span):
    with Body({}).open() as body:
        for one in (opened, opened.subscribe(), body):
            with pytest.raises(ValueError, match=r"max_s is .*; it must be a number of seconds, 0 or more"):
                one.batch(span)


def test_joints_are_a_function():
    with pytest.raises(TypeError, match="joints is 5; it must be a function of a time"):
        Body({}).open(5)


def test_a_session_records_boards_that_were_added_once(tmp_path):
    with Session(tmp_path / "x.mcap") as session:
        with pytest.raises(contactfpga.ContactFPGAError, match="no board to record"):
            session.start()
        session.add(StreamPort())
        for seconds in (0, -1, math.nan, "long"):
            with pytest.raises(ValueError, match="seconds is"):
                session.start(seconds)
        session.start(0.01)
        with pytest.raises(contactfpga.ContactFPGAError, match="was started already"):
            session.start()
        with pytest.raises(contactfpga.ContactFPGAError, match="add all boards before start"):
            session.add(StreamPort())
