"""Recorded frames through the compiled gateware."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from contactfpga.errors import ContactFPGAError
from contactfpga.skin import Skin
from contactfpga.wire import protocol
from contactfpga.wire.protocol import Frame
from contactfpga.zones.zone import Zones
from contactfpga_sim.model.board import native
from contactfpga_sim.model.board.compiled import CompiledBoard, model_of
from contactfpga_sim.model.board.receiver import Receiver
from contactfpga_sim.model.scenes.recordings import Recording

CHUNK = 256
"""Frames simulated between two decodings."""

BIT_CLOCKS = 2
"""Clocks per bit of the fastest UART of a Skin."""


class ReplayError(ContactFPGAError):
    """An input frame did not come out exactly once."""


@dataclasses.dataclass(frozen=True)
class ReplayedFrame:
    """Result of one input frame."""

    frame: Frame
    first_record: int | None
    """Clocks from the last row's transfer to the first record, maybe negative; None without a zone."""
    last_record: int | None
    """Clocks from the last row's transfer to the last record; None without a zone."""
    duration: int
    """Clocks from the first row's transfer to the end of the last byte on the line."""


def load(
    path: str | Path,
    threshold: float | None = None,
    connectivity: int = 8,
    pitch_mm: float = 10.0,
    barycenter_bits: int | None = None,
    closed: bool = False,
) -> tuple[np.ndarray, Skin]:
    """A recording as (frames, rows, columns) bool, and a Skin for it with a compiled board.

    ``closed``: whether the last column is a neighbor of the first.
    """
    frames = Recording.load(path, threshold).pressed
    _, rows, columns = frames.shape
    bound = zones_bound(frames, connectivity)
    skin = skin_for(rows, columns, connectivity, bound, pitch_mm, barycenter_bits, closed)
    native.load(model_of(skin))
    return frames, skin


def zones_bound(frames: np.ndarray, connectivity: int) -> int:
    """Upper bound on the zones of any frame."""
    above = np.pad(frames, ((0, 0), (1, 0), (1, 1)))[:, :-1]
    touched = above[:, :, 1:-1]
    if connectivity == 8:
        touched = touched | above[:, :, :-2] | above[:, :, 2:]
    starts = frames & ~np.pad(frames, ((0, 0), (0, 0), (1, 0)))[:, :, :-1]
    run = starts.ravel().cumsum() - 1  # number of the run that a pressed cell is in
    joined = np.zeros(int(starts.sum()), bool)
    joined[run[(frames & touched).ravel()]] = True
    frame_of_run = np.nonzero(starts)[0]
    return int(np.bincount(frame_of_run[~joined]).max(initial=0))


def skin_for(
    rows: int,
    columns: int,
    connectivity: int,
    zones: int,
    pitch_mm: float = 10.0,
    barycenter_bits: int | None = None,
    closed: bool = False,
) -> Skin:
    """A Skin of this size, scanned as fast as the link can carry frames of this many zones.

    ``barycenter_bits``: fraction bits of a board that divides. Capacities are coarse, so that recordings of one sheet
    share builds.
    """
    shape: dict[str, Any] = {"rows": rows, "columns": columns, "connectivity": connectivity, "settle_us": 10_000.0}
    if closed:
        shape |= {"surface": "cylinder", "radius_mm": pitch_mm * columns / (2 * math.pi), "closed": True}
    if barycenter_bits is not None:
        shape |= {"report": "barycenter", "barycenter_bits": barycenter_bits}
    most = Skin(**shape, zone_capacity=1).max_zones()
    steps = (step << shift for shift in range(12) for step in (4, 5, 6, 7))
    capacity = min(most, next(step for step in (1, 2, 3, *steps) if step >= zones))
    slow = Skin(**shape, zone_capacity=capacity, baud=6_000_000)
    derived = slow.derived
    wire = derived.max_frame_bytes * 10 * BIT_CLOCKS + 8
    row_clocks = max(derived.min_row_clocks, math.ceil(wire / rows))
    return slow.replace(
        zone_capacity=capacity,
        settle_us=(row_clocks - 1) / derived.clocks_per_us,
        release_us=1 / derived.clocks_per_us,
        **({} if closed else {"pitch_x_mm": pitch_mm}),
        pitch_y_mm=pitch_mm,
    )


def replay(frames: np.ndarray, skin: Skin) -> Iterator[ReplayedFrame]:
    """Hold each (rows, columns) bool frame for one scan of a board of ``skin``; results are in order.

    The sheet is untouched in the first scans and in those with a hello. Raises :class:`ReplayError` if a frame does not
    come out exactly once.
    """
    plan = _Plan(skin, len(frames))
    with CompiledBoard(skin, capture=("rows", "records")) as board, ThreadPoolExecutor(1) as pool:
        collector = _Collector(board, plan)
        parts = [range(start, min(start + CHUNK, plan.scans)) for start in range(0, plan.scans, CHUNK)]
        running = pool.submit(collector.simulate, frames, parts[0])
        for following in [*parts[1:], None]:
            events = running.result()
            if following is not None:
                running = pool.submit(collector.simulate, frames, following)
            yield from collector.collect(events)
    collector.finish()


class _Plan:
    def __init__(self, skin: Skin, count: int):
        derived = skin.derived
        hello = len(protocol.encode_hello(skin)) * 10 * derived.bit_clocks
        quiet = math.ceil(hello / derived.frame_clocks) + 2
        period = derived.hello_frames
        self.frame_of: list[int | None] = [None] * quiet
        frame = 0
        while frame < count:
            if period > 2 * quiet and (len(self.frame_of) + 1) % period < quiet:
                self.frame_of.append(None)
                continue
            self.frame_of.append(frame)
            frame += 1
        self.frame_of += [None] * (quiet + 1)
        self.scans = len(self.frame_of)


@dataclasses.dataclass
class _Events:
    rows: np.ndarray
    records: np.ndarray
    received: np.ndarray


class _Collector:
    def __init__(self, board: CompiledBoard, plan: _Plan):
        self._board = board
        self._plan = plan
        self._derived = board.skin.derived
        self._times: dict[int, list[int]] = {}  # scan: first row, last row, records
        self._scan = 0
        self._row_scan = 0
        self._pending: list[int] = []
        self._receiver = Receiver(board.skin)
        self._next = 0

    def simulate(self, frames: np.ndarray, scans: range) -> _Events:
        skin = self._board.skin
        cells = np.zeros((len(scans), skin.rows, skin.columns), bool)
        for index, scan in enumerate(scans):
            frame = self._plan.frame_of[scan]
            if frame is not None:
                cells[index] = frames[frame]
        self._board.hold(cells)
        return _Events(*(self._board.take(name) for name in ("rows", "records", "received")))

    def collect(self, events: _Events) -> Iterator[ReplayedFrame]:
        self._note_times(events)
        stream = zip(events.received["cycle"].tolist(), events.received["data"].tolist())
        for got in self._receiver.take(stream):
            yield from self._place(got.frame, got.last)

    def _note_times(self, events: _Events) -> None:
        rows = self._board.skin.rows
        for cycle, mark in zip(events.rows["cycle"].tolist(), events.rows["mark"].tolist()):
            times = self._times.setdefault(self._row_scan // rows, [cycle, cycle])
            times[1] = cycle
            self._row_scan += 1
            assert bool(mark) == (self._row_scan % rows == 0)
        for cycle, end in zip(events.records["cycle"].tolist(), events.records["mark"].tolist()):
            if end:
                self._times[self._scan] += self._pending[:1] + self._pending[-1:]
                self._pending.clear()
                self._scan += 1
            else:
                self._pending.append(cycle)

    def _place(self, frame: Frame, end: int) -> Iterator[ReplayedFrame]:
        scan = self._next
        while self._time(scan) != frame.time_us:
            if scan >= self._plan.scans or self._plan.frame_of[scan] is not None:
                raise ReplayError(f"scan {scan} did not reach the host; the next frame is of {frame.time_us} us")
            scan += 1
        self._next = scan + 1
        first_row, last_row, *records = self._times.pop(scan)
        if self._plan.frame_of[scan] is not None:
            first, last = (cycle - last_row for cycle in records) if records else (None, None)
            yield ReplayedFrame(frame, first, last, end - first_row)

    def _time(self, scan: int) -> int:
        derived = self._derived
        strobe = scan * derived.frame_clocks + derived.settle_clocks + 1
        return strobe // derived.clocks_per_us % (1 << 24)

    def finish(self) -> None:
        left = sum(frame is not None for frame in self._plan.frame_of[self._next :])
        if left:
            raise ReplayError(f"{left} frames of the input did not reach the host")


def to_json(index: int, result: ReplayedFrame, skin: Skin) -> dict[str, object]:
    """One frame as ``contactfpga replay --json`` prints it."""
    cycles = {
        "last_row_to_first_record": result.first_record,
        "last_row_to_last_record": result.last_record,
        "frame": result.duration,
    }
    return {"frame": index, **Zones(result.frame, skin.sheet).to_dict(), "cycles": cycles}
