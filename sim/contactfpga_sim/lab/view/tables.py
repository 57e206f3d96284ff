"""Figures and pictures of docs/view.md, from a headless browser."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import io
import math
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from contactfpga.driver import driver
from contactfpga.driver.link import Link
from contactfpga.skin.sheet import Sheet
from contactfpga.tools.view import opening, plot, replayed
from contactfpga.tools.view.cameras import Side
from contactfpga.tools.view.opening import ServedView, View
from contactfpga.zones.batch import Batch
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.view import browser

CLICKS = 20
PACED_S = 4.0
WAIT_S = 0.7
"""Time between clicks, long enough that they are no drag."""


@dataclasses.dataclass(frozen=True)
class Click:
    """Times of a click, in s of ``time.time()``, with those spent in board and driver."""

    released: float
    touched: float
    """Finger on the virtual board."""
    gateware_s: float
    """Time from touch to last byte of its first frame."""
    driver_s: float
    """Time from bytes to zones."""
    read: float
    queued: float
    """The zones leave for the browser."""
    drawn: float

    @property
    def parts_s(self) -> dict[str, float]:
        board = self.read - self.touched
        return {
            "browser and viser: from the mouse to the view": self.touched - self.released,
            "gateware and wire, board time": self.gateware_s,
            "driver: bytes to zones": self.driver_s,
            "view: waiting for its next update, and simulating up to it": board - self.gateware_s - self.driver_s,
            "view: what to draw": self.queued - self.read,
            "viser and browser: until it is drawn": self.drawn - self.queued,
            "all": self.drawn - self.released,
        }


class Stopwatch:
    """Notes a click's passage through the view."""

    def __init__(self, shown: ServedView):
        assert shown.hand is not None
        assert isinstance(shown.view, View)
        self._stage = shown.view.stage
        self.times: dict[str, float] = {}
        self._shown = shown
        self._virtual: Any = shown.hand.board
        self._driver_s = 0.0

    @contextlib.contextmanager
    def running(self) -> Iterator[None]:
        """In this block the steps of a click are wrapped."""
        source = self._shown.source
        wrapped: list[tuple[Any, str, Callable[..., Any]]] = [
            (self._virtual, "touch", self._touch),
            (Link, "_take", self._take),
            (source, "frames", self._frames),
            (source, "poll", self._poll),
            (self._stage, "draw", self._draw),
        ]
        with contextlib.ExitStack() as stack:
            for where, name, noted in wrapped:
                kept = getattr(where, name)
                stack.callback(setattr, where, name, kept)
                setattr(where, name, functools.partial(noted, kept) if where is not Link else _method(noted, kept))
            yield

    def _touch(self, touch: Any, fingers: Any) -> None:
        if fingers:
            self.times = {"touched": time.time(), "clock": self._virtual.clock()}
        touch(fingers)

    def _take(self, take: Any, link: Any, data: bytes) -> None:
        started = time.thread_time()
        take(link, data)
        self._driver_s += time.thread_time() - started

    def _frames(self, frames: Any, *args: Any) -> Batch:
        batch: Batch = frames(*args)
        closed = batch.frames[batch.frames["pressed"] > 0]
        if len(closed) and "clock" in self.times:
            self.times.setdefault("arrived", float(closed["arrived_s"][0]))
        return batch

    def _poll(self, poll: Any) -> Any:
        self._driver_s = 0.0
        moment = poll()
        if moment is not None and len(moment.zones) and "arrived" in self.times and "read" not in self.times:
            self.times |= {"read": time.time(), "driver": self._driver_s}
        return moment

    def _draw(self, draw: Any, moment: Any) -> None:
        draw(moment)
        if "read" in self.times:
            self.times.setdefault("queued", time.time())


def _method(noted: Any, kept: Any) -> Any:
    return lambda *args: noted(kept, *args)


def sheet_of(shown: ServedView) -> Sheet:
    assert isinstance(shown.view, View)
    return shown.view.stage.tiles.sheet


def clicks(shown: ServedView, visitor: browser.Visitor, count: int = CLICKS) -> list[Click]:
    """Click cells in turn, and lift the finger in between."""
    watch, sheet, found = Stopwatch(shown), sheet_of(shown), []
    assert shown.hand is not None
    with watch.running():
        for index in range(count):
            row, column = 2 + 5 * index % (sheet.rows - 4), 2 + 7 * index % (sheet.columns - 4)
            place = column * sheet.pitch_x_mm, row * sheet.pitch_y_mm
            visitor.watch(*place)
            visitor.click(*place)
            released, drawn = visitor.drawn_s()
            took = watch.times
            gateware_s = took["arrived"] - took["clock"]
            found.append(
                Click(released, took["touched"], gateware_s, took["driver"], took["read"], took["queued"], drawn)
            )
            shown.hand.lift()
            visitor.page.wait_for_timeout(WAIT_S * 1e3)
    return found


def click_table(found: list[Click]) -> str:
    rows = [["from the click to the drawn zone", "median", "worst"]]
    for name in found[0].parts_s:
        values = [click.parts_s[name] * 1e3 for click in found]
        rows.append([name, f"{statistics.median(values):.1f} ms", f"{max(values):.1f} ms"])
    return writer.table_of(rows)


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


FRAMES, FRAME_MS = 32, 120
"""Frames of the clip, and their duration."""
SWING_RAD = 0.22
STEP_MS = 350
"""Time to follow a frame."""
QUALITY = 50


@dataclasses.dataclass(frozen=True)
class Shot:
    """Content of a clip frame."""

    strokes: tuple[float, float]
    """Moving finger, in columns and rows."""
    presses: bool
    turn_rad: float


def shot(share: float) -> Shot:
    """A moment of the clip, 0 to 1: the finger circles once while the camera swings once."""
    turn = 2 * math.pi * share
    place = 2.2 - 1.5 * math.cos(turn), 6.5 - 3.8 * math.sin(turn)
    return Shot(place, 0.3 < share < 0.75, SWING_RAD * math.sin(turn))


def play(shown: ServedView, visitor: browser.Visitor, one: Shot) -> None:
    """Move fingers and camera, and wait until drawn."""
    hand, view, sheet = shown.hand, shown.view, sheet_of(shown)
    assert hand is not None
    assert isinstance(view, View)
    hand.drag("strokes", one.strokes[0] * sheet.pitch_x_mm, one.strokes[1] * sheet.pitch_y_mm)
    if one.presses:
        hand.drag("presses", PRESSED[0] * sheet.pitch_x_mm, PRESSED[1] * sheet.pitch_y_mm)
    else:
        hand.drop("presses")
    first = view.cameras.sides["overview"]
    axis = first.up / np.linalg.norm(first.up)
    aside = np.cross(axis, first.toward)
    along = (first.toward @ axis) * axis
    toward = along + math.cos(one.turn_rad) * (first.toward - along) + math.sin(one.turn_rad) * aside
    (client,) = shown.web.get_clients().values()
    view.cameras.look(client.camera, Side(toward, first.up))
    visitor.page.wait_for_timeout(STEP_MS)


PRESSED = 0.4, 11.6


def record(shown: ServedView, visitor: browser.Visitor, image: Path, clip: Path) -> None:
    """A picture, and a clip that begins with it."""
    from PIL import Image

    browser.tidy(visitor)
    for share in (0.4, 0.45):  # the panel is written four times a second
        play(shown, visitor, shot(share))
    visitor.page.wait_for_timeout(3 * STEP_MS)
    visitor.page.screenshot(path=str(image))
    frames = []
    for number in range(-2, FRAMES):
        play(shown, visitor, shot((0.45 + number / FRAMES) % 1))
        frames.append(Image.open(io.BytesIO(visitor.page.screenshot())).convert("RGB"))
    first, *rest = frames[2:]
    first.save(clip, save_all=True, append_images=rest, duration=FRAME_MS, loop=0, quality=QUALITY)


def plotted(path: Path) -> None:
    """A finger that circles, recorded and drawn."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "moving.rec"
        with driver.open("sim://?scene=moving", record=file) as board:
            while board.clock() < PLOTTED_S:
                board.next()
        plot.draw(replayed.load(str(file)), path)


PLOTTED_S = 2.0


class ViewTimes(NamedTuple):
    loads: str
    found: list[Click]


def compute() -> ViewTimes:
    """Open the view without a browser, then with one that clicks."""
    flat = opening.ViewRequest(flat=True)  # all of its cells can be clicked from one side
    with opening.opened(flat, http_port=0) as shown:
        loads = load_table(shown)
    with opening.opened(flat, http_port=0) as shown, browser.visit(shown) as visitor:
        return ViewTimes(loads, clicks(shown, visitor))


def loads_table(times: ViewTimes) -> str:
    return times.loads


def clicks_table(times: ViewTimes) -> str:
    return click_table(times.found)


def draw(folder: Path) -> list[Path]:
    image, clip, drawn = folder / "view.png", folder / "view.webp", folder / "plot.svg"
    plotted(drawn)
    with opening.opened(http_port=0) as shown, browser.visit(shown, *SIZE, dark=True) as visitor:
        record(shown, visitor, image, clip)
    return [image, clip, drawn]


SIZE = 1120, 660
