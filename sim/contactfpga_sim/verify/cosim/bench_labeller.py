"""The compiled labeller alone: millions of frames in, records with cycles out."""

from __future__ import annotations

import ctypes
import dataclasses
from typing import Any

import numpy as np

from contactfpga.skin import Skin
from contactfpga_sim.model.board import native
from contactfpga_sim.model.scenes.cells import to_words

_RECORD = np.dtype([("frame", "<u8"), ("cycle", "<u8"), ("zone", "<u8")])
_TIMING = np.dtype([("first_row", "<u8"), ("last_row", "<u8"), ("end", "<u8")])


@dataclasses.dataclass(frozen=True)
class LabellerRecords:
    """Records of N frames; cycles count from the bench's start."""

    frame: np.ndarray
    """(n,) int64: frame of each record, rising."""
    cycle: np.ndarray
    """(n,) int64: cycle of each record."""
    moments: np.ndarray
    """(n, 3) int64: area, sum x, sum y of each record; on closed sheets (n, 4), with the cells past the seam."""
    first_row: np.ndarray
    """(N,) int64: cycle of each frame's first row."""
    last_row: np.ndarray
    """(N,) int64: cycle of each frame's last row."""
    end: np.ndarray
    """(N,) int64: cycle of each frame's end mark."""

    def sorted_moments(self) -> np.ndarray:
        """Moments sorted by area, sum x, sum y within each frame."""
        area, sum_x, sum_y = self.moments.T[:3]
        return self.moments[np.lexsort((sum_y, sum_x, area, self.frame))]

    @property
    def last_record_clocks(self) -> np.ndarray:
        """(N,) int64: clocks from a frame's last row to its last record; 0 without a later record."""
        clocks = np.zeros(len(self.last_row), np.int64)
        np.maximum.at(clocks, self.frame, self.cycle - self.last_row[self.frame])
        return clocks


class LabelBench:
    """The Skin's labeller, compiled."""

    def __init__(self, skin: Skin):
        self.skin = skin
        self._derived = skin.derived
        library = native.load(_model(skin))
        library.bench_new.restype = ctypes.c_void_p
        library.bench_records.restype = ctypes.c_void_p
        library.bench_timings.restype = ctypes.c_void_p
        self._library = library
        self._bench = ctypes.c_void_p(library.bench_new())

    def run(self, frames: np.ndarray, *, gap: int = 0, stall: int = 0, seed: int = 1) -> LabellerRecords:
        """Feed (N, R, C) bool frames back to back and return all records.

        gap: percent of clocks without an offered row; stall: percent of clocks in which the record port is not ready.
        Raises RuntimeError if the labeller stops for good.
        """
        count, rows, columns = frames.shape
        if (rows, columns) != (self.skin.rows, self.skin.columns):
            raise ValueError(f"frames of {rows}x{columns}; this bench takes {self.skin.rows}x{self.skin.columns}")
        for name, value in (("gap", gap), ("stall", stall)):
            if not 0 <= value < 100:
                raise ValueError(f"{name} is {value}; it must lie between 0 and 99 percent")
        words = np.ascontiguousarray(to_words(frames))
        work = (rows * (2 * columns + 2) + 64) * max(count, 1)
        limit = 4 * work * 100 // (100 - max(gap, stall))
        finished = self._library.bench_run(
            self._bench,
            words.ctypes.data_as(ctypes.c_void_p),
            ctypes.c_size_t(count),
            ctypes.c_uint(gap),
            ctypes.c_uint(stall),
            ctypes.c_uint64(seed),
            ctypes.c_uint64(limit),
        )
        if not finished:
            raise RuntimeError(f"the labeller emitted fewer than {count} end marks in {limit} clocks")
        return self._collect(count)

    def close(self) -> None:
        """Free the model."""
        if self._bench:
            self._library.bench_free(self._bench)
            self._bench = ctypes.c_void_p()

    def __enter__(self) -> LabelBench:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _collect(self, frames: int) -> LabellerRecords:
        count = ctypes.c_size_t()
        address = self._library.bench_records(self._bench, ctypes.byref(count))
        records = native.array_at(address, count.value, _RECORD)
        timings = native.array_at(self._library.bench_timings(self._bench), frames, _TIMING)
        word = records["zone"]
        fields = []
        for width in self._derived.record_bits:
            fields.append((word & np.uint64((1 << width) - 1)).astype(np.int64))
            word = word >> np.uint64(width)
        return LabellerRecords(
            frame=records["frame"].astype(np.int64),
            cycle=records["cycle"].astype(np.int64),
            moments=np.stack(fields, axis=1),
            **{name: timings[name].astype(np.int64) for name in _TIMING.names or ()},
        )


def _model(skin: Skin) -> native.Model:
    derived = skin.derived

    def elaborate() -> Any:
        return derived.labeller.load_gateware()(skin)

    return native.Model(
        title=f"the {skin.rows}x{skin.columns} labeller {skin.labeller}",
        driver="label.cpp",
        key=f"labeller {native.skin_key(skin)}",
        elaborate=elaborate,
        defines={
            "ROWS": skin.rows,
            "COLUMNS": skin.columns,
            "ZONE_BITS": sum(derived.record_bits),
        },
    )
