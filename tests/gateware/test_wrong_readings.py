"""Line reversal: a column that reads pressed when it should not, for a few clocks or for long, costs no touch for long.

An undriven column with a pressed switch reads pressed, too, as in a real sheet; the simulated one shows that.
"""

import itertools
import random
import sys

import numpy as np
import pytest
from reversal import FAST, any_skin, checked_soon, noted_pins, small
from sample import sample

from contactfpga.skin import Skin
from contactfpga_hdl.link import alive
from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.board.receiver import frames_in
from contactfpga_sim.model.golden import Timeline, predict, requests
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.sheet.matrix import Matrix
from contactfpga_sim.verify.cosim import bench_amaranth, bench_native
from contactfpga_sim.verify.cosim.compare import compare

NOTHING = np.zeros((FAST.rows, FAST.columns), bool)
PROJECT = facts(FAST).project
SEEN = 3
"""Clocks from a touch of a sheet at rest to ``contact``."""
LONGEST = 8
"""Clocks of a wrong reading."""


def columns(*pressed: int) -> np.ndarray:
    return np.isin(np.arange(FAST.columns), pressed)


def cell(row: int, column: int) -> np.ndarray:
    cells = NOTHING.copy()
    cells[row, column] = True
    return cells


def rises(pieces: list, cycles: int) -> list[int]:
    """Cycles in which ``contact`` of the compiled board rises."""
    return [cycle for cycle, level in bench_native.run(FAST, Timeline(pieces), cycles).contact if level]


def spaced(trials, period: int) -> tuple[list, list[int]]:
    """Trials that begin every so many clocks: the changes of the sheet, and the clock in which each touch begins."""
    pieces, touches = [], []
    for number, trial in enumerate(trials, 1):
        for after, cells, stuck in trial:
            pieces.append((number * period + after, cells, stuck))
            if cells.any() and not (len(pieces) > 1 and pieces[-2][1].any()):
                touches.append(number * period + after)
    return pieces, touches


@pytest.mark.parametrize("length", sample(range(1, LONGEST + 1), quick=[1, 8], slow=range(2, 8)))
def test_at_rest_a_wrong_reading_delays_contact_by_no_more_than_it_lasts(length):
    """A wrong reading of any column, at any time around a touch of it, delays ``contact`` by at most its length; a
    touch 10 us later is not delayed."""
    trials = []
    for column, after in itertools.product(range(FAST.columns), [*range(-length, PROJECT + 2, 3), 240]):
        touched = cell(column // 3, column)
        moments = {0: (NOTHING, columns(column)), length: (NOTHING, None), after: (touched, None)}
        if -length < after < length:  # they overlap
            moments[max(after, 0)] = (touched, columns(column))
            moments[length] = (touched, None)
            if after < 0:
                moments[after] = (touched, None)
        moments[after + 60] = (NOTHING, None)
        trials.append([(moment + 20, *state) for moment, state in sorted(moments.items())])
    pieces, touches = spaced(trials, 1200)
    found = rises(pieces, (len(trials) + 1) * 1200)
    assert len(found) == len(touches) == len(trials)
    late = [rise - touch - SEEN for rise, touch in zip(found, touches, strict=True)]
    assert 0 <= min(late) <= max(late) <= length < PROJECT


@pytest.mark.parametrize("length", sample(range(1, LONGEST + 1), quick=[1, 8], slow=range(2, 8)))
def test_a_wrong_reading_at_any_time_of_a_frame_leaves_the_next_touch_as_it_was(length):
    """A fingertip makes one frame after the other. It is lifted; the column that was wrong is touched later."""
    finger = NOTHING.copy()
    finger[4:6, 9:11] = True
    frame = 700  # clocks, and more
    step = 11 if length in (1, LONGEST) else 5
    trials = []
    for phase in range(0, frame, step):
        column = phase // step % FAST.columns
        trial = [(0, finger, None), (400 + phase, finger, columns(column)), (400 + phase + length, finger, None)]
        trials.append([*trial, (1200, NOTHING, None), (2400, cell(12, column), None), (2460, NOTHING, None)])
    pieces, touches = spaced(trials, 3600)
    found = rises(pieces, (len(trials) + 1) * 3600)
    for touch in touches[1::2]:
        assert [rise for rise in found if touch - 300 < rise < touch + 300] == [touch + SEEN]


@pytest.mark.slow  # a board of its own; the compiled board over three tries is the golden model's below
def test_a_column_that_stays_low_costs_its_own_cells_is_reported_and_is_tried_every_66_ms():
    """A column is low for 300 ms while others are touched. Its cells return after the first try that finds it whole."""
    ms, rng = FAST.clock_hz // 1000, np.random.default_rng(7)
    short, end = columns(5), 370
    touched = {at: (int(rng.integers(16)), int(rng.choice([0, 1, 3, 7, 9, 15]))) for at in range(10, 300, 2)}
    pieces = [(5 * ms, NOTHING, short)]
    for at, place in touched.items():
        pieces += [(at * ms, cell(*place), short), ((at + 1) * ms, NOTHING, short)]
    pieces += [(301 * ms, NOTHING, None), ((end - 1) * ms, cell(2, 5), None)]
    board = CompiledBoard(FAST, capture=["charged", "contact"])
    with board:
        bench_native.play(board, Timeline(pieces), end * ms)
        received, charged, contact = (board.take(name) for name in ("received", "charged", "contact"))
    rose = [int(cycle) for cycle, level, _ in contact.tolist() if level]
    assert rose == [at * ms + SEEN for at in (*touched, end - 1)]
    frames = list(frames_in(FAST, ((int(at), int(byte)) for at, byte, _ in received.tolist())))
    for at, (row, column) in touched.items():
        last = [one.frame for one in frames if at * ms < one.first < (at + 1) * ms][-1]
        assert sorted(map(tuple, last.moments)) == sorted([(1, column, row), (1, 5, row)])
        assert "fault" in last.flags
    assert frames[-1].frame.flags == frozenset()
    driven = [int(cycle) for cycle, word, _ in charged.tolist() if word >> 5 & 1 and 6 * ms < cycle < 301 * ms]
    period = 2**16 * facts(FAST).clocks_per_us
    tries = [list(group) for _, group in itertools.groupby(driven, lambda cycle: cycle // period)]
    assert [round(group[0] * 1000 / FAST.clock_hz) for group in tries] == [66, 131, 197, 262]
    assert max(group[-1] - group[0] for group in tries) < ms // 5


def test_at_rest_a_column_that_goes_low_is_known_at_once(soon, pins):
    """Without guard lines, ``contact`` is high and a frame reports the column as soon as it is released, though nothing
    is touched. Another column is touched meanwhile. Once the column is whole, all is as before."""
    skin, low = small(fail_safe=True, alive=True), np.arange(4) == 2
    nothing, touched = np.zeros((3, 4), bool), np.zeros((3, 4), bool)
    touched[1, 0] = True
    pieces = [(5_000, nothing, low), (6_000, touched, low), (6_300, nothing, low), (6_500, nothing, None)]
    trace = bench_amaranth.run(skin, Timeline(pieces), 10_000)
    let_go = [cycle for cycle, levels in enumerate(pins) if cycle > 5_000 and not levels["columns_drive"] >> 2 & 1]
    frames = list(frames_in(skin, trace.bytes))
    first, *others = (one for one in frames if one.first > 5_000)
    renewed = next(one for one in others if "fault" not in one.frame.flags)
    (rise, high), (fall, _) = trace.contact
    project = facts(skin).project
    assert high
    assert 0 <= rise - let_go[0] <= project
    assert ("fault" in first.frame.flags, first.frame.moments.tolist()) == (True, [])
    assert first.first - rise < 40
    assert [(1, 0, 1), (1, 2, 1)] in [sorted(map(tuple, one.frame.moments)) for one in others]
    assert 64 * 24 * 5 < fall < 64 * 24 * 5 + 3 * 64 + project, "tried after 320 us"
    assert 0 < renewed.first - fall < 40
    turns = [cycle for cycle, _ in trace.alive]
    assert not any(rise <= turn < fall for turn in turns)
    assert {turn // 480 for turn in turns} >= {*range(1, rise // 480), *range(fall // 480 + 2, 10_000 // 480)}


def any_history(rng: random.Random, skin: Skin, cycles: int) -> Timeline:
    """Touches, columns that are wrong for up to 8 clocks, and some that stay so for any time."""
    pieces, start = [], rng.randrange(100)
    cells, stuck = np.zeros((skin.rows, skin.columns), bool), np.zeros(skin.column_lines, bool)
    while start < cycles:
        kind = rng.random()
        if kind < 0.5:
            wrong = np.array([rng.random() < 0.4 for _ in range(skin.column_lines)])
            pieces.append((start, cells, stuck | wrong))
            start += rng.randint(1, LONGEST)
        elif kind < 0.6:
            stuck = np.array([rng.random() < 0.3 for _ in range(skin.column_lines)]) & (rng.random() < 0.5)
        else:
            cells = np.zeros_like(cells)
            if kind < 0.8:
                y, x = rng.randrange(skin.rows), rng.randrange(skin.columns)
                cells[y : y + rng.randint(1, 2), x : x + rng.randint(1, 2)] = True
        pieces.append((start, cells, stuck))
        start += rng.randint(1, rng.choice([5, 60, 900]))
    return Timeline(pieces, requests(sorted(rng.sample(range(cycles), 3)), facts(skin).bit_clocks))


@pytest.fixture
def soon(monkeypatch):
    """Columns are tried every 64 us, a sheet at rest is checked every 16 us, and ``alive`` toggles every 20 us."""
    checked_soon(monkeypatch, check_bit=4, retry_bit=6)
    for module in (alive, sys.modules[predict.__module__]):
        monkeypatch.setattr(module, "TICK_US", 20)


@pytest.fixture
def pins(monkeypatch):
    return noted_pins(monkeypatch)


KINDS = [
    {"mask": ((0, 1), (1, 1), (2, 1)), "diodes": "row2col", "precharge_us": 1.2, "fail_safe": True, "alive": True},
    {"send": "always", "debounce": "sym_defer_pk", "debounce_press_us": 7.0, "debounce_release_us": 12.0},
    {"guard": True, "fail_safe": True, "alive": True},
    {"guard": True, "send": "always", "diodes": "row2col", "self_test": True, "project_us": 0.05, "precharge_us": 1.2},
]


@pytest.mark.parametrize("number", sample(range(len(KINDS)), quick=[0, 2], slow=[1, 3]))
def test_random_histories_are_the_golden_models_in_every_clock(soon, rng, number):
    skin, cycles = small(**KINDS[number]), 5000
    timeline = any_history(rng, skin, cycles)
    assert compare(predict(skin, timeline, cycles), bench_amaranth.run(skin, timeline, cycles)) > 400


@pytest.mark.campaign
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("seed", range(100))
def test_any_skin_is_the_golden_models_in_every_clock(soon, seed):
    rng = random.Random(seed)
    skin, cycles = any_skin(rng).replace(guard=rng.random() < 0.5, self_test=rng.random() < 0.3), 9000
    timeline = any_history(rng, skin, cycles)
    assert compare(predict(skin, timeline, cycles), bench_amaranth.run(skin, timeline, cycles)) > 400


def test_the_compiled_board_is_the_golden_models_in_every_clock_over_three_tries(rng):
    """Wrong for 50 us, then touched: the switch pulls the column as if it still were, until it is tried."""
    ms = FAST.clock_hz // 1000
    pieces = [(20 * ms, NOTHING, columns(3)), (20 * ms + 1200, NOTHING, None), (21 * ms, cell(1, 3), None)]
    pieces += [(66 * ms, NOTHING, columns(3, 8)), (100 * ms, cell(2, 9), columns(8)), (101 * ms, NOTHING, None)]
    timeline = Timeline(pieces)
    expected = predict(FAST, timeline, 140 * ms)
    assert compare(expected, bench_native.run(FAST, timeline, 140 * ms)) > 200
    assert 65 * ms < expected.contact[0][0] < 66 * ms


def test_an_undriven_column_is_pulled_by_a_row_that_is_let_go_and_that_nothing_lifts():
    skin = small(rows=2, columns=3)
    matrix, every = Matrix(skin), 0b111
    matrix.press(np.array([[1, 1, 0], [0, 0, 1]], bool))
    assert matrix.levels(0b11, 0, 0b000) == every ^ 0b111, "nothing is driven"
    assert matrix.levels(0b11, 0, 0b111) == every
    assert matrix.levels(0b11, 0, 0b110) == every, "column 1 lifts row 0"
    assert matrix.levels(0b11, 0, 0b011) == every ^ 0b100
    assert matrix.levels(0b11, 0b11, 0b000) == every, "rows are held at the released level"
    matrix.press(np.array([[1, 1, 0], [0, 0, 1]], bool), np.array([0, 1, 0], bool))
    assert matrix.levels(0b11, 0, 0b110) == every ^ 0b011, "a stuck column lifts nothing"
