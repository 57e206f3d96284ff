"""What came in several reads of a port, with the packets among it that were decoded already."""

from __future__ import annotations

import bisect
import functools

import numpy as np

from contactfpga.driver.clock import MOST_S
from contactfpga.skin.derived import Widths
from contactfpga.wire.many import PacketTable

PAUSED, NOISE = 1, 2
"""Of a read: nobody had read before it for longer than times are known; more bytes than a packet has came without a
delimiter."""


READ = np.dtype([("at_s", "<f8"), ("bytes", "<i8"), ("packets", "<i8"), ("records", "<i8"), ("odd", "<i8")])
"""What came at once: bytes and packets are those of all reads up to it, ``odd`` of :data:`PAUSED` and :data:`NOISE`."""


class Reads:
    """Consecutive reads.

    ``reads``: of :data:`READ`, after ``bytes_before`` and ``packets_before``; ``data``: all bytes.
    ``decoded``: of every packet, with (n,) ``sizes`` in bytes, whether it is a whole frame by what
    :attr:`contactfpga.driver.conversation.Conversation.frame_format` said, ``frame_format``, and then its fields.
    """

    def __init__(
        self,
        bytes_before: int,
        packets_before: int,
        reads: np.ndarray,
        data: bytes,
        frame_format: tuple[Widths, bytes] | None,
        decoded: PacketTable | None,
        sizes: np.ndarray,
    ):
        self.at_s: list[float] = reads["at_s"].tolist()
        self.frame_format, self.decoded = frame_format, decoded
        self._reads, self._data, self._sizes = reads, data, sizes
        self._bytes: list[int] = [0, *(reads["bytes"] - bytes_before).tolist()]
        self._packets: list[int] = [0, *(reads["packets"] - packets_before).tolist()]

    def __len__(self) -> int:
        return len(self.at_s)

    def paused(self, at: int) -> bool:
        """Whether nobody had read before this read for longer than times are known."""
        return bool(self._reads["odd"][at] & PAUSED)

    def packets_before(self, at: int) -> int:
        """Packets that were complete before this read."""
        return self._packets[at]

    def data_of(self, at: int, end: int | None = None) -> bytes:
        """Bytes of this read, or up to another one."""
        return self._data[self._bytes[at] : self._bytes[at + 1 if end is None else end]]

    def decoded_at(self, at: int) -> PacketTable | None:
        """What this read completed."""
        if self.decoded is None or len(self) == 1:
            return self.decoded
        return self.decoded.part(self._packets[at], self._packets[at + 1])

    def last_within(self, at: int, packets: int) -> int:
        """Up to which read from this one on all packets are among the first ``packets``, there is nothing else to be
        told of, no pause is as long as times are known, and the last read has a packet."""
        end = bisect.bisect_right(self._packets, packets, at + 1, self._next_break(at) + 1) - 1
        while end > at and self._packets[end] == self._packets[end - 1]:
            end -= 1
        return end

    def _next_break(self, at: int) -> int:
        """The first read from here on that is odd, or from the next one on that came too late after the one before."""
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
        """Of each read with frames, the last one's time of ``times_us`` and bytes with the delimiter, when it came, and
        how many they are."""
        by = np.array(self._packets[at : end + 1])
        counts = np.diff(by)
        some = counts > 0
        lasts = by[1:][some] - 1
        return times_us[lasts - by[0]], self._sizes[lasts] + 1, self._reads["at_s"][at:end][some], counts[some]
