"""Figures of docs/view.md, from a headless browser, and its plot."""

from __future__ import annotations

import dataclasses
import statistics
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from contactfpga.driver import driver
from contactfpga.skin.sheet import Sheet
from contactfpga.tools.view import board_recording, opening, plot
from contactfpga.tools.view.opening import ServedView, View
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.view import browser

CLICKS = 20
PACED_S = 4.0
WAIT_S = 0.7
"""Time between clicks, long enough that they are no drag."""


def sheet_of(shown: ServedView) -> Sheet:
    assert isinstance(shown.view, View)
    return shown.view.stage.tiles.sheet


@dataclasses.dataclass(frozen=True)
class ProcessorLoad:
    """CPU time per second of board time."""

    board: float
    rest: float
    """Driver and view, without a browser."""


def load_of(shown: ServedView, fingers: Sequence[tuple[float, float]], seconds: float = PACED_S) -> ProcessorLoad:
    assert shown.hand is not None
    virtual: Any = shown.hand.board
    spent, read = [0.0], virtual.read

    def timed(wanted_s: float) -> bytes:
        started = time.thread_time()
        data: bytes = read(wanted_s)
        spent[0] += time.thread_time() - started
        return data

    for place in fingers:
        shown.hand.click(*place)
    virtual.read = timed
    began_s, began = virtual.clock(), time.thread_time()
    while virtual.clock() - began_s < seconds:
        shown.view.step()
    passed_s, used = virtual.clock() - began_s, time.thread_time() - began
    virtual.read = read
    shown.hand.lift()
    return ProcessorLoad(spent[0] / passed_s, (used - spent[0]) / passed_s)


def load_table(shown: ServedView) -> str:
    rows = [["on the sheet", "simulating the board", "driver and view", "both, of one core"]]
    for name, fingers in (("nothing", ()), ("two fingers", ((40.0, 40.0), (110.0, 90.0)))):
        load = load_of(shown, fingers)
        both = load.board + load.rest
        rows.append([name, *(f"{share:.0%}".replace("%", " %") for share in (load.board, load.rest, both))])
    return writer.table_of(rows)


def draw(images: Path) -> Path:
    """A finger that circles, recorded and drawn."""
    path = images / "plot.svg"
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "moving.rec"
        with driver.open("sim://?scene=moving", record=file) as board:
            while board.clock() < PLOTTED_S:
                board.next()
        plot.draw(board_recording.load(str(file)), path)
    return path


PLOTTED_S = 2.0


class ViewTimes(NamedTuple):
    loads: str
    drawn_s: list[float]
    """Time of each click from the mouse to the drawn zone."""


def compute() -> ViewTimes:
    """Open the view without a browser, then with one that clicks."""
    flat = opening.ViewRequest(flat=True)  # all of its cells can be clicked from one side
    with opening.opened(flat, http_port=0) as shown:
        loads = load_table(shown)
    with opening.opened(flat, http_port=0) as shown, browser.visit(shown) as visitor:
        return ViewTimes(loads, clicks(shown, visitor))


def clicks(shown: ServedView, visitor: browser.Visitor, count: int = CLICKS) -> list[float]:
    """Click cells in turn, and lift the finger in between."""
    sheet, found = sheet_of(shown), []
    assert shown.hand is not None
    for index in range(count):
        row, column = 2 + 5 * index % (sheet.rows - 4), 2 + 7 * index % (sheet.columns - 4)
        place = column * sheet.pitch_x_mm, row * sheet.pitch_y_mm
        visitor.watch(*place)
        visitor.click(*place)
        released, drawn = visitor.drawn_s()
        found.append(drawn - released)
        shown.hand.lift()
        visitor.page.wait_for_timeout(WAIT_S * 1e3)
    return found


def loads_table(times: ViewTimes) -> str:
    return times.loads


def clicks_text(times: ViewTimes) -> str:
    middle, worst = statistics.median(times.drawn_s), max(times.drawn_s)
    return f"{1e3 * middle:.0f} ms in the median, {1e3 * worst:.0f} ms at worst of {len(times.drawn_s)} clicks."
