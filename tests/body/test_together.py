"""Virtual boards of one body: their simulated times go on together, however differently they are read."""

import time

import pytest
from fake_board import wait_until
from model_board import DirectPort
from two_links import FLAT, ROBOT, ROUND

import contactfpga
from contactfpga.robot.body import Body, OpenBody
from contactfpga.robot.body.reader import LAG_S, STEP_S, SharedClock


def test_no_board_leaves_another_one_behind_or_is_ahead_of_real_time(rng):
    """Boards run for as long as they may, or for longer, as where one is asked; the clock stands still and leaps."""
    now = [50.0]
    together = SharedClock(lambda: now[0])
    boards, own = {}, {}  # where each is on the common clock, as it should be, and what its own clock adds to that
    for _ in range(3000):
        now[0] += rng.choice([0.0, 0.0, 1e-4, 2e-3, 0.3])
        name = rng.choice("abcd")
        if name not in boards:
            if rng.random() < 0.3:
                last_s = min(boards.values(), default=None)
                own[name] = rng.uniform(0, 9)
                together.join(name, own[name])
                boards[name] = together._joined_s[name] + own[name]
                own[name] -= boards[name]
                if last_s is not None:
                    assert last_s - STEP_S - 1e-9 <= boards[name] <= last_s + 1e-9, "it begins with the others"
        elif rng.random() < 0.02:
            together.leave(name)
            del boards[name]
        else:
            due_s = together.due_s(name, boards[name] + own[name])
            assert due_s <= STEP_S + min(boards.values()) - boards[name] + 1e-9
            assert boards[name] + due_s <= now[0] - 50.0 + 1e-9
            if due_s > 0:
                boards[name] += due_s * rng.choice([1.0, 0.5])
    assert max(boards.values(), default=0.0) > 0.5


def test_what_a_slow_computer_missed_is_not_made_up_for():
    now = [0.0]
    together = SharedClock(lambda: now[0])
    together.join("a", 0.0)
    now[0] = 10.0
    board_s = 0.0
    while (due_s := together.due_s("a", board_s)) > 1e-9:
        board_s += due_s
    assert board_s == pytest.approx(LAG_S)


class Simulated(DirectPort):
    """Sends a frame every so often in simulated time, of which a second takes ten."""

    def __init__(self, skin, every_s):
        super().__init__(skin)
        self.every_s = self.due_s = every_s

    def read(self, seconds):
        if not self._out and seconds:
            passed = min(seconds, max(0.0, self.due_s - self._seconds))
            time.sleep(10 * passed)
            self._seconds += passed
            if self._seconds >= self.due_s:
                self.due_s += self.every_s
                self.time_us = round(1e6 * self._seconds)
                self._out += self.frame()
        return super().read(0.0)


def test_frequent_and_rare_frames_come_at_one_pace(robot):
    """And a link is not late because the computer is: nothing happens on its sheet while its time does not pass."""
    times = "[[links]]\nlate_s = 0.1\nsilent_s = 0.15"
    robot.write_text(ROBOT.replace("[[links]]", times).replace('"a"', '"sim://"').replace('"b"', '"sim://"'))
    ports = {"arm": Simulated(ROUND, 0.002), "chest": Simulated(FLAT, 0.08)}

    def opened(plan):
        return contactfpga.open(ports[plan.name], plan.skin)

    with OpenBody(Body.load(robot), opened=opened) as body:
        began = {name: port.clock() for name, port in ports.items()}
        statuses, apart = set(), []
        while ports["chest"].clock() - began["chest"] < 0.2:
            before, chest, after = (ports[name].clock() - began[name] for name in ("arm", "chest", "arm"))
            apart.append(max(before - chest, chest - after))
            links = body.latest().links
            statuses |= {state.status for state in links.values() if state.age_s is not None}
            assert all(state.age_s is None or state.age_s <= 0.09 for state in links.values())
            time.sleep(0.005)
        assert max(apart) <= 2 * STEP_S
        assert statuses == {"ok"}
        ports["chest"].read = lambda seconds: (_ for _ in ()).throw(contactfpga.PortLost("it broke"))
        wait_until(lambda: body.latest().links["chest"].status == "lost")
        passed = ports["arm"].clock()
        wait_until(lambda: ports["arm"].clock() > passed + 3 * STEP_S)
