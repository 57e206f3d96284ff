"""Samples at a multiple of the clocks in which the columns fall through the ruler.

What only this kills: a ruler that counts a clock too many or too few, that waits for a column reported open or masked,
or that reads a level, a lost ruler or a late fall otherwise than the golden model, whose cells close at any clock; a
frame that names a command and does not obey it; with several levels, a sample left out, taken twice, or counted for
another level or row.
"""

import numpy as np
import pytest
from sample import sample

from contactfpga import Skin
from contactfpga_sim.model.board.receiver import frames_in
from contactfpga_sim.model.golden import Timeline, predict
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.request import command
from contactfpga_sim.model.golden.trace import Cuts
from contactfpga_sim.verify.cosim import bench_amaranth
from contactfpga_sim.verify.cosim.compare import compare

TINY = {"clock_hz": 1_000_000, "baud": 250_000, "guard": True, "precharge_us": 2, "release_us": 4}
SKINS = {
    "zones": Skin(rows=3, columns=4, ruler=32, settle_us=24, **TINY),
    "cells, masked": Skin(rows=2, columns=3, ruler=20, report="cells", mask=((0, 1), (1, 1)), settle_us=20, **TINY),
    "one row, mirrored": Skin(rows=1, columns=2, ruler=8, diodes="row2col", fail_safe=True, settle_us=30, **TINY),
    "settles at once": Skin(rows=2, columns=2, ruler=240, report="cells", settle_us=10, **TINY),
    "levels": Skin(
        rows=3, columns=5, ruler=60, harder=(15, 3), report="cells", mask=((0, 1), (2, 4)), settle_us=24, **TINY
    ),
    "two levels, mirrored": Skin(
        rows=2,
        columns=3,
        ruler=24,
        harder=(6,),
        report="cells",
        diodes="row2col",
        settle_us=24,
        row_drive="74hc595",
        dual=True,
        fail_safe=True,
        alive=True,
        **TINY,
    ),
    "levels on change": Skin(
        rows=2,
        columns=2,
        ruler=30,
        harder=(12, 2),
        report="cells",
        send="on_change",
        keep_alive_ms=0.6,
        row_order=(1, 0),
        column_order=(1, 0),
        units=1,
        settle_us=26,
        **TINY,
    ),
    "shift registers": Skin(rows=4, columns=2, ruler=20, row_drive="74hc595", alive=True, settle_us=30, **TINY),
}


def falling(skin: Skin, rng: np.random.Generator, frames: int) -> Timeline:
    """In each slot columns read pressed from a random clock on: columns cut from the guard row, and cells, until then.
    Sometimes a column never does, for several frames; levels are commanded at any time."""
    known, cuts, pieces, received, broken = facts(skin), {}, {}, [], np.zeros(skin.columns, bool)
    for frame in range(frames):
        start = known.first_slot + frame * known.scan_clocks
        if rng.random() < 0.15:
            late = frame > 2 * frames // 3  # what is reported open stays so for longer than this test
            broken = rng.random(skin.columns) < rng.choice([0, 0.4, 1]) * (late | (np.arange(skin.columns) == 0))
        last = known.settle + 2 if rng.random() < 0.1 else 1 + known.settle // 2
        fall = np.where(broken, known.row_clocks, rng.integers(0, last, skin.columns))
        for clock in (-1, *{*fall.tolist()}):
            cuts[max(0, start + clock)] = Cuts({}, dict.fromkeys(np.flatnonzero(fall > clock).tolist(), skin.rows))
        for at in range(start + known.row_clocks, start + known.scan_clocks, known.row_clocks):
            # In one frame the guard column is cut after the sample and before the settle time ends.
            cuts[at + (known.settle - 2 if frame == 3 else -1)] = Cuts(
                {0: skin.columns} if frame == 3 or rng.random() < 0.05 else {}
            )
            close = rng.integers(0, known.settle + 3, skin.columns)
            pieces |= {at + clock: np.tile(close <= clock, (skin.rows, 1)) for clock in (-1, *close.tolist())}
    at = 10 * known.scan_clocks
    values = [0, 1, 12, 23, 24, 64, 255, 256] if skin.levels == 1 else [0, 24, 255, 256, 296, 512 + 5, 512, 768 + 9]
    for number, value in enumerate(rng.permutation(values).tolist(), 129 * 128 + 1):
        received.append((at, command(number, 2, value, False, known.bit_clocks)))
        at += 140 * known.bit_clocks + int(rng.integers(10, 4 * known.scan_clocks))
    return Timeline(
        [(at, pieces[at], None) for at in sorted(pieces)], received, [(at, cuts[at]) for at in sorted(cuts)]
    )


def in_row(skin: Skin, row: int) -> list[int]:
    bits = skin.levels.bit_length()
    return [row >> bits * column & (1 << bits) - 1 for column in range(skin.columns)]


@pytest.mark.parametrize(
    "name", sample(SKINS, quick=["zones", "cells, masked", "settles at once", "levels"], slow=["shift registers"])
)
def test_each_frame_is_sampled_where_the_golden_model_says(name):
    skin, frames = SKINS[name], 90
    timeline = falling(skin, np.random.default_rng(len(name)), frames)
    cycles = frames * facts(skin).scan_clocks
    expected = predict(skin, timeline, cycles)
    plain = predict(skin.replace(ruler=255 if skin.ruler < 200 else 8), timeline, cycles)
    assert {cell for _, row, _ in expected.rows for cell in in_row(skin, row)} == {*range(skin.levels + 1)}
    assert [row[1] for row in expected.rows] != [row[1] for row in plain.rows], "no sample was moved"
    assert compare(expected, bench_amaranth.run(skin, timeline, cycles)) > 100


def test_the_first_frame_that_names_a_command_is_sampled_as_it_asks():
    """Also if the command arrives in the guard row's slot, in which the ruler is measured."""
    skin = Skin(rows=1, columns=2, ruler=8, report="cells", settle_us=400, **TINY)
    known, fall = facts(skin), 80
    pieces, cuts = [], []
    for slot in range(20):
        start, guard = known.first_slot + slot * known.row_clocks, slot % 2 == 0
        closed = np.full((1, 2), not guard)
        pieces += [(start, ~np.ones((1, 2), bool), None), (start + fall, closed, None)]
        cuts += [(start, Cuts({}, {0: 1, 1: 1} if guard else {})), (start + fall, Cuts({}))]
    for at in range(2 * known.scan_clocks, 4 * known.scan_clocks, 37):
        sent = [(at, command(5, 2, 32, False, known.bit_clocks))]
        trace = predict(skin, Timeline(pieces, sent, cuts), 10 * known.scan_clocks)
        frames = [one.frame for one in frames_in(skin, trace.bytes)]
        asked = [frame.bitmap.all() for frame in frames if frame.heard == 5]
        assert not any(frame.bitmap.any() for frame in frames if frame.heard != 5)
        assert len(asked) > 3
        assert all(asked), f"a command whose first bit comes in clock {at}"
