"""The driver and boards that have so few clocks per bit that they are sent pulses."""

import random

import pytest
from model_board import ModelBoard
from world import Witness, World

import contactfpga
from contactfpga.driver.requests import Requests
from contactfpga.wire import protocol

FAST = contactfpga.Skin(clock_hz=24_000_000, baud=12_000_000, settle_us=2.5, release_us=1.0)


def test_boards_that_read_pulses_are_distinguished_by_clock_and_baud_rate():
    def pulsed(skin):
        (hello,) = [protocol.HelloReader().take(protocol.cobs_decode(protocol.encode_hello(skin)[1:-4]))]
        return hello.pulsed

    assert pulsed(FAST)
    assert pulsed(FAST.replace(baud=8_000_000))
    assert not pulsed(FAST.replace(baud=6_000_000))
    assert not pulsed(contactfpga.Skin())


def test_requests_go_both_ways_until_the_board_is_known_and_then_one_way():
    requests = Requests(random.Random(1))
    requests.ask(0.0, 1.0)
    unknown = requests.data_to_send()
    (first,) = ModelBoard(FAST).hear(unknown)
    assert ModelBoard(contactfpga.Skin()).hear(unknown) == [first]
    requests.take_hello(0, True, 0.0)
    (second,) = ModelBoard(FAST).hear(again := requests.data_to_send())
    assert first != second, "a hello cannot tell the one from the other"
    assert again == protocol.encode_request(*second, pulsed=True)
    requests.take_hello(0, True, 0.0)
    assert not requests.data_to_send(), "an answer that is on its way is waited for"


def test_nothing_is_sent_at_once_where_nobody_waits():
    requests = Requests(random.Random(1))
    requests.take_hello(0, True, 0.0)
    assert not requests.data_to_send()


@pytest.mark.parametrize("down_us", [0, 1000])
def test_a_frame_that_is_read_was_scanned_after_the_call(down_us):
    world = World(FAST, down_us=down_us)
    witness = Witness(world)
    with contactfpga.open(world) as board:
        world.lose_requests = 0.2
        for _ in range(30):
            since = world.now_us
            witness.check(board.read(), since)
