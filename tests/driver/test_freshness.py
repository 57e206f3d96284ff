"""A frame that `read` returns was scanned after the call, whatever happened on the port before."""

import random

import pytest
from model_board import ModelBoard
from sample import sample
from world import Witness, World

import contactfpga
from contactfpga.driver.requests import MOST_APART, Requests

SKIN = contactfpga.Skin()


def numbers(data):
    """(number, whether a hello is asked for) of requests as a host sends them."""
    return ModelBoard(SKIN).hear(data)


def poll(world, board, timeouts):
    """Reads with these timeouts; how many were answered, each by a frame scanned after it was asked for."""
    witness, answered = Witness(world), 0
    for timeout in timeouts:
        since = world.now_us
        try:
            witness.check(board.read(timeout), since)
            answered += 1
        except contactfpga.ReadTimeout:
            pass
    return answered


@pytest.mark.parametrize("down_us", [0, 1000, 16_000])
@pytest.mark.parametrize("send", ["up", "down"])
def test_reads_that_time_out_leave_nothing_stale_behind(down_us, send):
    """A bridge that hands over what it has every 16 ms, and timeouts that are shorter: the answers come later."""
    world = World(SKIN, **{f"{send}_us": down_us})
    with contactfpga.open(world) as board:
        assert poll(world, board, [0.001, 0.005, 0.2] * 100) >= 100


def test_reads_are_answered_while_others_time_out():
    """Timeouts as long as the way there and back: a handshake that began again with each call would never end."""
    world = World(SKIN, up_us=16_000, down_us=16_000)
    with contactfpga.open(world) as board:
        assert poll(world, board, [0.02] * 20 + [0.05] * 300) >= 100


@pytest.mark.parametrize("seed", sample(range(10), quick=range(1), slow=range(1, 3)))
def test_freshness_holds_where_requests_and_frames_are_lost(seed):
    rng = random.Random(seed)
    world = World(SKIN, up_us=rng.choice([0, 300, 5000]), down_us=rng.choice([0, 1000, 16_000]), seed=seed)
    with contactfpga.open(world) as board:
        world.lose, world.lose_requests, world.corrupt = 0.1, 0.3, 0.1
        answered = poll(world, board, [rng.choice([0.002, 0.02, 2.0]) for _ in range(200)])
    assert answered > 50


@pytest.mark.parametrize("seed", range(5))
def test_freshness_holds_across_programs(seed):
    """A program ends while its requests and the answers are on their way, and the next one opens the port."""
    rng = random.Random(seed)
    world = World(SKIN, up_us=8000, down_us=16_000, seed=seed)
    for _ in range(15):
        since = world.now_us
        with contactfpga.open(world) as board:
            Witness(world).check(board.next(), since)
            poll(world, board, [rng.choice([0.001, 0.01, 0.03]) for _ in range(rng.randrange(12))])
        world.closed = False
        world.pause(rng.choice([0, 1000, 50_000]))


def test_a_board_that_was_restarted_is_asked_anew():
    world = World(SKIN, down_us=1000)
    with contactfpga.open(world) as board:
        for _ in range(10):
            poll(world, board, [0.1] * 3)
            world.restart(torn=True)
            assert poll(world, board, [1.0] * 3) == 3
        assert board.stats.restarts == 10


def test_the_logger_tells_of_the_board_its_restarts_and_losses(caplog):
    caplog.set_level("INFO", "contactfpga")
    world = World(SKIN)
    with contactfpga.open(world) as board:
        poll(world, board, [0.1] * 20)
        assert [record.levelname for record in caplog.records] == ["INFO"]
        assert "the board has a 16x16 Skin (fingerprint" in caplog.text
        caplog.clear()
        world.restart()
        while world.board.sent < 300:
            board.next()
        world.lose = 1.0
        world.pause(10_000)
        world.lose = 0.0
        while board.stats.lost == 0:
            board.next()
        world.pause(1_200_000)
        board.latest()
        reported = [(record.levelname, record.getMessage()) for record in caplog.records]
        lost = board.stats.lost
    port = board.port
    assert lost > 0
    assert reported == [
        ("WARNING", f"{port}: the board was restarted"),
        ("WARNING", f"{port}: {lost} frames were lost, {lost} since the port was opened"),
    ]


# ---- the numbers


def known(rng=None):
    """Requests whose last number was seen in a frame."""
    requests = Requests(rng or random.Random(1))
    requests.ask(0.0, 1.0)
    ((number, _),) = numbers(requests.data_to_send())
    requests.take_hello(number, False, 0.0)
    requests.take_frame(number % 8, 0.0)
    ((number, _),) = numbers(requests.data_to_send())
    requests.take_frame(number % 8, 0.0)
    return requests


def test_no_number_is_sent_that_a_frame_on_its_way_can_carry():
    requests, lows = known(), []
    for _ in range(MOST_APART + 1):
        requests.ask(0.0, 1.0)
        ((number, hello),) = numbers(requests.data_to_send())
        assert not hello
        lows.append(number % 8)
    assert len(set(lows)) == MOST_APART + 1
    requests.ask(0.0, 1.0)
    assert not requests.data_to_send(), "the seventh could be taken for the one last seen"
    requests.take_frame(lows[0], 0.01)
    ((number, hello),) = numbers(requests.data_to_send())
    assert (number % 8, hello) == (lows[-1] % 7 + 1, False), "a frame with the first one makes room"
    assert requests.answered == 2  # `known` asked first
    requests.take_frame(number % 8, 0.02)
    assert requests.answered == MOST_APART + 3


def test_a_hello_that_repeats_another_number_is_none_of_ours():
    requests = Requests(random.Random(1))
    requests.ask(0.0, 1.0)
    ((number, _),) = numbers(requests.data_to_send())
    requests.take_hello(number ^ 8, False, 0.0)
    requests.take_frame(number % 8, 0.0)
    assert not requests.data_to_send()
    requests.take_hello(number, False, 0.0)
    requests.take_frame(number % 8 % 7 + 1, 0.0)
    assert not requests.data_to_send()
    requests.take_frame(number % 8, 0.0)
    assert numbers(requests.data_to_send())
    assert requests.answered == 0


def test_a_random_number_does_not_continue_what_was_sent_of_late():
    """A random number never has the lowest bits of a recent one if the next number's were sent since: two frames that
    waited in the board while the hello went ahead could carry them."""
    for seed in range(300):
        requests, lows = Requests(random.Random(seed)), []
        for turn in range(6):
            requests.ask(turn * 1.0, turn + 1.0)
            ((number, _),) = numbers(requests.data_to_send())
            low = number % 8
            after = lows[lows.index(low) :] if low in lows else []
            assert low % 7 + 1 not in after
            lows.append(low)
