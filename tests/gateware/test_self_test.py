"""The self-test: the gateware in lockstep with the golden model, and which faults show in which slot."""

import numpy as np
import pytest
from reversal import any_skin, small, touches

from contactfpga.skin import Skin
from contactfpga_hdl.scan import reversal, reversal_guard
from contactfpga_sim.board.received import Receiver
from contactfpga_sim.cosim import bench_amaranth
from contactfpga_sim.cosim.compare import compare
from contactfpga_sim.golden import Timeline, predict
from contactfpga_sim.golden import reversal as golden
from contactfpga_sim.golden import reversal_guard as golden_guard
from contactfpga_sim.golden.facts import facts
from contactfpga_sim.golden.request import command, request

SLOT = 1


@pytest.fixture
def soon(monkeypatch):
    """A sheet at rest is checked every 32 us, and what is told is renewed every 256 us."""
    monkeypatch.setattr(reversal, "RETRY_BIT", 8)
    monkeypatch.setattr(golden, "RETRY_US", 2**8)
    for module in (reversal, reversal_guard):
        monkeypatch.setattr(module, "CHECK_BIT", 5)
    monkeypatch.setattr(golden_guard, "CHECK_US", 2**5)


def asked(skin: Skin, rng, cycles: int) -> list[tuple[int, bytes]]:
    """Self-tests, other commands and requests, some of them back to back."""
    sent, cycle, number = [], rng.randrange(600), 129 * 128 + 1
    bit_clocks = facts(skin).bit_clocks
    while cycle < cycles:
        kind = rng.random()
        if kind < 0.75:
            data = command(number, 1 if kind < 0.65 else rng.choice([2, 3]), 0, kind < 0.1, bit_clocks)
        else:
            data = request(number, kind < 0.8, bit_clocks)
        sent.append((cycle, data))
        cycle += 10 * bit_clocks * len(data) + rng.choice([0, 1, rng.randrange(200), rng.randrange(4000)])
        number += 2 if number % 8 == 7 else 1
    return sent


def any_life(rng, skin: Skin, cycles: int) -> Timeline:
    return Timeline(touches(skin, rng, cycles).pieces, asked(skin, rng, cycles))


LOCKSTEP = [
    {"rows": 3, "columns": 4, "alive": True, "fail_safe": True, "mask": ((1, 1),)},
    {"rows": 2, "columns": 3, "diodes": "row2col", "guard": True, "alive": True, "fail_safe": True},
    {"rows": 3, "columns": 2, "report": "cells", "send": "always", "mask": ((0, 0), (0, 1)), "baud": 6_000_000},
    {"rows": 4, "columns": 2, "mask": ((0, 1), (1, 1), (2, 1), (3, 1)), "baud": 3_000_000},
]


@pytest.mark.parametrize("fields", LOCKSTEP, ids=lambda fields: f"{fields['rows']}x{fields['columns']}")
def test_the_whole_board_is_the_golden_models_in_every_clock(rng, soon, fields):
    """Self-tests are asked for at any time: at the start, in frames, in each other, while switches are pressed."""
    skin, cycles = small(**fields, self_test=True), 3000
    timeline = any_life(rng, skin, cycles)
    expected = predict(skin, timeline, cycles)
    assert compare(expected, bench_amaranth.run(skin, timeline, cycles)) > 150


@pytest.mark.campaign
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("seed", range(60))
def test_any_skin_with_a_self_test_is_the_golden_models_in_every_clock(rng, soon, seed):
    skin = any_skin(rng).replace(self_test=True, fail_safe=True, alive=True, guard=rng.random() < 0.5)
    cycles = 8000
    timeline = any_life(rng, skin, cycles)
    assert compare(predict(skin, timeline, cycles), bench_amaranth.run(skin, timeline, cycles)) > 100
