"""Random histories of threads that read one board and close it: they pause wherever they take or give back a lock.

The world of `test_freshness` tells when each frame was scanned, and what the board was asked.
"""

import random

import pytest
from sample import sample
from schedule import Schedule
from world import Witness, World

from contactfpga import BoardClosed, Skin
from contactfpga.driver import link, requests
from contactfpga.driver.board import Board


class Port:
    """A world's port that notes who is in it, and what no port may be used for."""

    live = True

    def __init__(self, world, schedule, threaded):
        self.name = "world"
        self.threaded = threaded
        self.clock = world.clock
        self.inside = []
        self.wrong = []
        self.closed = False
        self._world, self._schedule = world, schedule

    def _enter(self, what):
        self.wrong += [f"{what} after close"] if self.closed else []
        self.wrong += [f"two in {what}"] if what in self.inside else []
        self.inside.append(what)
        self._schedule.pause()

    def read(self, timeout_s):
        self._enter("read")
        try:
            data = self._world.read(timeout_s)
            self._schedule.pause()
            return data
        finally:
            self.inside.remove("read")

    def write(self, data):
        self._enter("write")
        try:
            if self._schedule.rng.random() < 0.1:
                self._schedule.rest()
            self._world.write(data)
            self._schedule.pause()
        finally:
            self.inside.remove("write")

    def close(self):
        self.wrong += [f"closed during {self.inside}"] if self.inside else []
        self.closed = True


class History:
    """A board on a world, whose threads a schedule runs."""

    def __init__(self, seed, monkeypatch, threaded):
        self.rng = rng = random.Random(seed)
        self.world = World(Skin(), up_us=rng.choice([0, 300, 3000]), down_us=rng.choice([0, 1000]), seed=seed)
        self.schedule = Schedule(rng, self.world.clock, pauses=rng.choice([0.0, 0.01, 0.05]))
        monkeypatch.setattr(link, "threading", self.schedule)
        self.port = Port(self.world, self.schedule, threaded)
        self.hellos, self.asked = 0, 0  # requests that the board heard
        self._hear, self.world.board.hear = self.world.board.hear, self._heard
        monkeypatch.setattr(requests.random, "SystemRandom", lambda: random.Random(seed))
        self.board = Board(self.port)
        self.board.greet(1.0)

    def _heard(self, data):
        found = self._hear(data)
        self.asked += len(found)
        self.hellos += sum(hello for _, hello in found)
        return found

    def reads(self, count):
        """A thread's work: each frame was scanned after it was asked for, and after the one before."""
        witness = Witness(self.world)
        for _ in range(count):
            since = self.world.now_us
            witness.check(self.board.read(1.0), since)
            if self.rng.random() < 0.2:
                self.schedule.pause()

    def follows(self, count):
        """A thread's work: the frames of a subscription, in order."""
        witness = Witness(self.world)
        with self.board.subscribe() as frames:
            for _ in range(count):
                witness.check(frames.next(1.0))

    def looks(self, count):
        for _ in range(count):
            Witness(self.world).check(self.board.latest(1.0))

    def calls(self, call, *arguments):
        """Repeat a thread's call until the board is closed, which only BoardClosed says."""
        try:
            while True:
                call(*arguments)
                self.schedule.pause()
        except BoardClosed:
            pass


@pytest.mark.parametrize("threaded", [True, False], ids=["reader", "readers in turn"])
@pytest.mark.parametrize("seed", sample(range(200), quick=range(5), slow=range(5, 60)))
def test_every_read_is_of_after_the_call_and_greets_nobody_anew(seed, threaded, monkeypatch):
    history = History(seed, monkeypatch, threaded)
    readers = history.rng.choice([1, 2, 5, 12, 24])
    work = [lambda: history.reads(12)] * readers
    work += [lambda: history.follows(20), lambda: history.looks(6)][: history.rng.randrange(3)]
    history.schedule.run(*work)
    history.board.close()
    assert history.port.closed
    assert not history.port.wrong
    assert history.asked >= 13
    assert history.hellos == 1, "asked for a hello again on a line that lost nothing"


@pytest.mark.parametrize("threaded", [True, False], ids=["reader", "readers in turn"])
@pytest.mark.parametrize("seed", sample(range(300), quick=range(20), slow=range(20, 80)))
def test_a_board_is_closed_at_any_moment(seed, threaded, monkeypatch):
    history = History(seed, monkeypatch, threaded)
    board, rng = history.board, history.rng
    calls = [(board.read, 1.0), (board.next, 1.0), (board.latest, 1.0), (board.batch, 0.002), (board.clock,)]
    chosen = [calls[0], *rng.choices(calls, weights=(4, 1, 1, 1, 1), k=rng.randrange(7))]
    work = [lambda call=call: history.calls(*call) for call in chosen]

    def close():
        for _ in range(rng.choice([0, 1, 10, 100, 600])):
            history.schedule.pause()
        steps = rng.choice([0, 3000])  # for which it waits until one of them sends; time passes only while all wait
        while steps and "write" not in history.port.inside:
            history.schedule.pause()
            steps -= 1
        board.close()
        assert history.port.closed, "close returned before the port was given back"

    history.schedule.run(*work, *[close] * rng.choice([1, 1, 2]))
    assert history.port.closed
    assert not history.port.wrong
