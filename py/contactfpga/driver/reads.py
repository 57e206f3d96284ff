"""What came in several reads of a port, with the packets among it that were decoded already."""

from __future__ import annotations

import bisect
import functools

import numpy as np

from contactfpga.driver.clock import MOST_S
from contactfpga.skin.derived import Widths
from contactfpga.wire.many import PacketTable


class Reads:
    """Consecutive reads.

    ``at_s``: when each one came; ``bytes_by`` and ``packets_by``: bytes and packets of it and those before it;
    ``paused`` and ``noisy``: nobody had read before it for longer than times are known, or more bytes than a packet has
    came without a delimiter; ``data``: all bytes. ``decoded``: of every packet, with (n,) ``sizes`` in bytes, whether it
    is a whole frame by what :attr:`contactfpga.driver.conversation.Conversation.decodes` said, ``decodes``, and then
    its fields.
    """

    def __init__(
        self,
        at_s: np.ndarray,
        bytes_by: np.ndarray,
        packets_by: np.ndarray,
        paused: np.ndarray,
        noisy: np.ndarray,
        data: bytes,
        decodes: tuple[Widths, bytes] | None,
        decoded: PacketTable | None,
        sizes: np.ndarray,
    ):
        self.at_s: list[float] = at_s.tolist()
        self.paused: list[bool] = paused.tolist()
        self.data, self.decodes, self.decoded = data, decodes, decoded
        self._times, self._packets_by, self._sizes = at_s, packets_by, sizes
        self._bytes: list[int] = bytes_by.tolist()
        self._packets: list[int] = packets_by.tolist()
        self._odd = paused | noisy

    def __len__(self) -> int:
        return len(self.at_s)

    def packets_before(self, at: int) -> int:
        """Packets that were complete before this read."""
        return self._packets[at - 1] if at else 0

    def data_of(self, at: int, end: int | None = None) -> bytes:
        """Bytes of this read, or up to another one."""
        start = self._bytes[at - 1] if at else 0
        return self.data[start : self._bytes[(at + 1 if end is None else end) - 1]]

    def decoded_at(self, at: int) -> PacketTable | None:
        """What this read completed."""
        if self.decoded is None:
            return None
        return self.decoded.part(self.packets_before(at), self.packets_before(at + 1))

    def last_within(self, at: int, packets: int) -> int:
        """Up to which read all packets are among the first ``packets``, and the last read has one; no read between has
        anything else to be told of, and no pause is as long as times are known."""
        end = bisect.bisect_right(self._packets, packets, at, self._next_break(at))
        while end > at and self.packets_before(end) == self.packets_before(end - 1):
            end -= 1
        return end

    def _next_break(self, at: int) -> int:
        """The first read from here on that is more than frames, or that came too late after the one before it."""
        if self._odd[at]:
            return at
        place = bisect.bisect_right(self._breaks, at)
        return self._breaks[place] if place < len(self._breaks) else len(self)

    @functools.cached_property
    def _breaks(self) -> list[int]:
        found: list[int] = np.flatnonzero(self._odd | (np.diff(self._times, prepend=self._times[0]) > MOST_S)).tolist()
        return found

    def last_frames(
        self, at: int, end: int, times_us: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Of each read with frames, the last one's time of ``times_us`` and bytes, when it came, and how many they
        are."""
        first = self.packets_before(at)
        by = self._packets_by[at:end] - first
        counts = np.diff(by, prepend=0)
        some = counts > 0
        lasts = by[some] - 1
        return times_us[lasts], self._sizes[first + lasts] + 1, self._times[at:end][some], counts[some]
