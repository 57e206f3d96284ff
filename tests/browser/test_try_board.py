"""The page's board is the native one: the same bytes by the page's scripts, which read in them what Python does."""

import json
from collections.abc import Iterable

import numpy as np
import pytest
from sample import sample
from try_page import assemble, kit, needs_node, node

from contactfpga.design import kits
from contactfpga_sim.model.board.compiled import CompiledBoard, model_of
from contactfpga_sim.model.board.receiver import frames_in

pytest.importorskip("amaranth")
pytestmark = needs_node

KIT = kits.kit(assemble.KIT)
CHUNK = 10_000  # frames in a line for Node
ODD = 643  # clocks, no multiple of a scan's: touches fall anywhere in one


def by_page(steps: list[dict]) -> tuple[bytes, list[int], dict]:
    """What the page's board sends, its cycle after each step, and what the page's decoder reads in it all."""
    given = "\n".join(map(json.dumps, steps))
    lines = node("board.mjs", str(assemble.BOARD), str(assemble.DECODER), kit(), given=given, timeout=7200).splitlines()
    *done, read = map(json.loads, lines)
    runs = [each for each in done if each]
    return bytes.fromhex("".join(each["bytes"] for each in runs)), [each["cycle"] for each in runs], read


def native(capture: Iterable[str] = ()) -> CompiledBoard:
    """The kit's board as native code; by itself a kit's board is the WebAssembly that is judged here."""
    return CompiledBoard(KIT.skin, capture, model_of(KIT.skin))


def held(frames: np.ndarray, cycles: int) -> dict:
    return {"frames": frames.astype(int).reshape(len(frames), -1).tolist(), "cycles": cycles}


def random_frames(count: int, seed: int) -> np.ndarray:
    """From nearly empty ones to nearly full ones."""
    rng = np.random.default_rng(seed)
    return rng.random((count, KIT.skin.rows, KIT.skin.columns)) < rng.choice([0.01, 0.05, 0.2, 0.5, 0.9], (count, 1, 1))


@pytest.mark.slow
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("count", sample([3000, 1_000_000], quick=[3000]))
def test_random_frames_give_the_native_boards_bytes(count, record_property):
    total = 0
    for seed, start in enumerate(range(0, count, 10 * CHUNK)):
        frames = random_frames(min(count - start, 10 * CHUNK), seed)
        with native() as board:
            board.hold(frames, ODD)
            expected = board.receive()
        found, _, read = by_page([held(frames[at : at + CHUNK], ODD) for at in range(0, len(frames), CHUNK)])
        assert found == expected
        # Dense frames take longer on the line than a scan, so the board replaces some before they are sent.
        assert len(read["frames"]) > len(frames) / 20
        total += len(found)
    record_property("cases", count)
    assert total > 15 * count  # as many as fit on the line


def test_the_pages_decoder_reads_what_python_reads():
    data, _, read = by_page([held(random_frames(2000, 5), ODD)])
    frames = [each.frame for each in frames_in(KIT.skin, enumerate(data))]
    assert [facts_of(frame) for frame in frames] == [
        (one["time_us"], one["cells"], one["count"], *map(place, one["zones"])) for one in read["frames"]
    ]
    assert sum(frame.zones for frame in frames) > 5000


def facts_of(frame) -> tuple:
    pitch_mm = KIT.skin.pitch_x_mm
    places = [(area, x / area * pitch_mm, y / area * pitch_mm) for area, x, y in frame.moments.tolist()]
    return (frame.time_us, frame.cells, frame.zones, *places)


def place(zone: dict) -> tuple:
    return zone["area"], zone["x_mm"], zone["y_mm"]


def test_times_of_a_touch_are_those_of_the_native_board():
    rng = np.random.default_rng(8)
    hold, touches = 3000, []
    for _ in range(30):
        cells = np.zeros((16, 16), bool)
        row, column = rng.integers(0, 14, 2)
        cells[row : row + 3, column : column + 2] = True
        touches.append((20_000 + int(rng.integers(0, 2000)), cells))
    given = json.dumps([(gap, cells.astype(int).ravel().tolist(), hold) for gap, cells in touches])
    found = json.loads(node("touches.mjs", str(assemble.BOARD), str(assemble.DECODER), kit(), given=given))
    with native(["contact"]) as board:
        starts = [touched(board, gap, cells, hold) for gap, cells in touches]
        pin = [int(event["cycle"]) for event in board.take("contact") if event["data"]]
        stream = [(int(event["cycle"]), int(event["data"])) for event in board.take("received")]
    reported = [each for each in frames_in(KIT.skin, stream) if each.frame.cells == 6 and each.frame.zones == 1]
    last = [next(each.last for each in reported if each.last > start) for start in starts]
    assert found == [list(times) for times in zip(starts, pin, last, strict=True)]


def touched(board: CompiledBoard, gap: int, cells: np.ndarray, hold: int) -> int:
    """Touch and let go; returns the cycle of the touch."""
    board.run(gap)
    start = board.cycle
    board.hold(np.array([cells, np.zeros_like(cells)]), hold)
    return start


def test_broken_lines_are_named_as_the_page_breaks_them():
    quiet = np.zeros((1, 16, 16), bool)
    steps = [held(quiet, 20_000), {"cut": [[[5, 9]], [[3, 2]]]}, held(quiet, 9000), {"stick": [7]}, held(quiet, 9000)]
    _, _, read = by_page(steps)
    opened = ["row 5 is open before its far end", "column 3 is open before its far end"]
    assert opened in read["faults"]
    assert read["faults"][-1] == [*opened, "column 7 reads pressed while no row is driven"]
