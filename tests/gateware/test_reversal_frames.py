"""Line reversal on the compiled board of ``examples/fast.toml``: frames of a sheet held still, and the contact pin."""

import itertools

import numpy as np
import pytest
from reversal import FAST, slots, zones

from contactfpga.skin.derived import Derived
from contactfpga_sim.board.compiled import CompiledBoard
from contactfpga_sim.board.received import Receiver
from contactfpga_sim.golden import Timeline, predict

CLOCKS_PER_US = FAST.clock_hz // 1_000_000
PROJECT, SETTLE, ROW = 24, 12, 20  # clocks: 1 us, 0.5 us, and 0.75 us with a gap of a clock on either side
EMPTY = np.zeros((FAST.rows, FAST.columns), bool)
DRAWS = (1 << np.arange(9)).reshape(3, 3)


@pytest.fixture(scope="module")
def sheet():
    with CompiledBoard(FAST, ("rows", "records", "bytes", "driven", "contact")) as board:
        board.run(20_000)
        yield board


def drop(board: CompiledBoard) -> None:
    for boundary in ("rows", "records", "bytes", "driven", "contact", "received"):
        board.take(boundary)


def let_go(board: CompiledBoard) -> None:
    board.press(EMPTY)
    board.run(3000)
    drop(board)


def draw(pattern: int, y: int, x: int) -> np.ndarray:
    """A 3x3 pattern at a place of the sheet."""
    cells = EMPTY.copy()
    cells[y : y + 3, x : x + 3] = (pattern & DRAWS) != 0
    return cells


def touched(board: CompiledBoard, cells: np.ndarray, clocks: int = 1500):
    """Press; returns the cycle of the touch, the slots, and the frames that were received."""
    let_go(board)
    touch = board.cycle
    board.press(cells)
    board.run(clocks)
    driven = [(int(event["cycle"]), int(event["data"])) for event in board.take("driven")]
    events = board.take("bytes")
    received = list(Receiver(FAST).take(zip(events["cycle"].tolist(), events["data"].tolist())))
    return touch, slots(driven, board.cycle), received


def test_every_3x3_frame_held_still_is_reported_exactly_in_a_slot_per_row(sheet, rng, record_property):
    """Each at some place of the sheet, after a rest of any length. The touch is seen after two clocks, the rows are
    sampled a projection time later, and driven one after the other in ascending order from the sixth clock after
    that."""
    for pattern in range(1, 512):
        cells = draw(pattern, rng.randrange(FAST.rows - 2), rng.randrange(FAST.columns - 2))
        sheet.run(rng.randrange(500))
        touch, driven, received = touched(sheet, cells)
        rows = np.flatnonzero(cells.any(axis=1)).tolist()
        first = touch + PROJECT + 6
        wanted = [(row, first + ROW * place, first + ROW * place + SETTLE - 1) for place, row in enumerate(rows)]
        assert [(slot.row, slot.begin, slot.sample) for slot in driven][: len(rows)] == wanted
        assert len(received) == 1, "no frame is sent twice"
        frame = received[0].frame
        assert frame.cells == cells.sum()
        assert sorted(map(tuple, frame.moments.tolist())) == zones(cells, FAST.connectivity)
    record_property("cases", 511)


@pytest.mark.parametrize("rows", range(1, 17))
def test_the_last_byte_comes_a_fixed_number_of_clocks_after_the_last_sample(sheet, rows):
    """A zone of one column: a record of 4 bytes more than nothing, 16 in all, or 17 with one that is stuffed."""
    cells = EMPTY.copy()
    cells[:rows, 5] = True
    touch, driven, received = touched(sheet, cells, 3000)
    sample = driven[rows - 1].sample
    assert sample == touch + PROJECT + 6 + (rows - 1) * ROW + SETTLE - 1
    one = received[0]
    pipeline = one.last - (one.size - 1) * 10 * Derived(FAST).bit_clocks - sample
    print(rows, one.size, pipeline)
