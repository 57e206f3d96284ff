"""Packets as rows of one table. A packet that is no whole frame is marked invalid;
:func:`contactfpga.wire.protocol.decode` names its error.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable

import numpy as np

from contactfpga.skin.derived import Widths
from contactfpga.wire import protocol
from contactfpga.wire.framing import PacketError, unseal

FIELDS = np.dtype(
    [
        ("valid", np.bool_),
        ("time_us", np.int64),
        ("sequence", np.int64),
        ("heard", np.int64),
        ("cells", np.int64),
        ("zones", np.int64),
        ("overwritten", np.int64),
        ("flags", np.int64),
        ("items", np.int64),
    ],
    align=True,
)
"""Fields of a packet: validity, then those of :class:`~contactfpga.wire.protocol.Frame`; ``items`` counts its records.
"""
_INVALID = (0,) * len(FIELDS.names or ())


@dataclasses.dataclass(frozen=True)
class PacketTable:
    packets: np.ndarray
    """(n,) of :data:`FIELDS`."""
    starts: np.ndarray
    """(n + 1,) starts of each packet's records."""
    records: np.ndarray
    """(m, 3) int64 of all packets in order: area and sums, or area and barycenter; (m, 4) for a sheet whose ends meet,
    as in :attr:`contactfpga.wire.protocol.Frame.moments`; with extents four more columns, those of
    :attr:`contactfpga.wire.protocol.Frame.extents`; (m, columns) with ``report = "cells"``.
    """

    def part(self, start: int, end: int) -> PacketTable:
        return PacketTable(self.packets[start:end], self.starts[start : end + 1], self.records)

    @classmethod
    def of(cls, decoded: Iterable[tuple[tuple[int, ...], list[list[int]]]], widths: Widths) -> PacketTable:
        """A table of what :func:`contactfpga.wire.protocol.decode` found."""
        rows, starts = [], [0]
        records: list[list[int]] = []
        for row, found in decoded:
            rows.append(row)
            records += found
            starts.append(len(records))
        columns = len(widths.record_bits) if widths.report.zones else widths.sheet.columns
        return cls(np.array(rows, FIELDS), np.array(starts), np.array(records, np.int64).reshape(-1, columns))


def decode(packets: Iterable[bytes], widths: Widths, before: bytes) -> PacketTable:
    """Read packets without delimiters; ``before`` as in :func:`contactfpga.wire.framing.unseal`."""
    return PacketTable.of((_decoded(packet, widths, before) for packet in packets), widths)


def _decoded(packet: bytes, widths: Widths, before: bytes) -> tuple[tuple[int, ...], list[list[int]]]:
    try:
        return protocol.decode(unseal(packet, before), widths)
    except PacketError:
        return _INVALID, []
