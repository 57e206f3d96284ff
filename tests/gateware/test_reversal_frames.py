"""Line reversal on the compiled board of ``examples/fast.toml``: frames of a sheet held still, and the contact pin."""

import itertools

import numpy as np
import pytest
from reversal import FAST, slots
from zone_oracles import zones_by_scipy

from contactfpga_sim.model.board.compiled import CompiledBoard
from contactfpga_sim.model.board.receiver import Receiver

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


def wanted_slots(touch: int, cells: np.ndarray) -> list[tuple[int, int, int]]:
    """(row, first clock, last clock) in which each touched row is driven."""
    found, begin = [], touch + PROJECT + 6
    rows = np.flatnonzero(cells.any(axis=1)).tolist()
    for row, following in itertools.zip_longest(rows, rows[1:]):
        found.append((row, begin, begin + SETTLE - 1))
        runs = int((np.diff(cells[row].astype(int)) == 1).sum())
        apart = following is not None and following != row + 1
        begin += ROW + apart * runs  # the empty row after it waits for the labeller
    return found


def test_every_3x3_frame_held_still_is_reported_exactly_in_a_slot_per_row(sheet, rng, record_property):
    """Each 3x3 frame at some place of the sheet, after a rest of any length. The touch is seen after two clocks, rows
    are sampled a projection time later, and driven one after the other in ascending order from the sixth clock after
    that. The next frame, of the same cells, is not sent."""
    for pattern in range(1, 512):
        cells = draw(pattern, rng.randrange(FAST.rows - 2), rng.randrange(1, FAST.columns - 2))
        sheet.run(rng.randrange(500))
        touch, driven, received = touched(sheet, cells)
        rows = int(cells.any(axis=1).sum())
        assert [(slot.row, slot.begin, slot.sample) for slot in driven][:rows] == wanted_slots(touch, cells)
        assert driven[rows].row == driven[0].row, "then the next frame begins"
        assert len(received) == 1, "no frame is sent twice"
        frame = received[0].frame
        assert frame.cells == cells.sum()
        assert sorted(map(tuple, frame.moments.tolist())) == zones_by_scipy(cells, FAST.connectivity)
    record_property("cases", 511)


# ---- the order in which zones are reported, overflow, bitmaps: as with raster


# ---- the contact pin


def test_contact_rises_three_clocks_after_a_touch_anywhere_at_any_instant(sheet, record_property):
    rng = np.random.default_rng(5)
    for y, x in itertools.product(range(FAST.rows), range(FAST.columns)):
        cells = EMPTY.copy()
        cells[y, x] = True
        let_go(sheet)
        sheet.run(int(rng.integers(1, 100)))
        touch = sheet.cycle
        sheet.press(cells)
        sheet.run(150)
        assert sheet.take("contact")["cycle"].tolist() == [touch + 3]
        sheet.press(EMPTY)
        released = sheet.cycle
        sheet.run(200)
        (fall,) = sheet.take("contact").tolist()
        # The frame under way may still have it, and takes a projection and a slot; the next one has not.
        assert fall[1] == 0
        assert released < fall[0] <= released + 2 * (PROJECT + ROW) + 60
    record_property("cases", FAST.rows * FAST.columns)


# ---- pauses


def frames_in(board: CompiledBoard, clocks: int) -> list:
    """Frames in the next clocks."""
    board.take("bytes")
    board.run(clocks)
    events = board.take("bytes")
    return list(Receiver(FAST).take(zip(events["cycle"].tolist(), events["data"].tolist())))


def test_an_untouched_sheet_is_kept_alive_in_time_and_not_much_earlier(sheet):
    """The longest pause between two frames is at most ``keep_alive_ms`` and at least that less four turns of 1.024 ms;
    a change in between begins it again."""
    let_go(sheet)
    longest = round(FAST.keep_alive_ms * 24_000)
    found = frames_in(sheet, 2 * longest + 1000)
    sheet.press(draw(511, 2, 2))
    changed = sheet.cycle
    more = frames_in(sheet, longest)
    ends = [one.last for one in found]
    assert len(found) == 2
    assert 0.95 * longest < ends[1] - ends[0] <= longest
    assert [one.frame.cells for one in more] == [9, 9]
    assert more[0].last < changed + 600
    assert 0.95 * longest < more[1].last - more[0].last <= longest
