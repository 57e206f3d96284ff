"""Successive reads of a port, with decoded packets."""

from __future__ import annotations

import bisect
import functools

import numpy as np

from contactfpga.driver.clock import MOST_S, run_ends
from contactfpga.skin.derived import Widths
from contactfpga.wire.table import PacketTable

PAUSED, NOISE = 1, 2
"""Flags of a read: after a pause that makes times ambiguous; with too many bytes without a delimiter."""


READ = np.dtype([("at_s", "<f8"), ("bytes", "<i8"), ("packets", "<i8"), ("records", "<i8"), ("odd", "<i8")])
"""One read: ``bytes`` and ``packets`` are totals up to it, ``odd`` has flags."""


class Reads:
    """Consecutive reads.

    ``reads``: of :data:`READ`, after ``bytes_before`` and ``packets_before``; ``data``: all bytes. ``table``: each
    packet's fields, and whether it is a whole frame by ``frame_format``; its bytes are in (n,) ``sizes``.
    """

    def __init__(
        self,
        bytes_before: int,
        packets_before: int,
        reads: np.ndarray,
        data: bytes,
        frame_format: tuple[Widths, bytes] | None,
        table: PacketTable | None,
        sizes: np.ndarray,
    ):
        self.at_s: list[float] = reads["at_s"].tolist()
        self.frame_format, self.table, self.sizes = frame_format, table, sizes
        self._reads, self._data = reads, data
        self._bytes: list[int] = [0, *(reads["bytes"] - bytes_before).tolist()]
        self._packets: list[int] = [0, *(reads["packets"] - packets_before).tolist()]

    def __len__(self) -> int:
        return len(self.at_s)

    def paused(self, at: int) -> bool:
        """Whether times are ambiguous because of a pause before this read."""
        return bool(self._reads["odd"][at] & PAUSED)

    def packets_before(self, at: int) -> int:
        return self._packets[at]

    def data_of(self, at: int, end: int | None = None) -> bytes:
        return self._data[self._bytes[at] : self._bytes[at + 1 if end is None else end]]

    def table_of(self, at: int) -> PacketTable | None:
        return self.table and self.table.part(self._packets[at], self._packets[at + 1])

    @functools.cached_property
    def run_ends(self) -> list[int]:
        """:func:`contactfpga.driver.clock.run_ends` of all packets."""
        assert self.table is not None
        return run_ends(self.table.packets)

    def last_within(self, at: int, packets: int) -> int:
        """End of the unflagged reads from this one on within the first ``packets`` packets, without long pauses; the
        last one has a packet.
        """
        end = bisect.bisect_right(self._packets, packets, at + 1, self._next_break(at) + 1) - 1
        while end > at and self._packets[end] == self._packets[end - 1]:
            end -= 1
        return end

    def _next_break(self, at: int) -> int:
        if self._reads["odd"][at]:
            return at
        place = bisect.bisect_right(self._breaks, at)
        return self._breaks[place] if place < len(self._breaks) else len(self)

    @functools.cached_property
    def _breaks(self) -> list[int]:
        at_s = self._reads["at_s"]
        late = np.diff(at_s, prepend=at_s[0]) > MOST_S
        found: list[int] = np.flatnonzero((self._reads["odd"] > 0) | late).tolist()
        return found

    def last_frames(
        self, at: int, end: int, times_us: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """For each read with frames: time and size of its last frame, arrival, and number of frames. ``times_us``: of
        each frame.
        """
        by = np.array(self._packets[at : end + 1])
        counts = np.diff(by)
        some = counts > 0
        lasts = by[1:][some] - 1
        return times_us[lasts - by[0]], self.sizes[lasts] + 1, self._reads["at_s"][at:end][some], counts[some]
