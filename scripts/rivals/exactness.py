"""Frames through a labeller, every record against the golden model, and how late the last one is."""

from __future__ import annotations

import ctypes
import dataclasses
from pathlib import Path

import numpy as np

from rivals.house import LabelBench, all_departures, native, shapes, square, to_words
from rivals.rival import Sheet

_BENCH = Path(__file__).parent / "bench.cpp"
_RECORD = np.dtype([("cycle", "<u8"), ("zone", "<u8")])
READ_VERILOG = "read_verilog top.v; hierarchy -check -top top; proc; select -assert-none t:$dlatch*; check -assert"
"""Yosys commands that read a converted rival; latches are refused."""


@dataclasses.dataclass(frozen=True)
class Checked:
    """What a labeller made of N frames with 8-connectivity."""

    frames: int
    wrong: int
    """Frames with any record that is wrong, missing or too many."""
    after_last_cell: int
    """Clocks from a frame's last cell to its last record, worst; with the last row for a labeller that takes rows."""
    after_last_row: int
    """Clocks from when the last row could be given whole."""


def frames_for(size: int, count: int, seed: int = 1) -> np.ndarray:
    """(N, R, C) bool: shapes that break labellers and ``count`` frames of noise; of 4x4 every frame."""
    if size == 4:
        numbers = np.arange(1 << 16, dtype=np.uint32)
        return (numbers[:, None] >> np.arange(16, dtype=np.uint32) & 1).astype(bool).reshape(-1, 4, 4)
    rng = np.random.default_rng(seed)
    shapes_here = np.stack([cells for _, cells in shapes.variants(size, size)])
    density = rng.uniform(0.02, 0.98, count)
    noise = np.stack([_noise(rng, size, share, grain=1 + index % 5) for index, share in enumerate(density)])
    return np.concatenate([shapes_here, noise])


def _noise(rng: np.random.Generator, size: int, share: float, grain: int) -> np.ndarray:
    coarse = rng.random((-(-size // grain),) * 2) < share
    fine = rng.random((size, size)) < (0.05 if grain > 1 else 0.0)
    return coarse.repeat(grain, 0).repeat(grain, 1)[:size, :size] ^ fine


def check_rival(verilog: str, sheet: Sheet, frames: np.ndarray) -> Checked:
    """All frames back to back through a converted rival."""
    cycle, moments = _run(verilog, sheet, frames)
    # A zone is known to end one row later at the earliest; by then all records of the frame before have left.
    frame = (cycle - sheet.width) // sheet.period
    last_cell = frame * sheet.period + (sheet.size - 1) * (sheet.width + 1)
    late = int((cycle - last_cell).max(initial=0))
    return Checked(len(frames), wrong_frames(frame, moments, frames), late, late + sheet.size - 1)


def check_ours(labeller: str, size: int, frames: np.ndarray) -> Checked:
    """The same frames through one of ours, a row per clock as long as it takes them."""
    with LabelBench(square(size).replace(labeller=labeller, settle_us=20.0)) as bench:
        got = bench.run(frames)
    late = int(got.last_record_clocks.max())
    return Checked(len(frames), wrong_frames(got.frame, got.moments, frames), late, late)


def wrong_frames(frame: np.ndarray, moments: np.ndarray, frames: np.ndarray) -> int:
    """How many frames have other zones than the golden model finds; ``frame`` of each record, its (n, 3) moments."""
    expected = all_departures(frames, 8)
    got, right = _sorted(frame, moments), _sorted(expected.frame, expected.moments)
    if np.array_equal(got, right):
        return 0
    different = set(map(tuple, got.tolist())) ^ set(map(tuple, right.tolist()))
    counts = np.bincount(frame[frame >= 0], minlength=len(frames))[: len(frames)]
    uneven = np.flatnonzero(counts != np.bincount(expected.frame, minlength=len(frames)))
    return len({record[0] for record in different} | set(uneven.tolist()))


def _sorted(frame: np.ndarray, moments: np.ndarray) -> np.ndarray:
    records = np.column_stack([frame, moments])
    return records[np.lexsort(records.T[::-1])]


def _run(verilog: str, sheet: Sheet, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cycle and (area, sum x, sum y) of every record."""
    netlist = native.Netlist({"top.v": verilog}, READ_VERILOG)
    defines = {"SIZE": sheet.size, "WIDTH": sheet.width, "PERIOD": sheet.period}
    title = f"a rival for {sheet.size}x{sheet.size}"
    library = native.load(native.Model(title, str(_BENCH), netlist.key, lambda: netlist, defines))
    library.bench_new.restype = library.bench_records.restype = ctypes.c_void_p
    bench = ctypes.c_void_p(library.bench_new())
    try:
        words = np.ascontiguousarray(to_words(frames))
        library.bench_run(bench, words.ctypes.data_as(ctypes.c_void_p), ctypes.c_size_t(len(frames)))
        count = ctypes.c_size_t()
        address = library.bench_records(bench, ctypes.byref(count))
        records = native.array_at(address, count.value, _RECORD)
    finally:
        library.bench_free(bench)
    word, fields = records["zone"], []
    for bits in sheet.moment_bits:
        fields.append((word & np.uint64((1 << bits) - 1)).astype(np.int64))
        word = word >> np.uint64(bits)
    return records["cycle"].astype(np.int64), np.stack(fields, axis=1)
