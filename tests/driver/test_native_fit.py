"""The fit of clocks in C says what the one in Python says, bit by bit."""

import random

import numpy as np
import pytest
from sample import sample

from contactfpga.driver import native
from contactfpga.driver.clock import MOST_POINTS, ClockFit
from contactfpga.driver.native import NativeFit

pytestmark = pytest.mark.skipif(bool(native.missing()), reason=native.missing())


class Way:
    """Frames of a board whose clock drifts, over a way that delays, jams and steps."""

    def __init__(self, rng):
        self.rng = rng
        self.time_us, self.host_s = rng.randrange(1 << 40), rng.uniform(0, 1e6)
        self.rate = 1 + rng.uniform(-1e-4, 1e-4)
        self.step_us, self.late_s = rng.choice([100, 997, 10_000, 250_000]), rng.choice([1e-6, 1e-4, 3e-3])

    def frame(self):
        """Its device time in us, its arrival in s and what its bytes take in s."""
        rng = self.rng
        step_us = self.step_us * rng.choice([1, 1, 1, 2]) + (rng.random() < 0.002) * rng.randrange(70_000_000)
        self.time_us += step_us
        self.host_s += step_us * 1e-6 * self.rate
        if rng.random() < 0.01:
            self.rate += rng.uniform(-3e-4, 3e-4)
        if rng.random() < 0.002:
            self.host_s += rng.choice([-3600.0, -0.05, -0.004, 0.004, 2.0])
        return self.time_us, self.host_s + rng.expovariate(1 / self.late_s), rng.choice([0.0, 1e-5, 17e-5])


def both_say(fits, arrived_s):
    """Bits of both lines."""
    lines = [fit.line(arrived_s) for fit in fits]
    assert [line and [float(value).hex() for value in line] for line in lines[1:]] == [
        line and [float(value).hex() for value in line] for line in lines[:1]
    ]
    assert [fit.begun for fit in fits] == [lines[0] is not None] * 2
    return lines[0]


@pytest.mark.parametrize("seed", sample(range(60), quick=[0, 1, 2], slow=range(3, 8)))
def test_both_fits_agree_on_any_history(seed):
    rng = random.Random(seed)
    way, fits, said = Way(rng), (ClockFit(), NativeFit()), []
    assert both_say(fits, 0.0) is None
    for _ in range(500):
        if rng.random() < 0.8 or not said:
            frame = way.frame()
            for fit in fits:
                fit.arrived(*frame)
        else:
            frames = [way.frame() for _ in range(rng.choice([1, 3, 30, 1000 if way.step_us < 1000 else 5]))]
            columns = np.array([one[0] for one in frames]), *np.array([one[1:] for one in frames]).T
            found = [fit.arrived_in_turn(*columns) for fit in fits]
            for first, second in zip(*found, strict=True):
                assert first.tobytes() == np.ascontiguousarray(second).tobytes()
            frame = frames[-1]
        if rng.random() < 0.03:
            asked_s = frame[1] - rng.choice([0.0, 1e-3, 0.03, -0.01]) - rng.random() * 1e-3
            for fit in fits:
                fit.answered(frame[0], asked_s)
        said.append(both_say(fits, frame[1]))
        if rng.random() < 0.002:
            for fit in fits:
                fit.forget()
            assert both_say(fits, 0.0) is None
    assert len(set(said)) > 300
    assert len({line.rate for line in said}) > 3


def test_both_fits_keep_as_many_arrivals_at_most():
    """Where each comes a little earlier than the bounds let expect, all of a piece count."""
    fits, host_s, most, rng = (ClockFit(), NativeFit()), 0.0, 0, random.Random(1)
    for number in range(1, 60_000):
        host_s += 0.001 * (1 - rng.uniform(0.0, 2.5e-4) * (number // 250 % 2))
        for fit in fits:
            fit.arrived(number * 1000, host_s, 0.0)
        most = max(most, len(fits[0]._pieces))
        if not number % 50:
            both_say(fits, host_s)
    assert most == MOST_POINTS
