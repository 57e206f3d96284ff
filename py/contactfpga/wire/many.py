"""Many frames as arrays. Anything but a whole frame is marked invalid;
:func:`contactfpga.wire.protocol.decode_frame` names its error.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Iterator, Sequence

import numpy as np

from contactfpga.skin.derived import CHECK_BYTES, HEARD_BITS, SEQUENCE_BITS, TIME_BITS, Widths
from contactfpga.wire.framing import FLAG_BITS, check_bytes
from contactfpga.wire.protocol import FLAGS, KINDS

_LONGEST = 254
"""Bytes of a stuffed packet without full blocks."""
_FLAG_MASK = (1 << len(FLAGS)) - 1
OVERFLOW, MISMATCH, FAULT, MOTION = (1 << bit for bit in range(len(FLAGS)))
"""Bits of ``flags`` in :data:`FIELDS`."""

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


@dataclasses.dataclass(frozen=True)
class PacketTable:
    packets: np.ndarray
    """(n,) of :data:`FIELDS`."""
    starts: np.ndarray
    """(n + 1,) starts of each packet's records."""
    records: np.ndarray
    """(m, 3) int64 of all packets in order: area and sums, or area and barycenter; (m, 4) for a sheet whose ends meet,
    as in
    :attr:`contactfpga.wire.protocol.Frame.moments`.
    """

    def part(self, start: int, end: int) -> PacketTable:
        return PacketTable(self.packets[start:end], self.starts[start : end + 1], self.records)


def decode(packets: Sequence[bytes], widths: Widths, before: bytes) -> PacketTable:
    """Read packets without delimiters, of a sheet whose report has zones; ``before`` as in
    :func:`contactfpga.wire.framing.unseal`.
    """
    found = np.zeros(len(packets), FIELDS)
    sizes = list(map(len, packets))
    lengths = np.array(sizes)
    groups = []
    for length in set(sizes):
        items, rest = divmod(length - CHECK_BYTES - 1 - widths.trailer_bytes, widths.item_bytes)
        if rest or not 0 <= items <= widths.max_items or length - CHECK_BYTES > _LONGEST:
            continue
        which = np.flatnonzero(lengths == length)
        data = np.frombuffer(b"".join([packets[index] for index in which.tolist()]), np.uint8).reshape(-1, length)
        fields, records = _group(data, items, widths, before)
        found[which] = fields
        groups.append((which[fields["valid"]], records))
    starts = np.zeros(len(packets) + 1, np.int64)
    np.cumsum(found["items"], out=starts[1:])
    all_records = np.zeros((int(starts[-1]), len(widths.record_bits)), np.int64)
    for which, records in groups:
        all_records[(starts[which][:, None] + np.arange(records.shape[1])).ravel()] = records.reshape(
            -1, len(widths.record_bits)
        )
    return PacketTable(found, starts, all_records)


def _group(data: np.ndarray, items: int, widths: Widths, before: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Fields of packets of one length, and (n, items, 3) or (n, items, 4) records of the valid ones."""
    stuffed = data[:, :-CHECK_BYTES]
    plain, fits = _unstuff(stuffed)
    valid = fits & _checked(data, before) & (plain[:, -1] >> FLAG_BITS == KINDS[widths.sheet.report])
    body = items * widths.item_bytes
    fields = np.zeros(len(data), FIELDS)
    word = _words(plain[:, body:-1])
    bits = (TIME_BITS, SEQUENCE_BITS, HEARD_BITS, widths.area_bits, widths.zones_bits, widths.overwritten_bits)
    names = ("time_us", "sequence", "heard", "cells", "zones", "overwritten")
    for name, value in zip(names, _split(word, bits), strict=True):
        fields[name] = value
    fields["flags"] = plain[:, -1] & _FLAG_MASK
    fields["items"] = items
    words = _words(plain[:, :body].reshape(len(data), items, widths.item_bytes))
    records = np.zeros((len(data), items, len(widths.record_bits)), np.int64)
    for column, value in enumerate(_split(words, widths.record_bits)):
        records[..., column] = value
    if widths.report.divided and widths.cells == 1 << widths.record_bits[0]:
        records[..., 0][records[..., 0] == 0] = widths.cells
    valid &= (words >> sum(widths.record_bits) == 0).all(axis=1)
    valid &= _agrees(fields, items, widths)
    valid &= (fields["flags"] & MISMATCH > 0) | _possible(fields, records, widths)
    if not valid.all():
        fields[~valid] = 0
        records = records[valid]
    fields["valid"] = valid
    return fields, records


def _unstuff(stuffed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Undo COBS without full blocks: the plain bytes, and whether the blocks fit."""
    count, length = stuffed.shape
    padded = np.zeros((count, length + 2), np.uint8)  # at the two places after the end nothing moves any more
    padded[:, :length] = stuffed
    plain = padded[:, 1:length]
    flat, rows = padded.reshape(-1), np.arange(0, padded.size, length + 2)
    place = np.zeros(count, np.int64)  # of a block's code
    while place.min() < length:
        where = rows + place
        place = np.minimum(place + flat[where], length + 1)
        flat[where] = 0
    return plain, place == length


def _checked(data: np.ndarray, before: bytes) -> np.ndarray:
    table, constant = _crc_table(data.shape[1] - CHECK_BYTES), _constant(data.shape[1] - CHECK_BYTES, before)
    crc = np.bitwise_xor.reduce(np.take(table, data[:, :-CHECK_BYTES] + _row_starts(data.shape[1])), axis=1) ^ constant
    right: np.ndarray = data[:, -1] == 0x80 | crc >> 14
    right &= data[:, -2] == 0x80 | crc >> 7 & 0x7F
    right &= data[:, -3] == 0x80 | crc & 0x7F
    return right


@functools.lru_cache(maxsize=256)
def _row_starts(length: int) -> np.ndarray:
    return np.arange(length - CHECK_BYTES, dtype=np.int64) * 256


@functools.lru_cache(maxsize=256)
def _crc_table(length: int) -> np.ndarray:
    """(length * 256,) uint16: contribution of each value of each byte to the linear CRC."""
    one = np.zeros(256, np.uint16)
    for value in range(256):
        crc = value
        for _ in range(8):
            crc = crc >> 1 ^ 0x8408 * (crc & 1)
        one[value] = crc
    rows = [one]
    for _ in range(length - 1):  # a zero byte more after it
        rows.append(rows[-1] >> 8 ^ one[rows[-1] & 0xFF])
    return np.concatenate(rows[::-1])


@functools.lru_cache(maxsize=256)
def _constant(length: int, before: bytes) -> int:
    low, middle, high = (byte & 0x7F for byte in check_bytes(bytes(length), before))
    return low | middle << 7 | high << 14


def _words(data: np.ndarray) -> np.ndarray:
    padded = np.zeros((*data.shape[:-1], 8), np.uint8)
    padded[..., : data.shape[-1]] = data
    return padded.view("<i8")[..., 0]


def _split(words: np.ndarray, widths: Sequence[int]) -> Iterator[np.ndarray]:
    offset = 0
    for width in widths:
        yield words >> offset & (1 << width) - 1
        offset += width


def _agrees(fields: np.ndarray, items: int, widths: Widths) -> np.ndarray:
    """Whether a frame has as many zones as it states, at most the possible number."""
    zones = fields["zones"]
    carried, overflow = np.minimum(zones, widths.max_items), fields["flags"] & OVERFLOW > 0
    agrees: np.ndarray = (carried == items) & (overflow == (carried < zones)) & (zones <= widths.sheet.max_zones())
    return agrees


def _possible(fields: np.ndarray, records: np.ndarray, widths: Widths) -> np.ndarray:
    area, x, y = (records[..., column] for column in range(3))
    scale = 1 << widths.sheet.barycenter_bits if widths.report.divided else area
    inside = (x <= (widths.sheet.columns - 1) * scale) & (y <= (widths.sheet.rows - 1) * scale) & (area > 0)
    if widths.sheet.closed:
        inside &= (records[..., 3] <= area) | (records[..., 3] == (1 << widths.area_bits) - 1)
    carried, cells = area.sum(axis=1), fields["cells"]
    agrees = np.where(fields["flags"] & OVERFLOW > 0, carried < cells, carried == cells)
    possible: np.ndarray = agrees & inside.all(axis=1) & (cells <= widths.cells)
    return possible
