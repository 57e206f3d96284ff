"""Packets on the wire and their fields."""

from __future__ import annotations

import dataclasses
import itertools
from typing import TYPE_CHECKING

import numpy as np

from contactfpga.skin.derived import HEARD_BITS, SEQUENCE_BITS, TIME_BITS, Widths
from contactfpga.skin.sheet import Sheet
from contactfpga.wire.framing import (
    DELIMITER,
    DIGIT_BITS,
    FLAG_BITS,
    KIND_BITS,
    KIND_HELLO,
    KINDS,
    VERSION,
    OldPacket,
    PacketError,
    check_bytes,
    cobs_decode,
    cobs_encode,
    digits,
    kind_of,
    last_byte,
    pulses,
    seal,
    unseal,
)
from contactfpga.wire.hello import (
    EPOCH_DIGITS,
    HEARD_DIGITS,
    SENT_DIGITS,
    STATE_DIGITS,
    STATE_OFFSET,
    STUCK_DIGITS,
    Hello,
    HelloReader,
    encode_hello,
)

if TYPE_CHECKING:
    from contactfpga.skin import Skin

__all__ = [
    "DELIMITER",
    "DIGIT_BITS",
    "EPOCH_DIGITS",
    "FAULT",
    "FLAGS",
    "FLAG_BITS",
    "FLAG_SETS",
    "HEARD_DIGITS",
    "KINDS",
    "KIND_BITS",
    "KIND_HELLO",
    "KIND_REQUEST",
    "MISMATCH",
    "MOTION",
    "NO_RECORDS",
    "OVERFLOW",
    "REQUEST_HELLO",
    "SENT_DIGITS",
    "STATE_DIGITS",
    "STATE_OFFSET",
    "STUCK_DIGITS",
    "VERSION",
    "Frame",
    "Hello",
    "HelloReader",
    "OldPacket",
    "PacketError",
    "check_bytes",
    "check_prefix",
    "cobs_decode",
    "cobs_encode",
    "decode",
    "decode_frame",
    "digits",
    "encode_hello",
    "encode_request",
    "frame_of",
    "kind_of",
    "last_byte",
    "may_number",
    "seal",
    "unseal",
]

FLAGS = ("overflow", "mismatch", "fault", "motion")
"""Names of a frame's flags, lowest bit first."""
OVERFLOW, MISMATCH, FAULT, MOTION = (1 << bit for bit in range(len(FLAGS)))

KIND_REQUEST = 5
REQUEST_HELLO = 1
"""Flag of a request for a hello as well."""


def encode_request(number: int, hello: bool = False, pulsed: bool = False) -> bytes:
    """A request on the wire, with a delimiter at either end; ``number`` meets :func:`may_number`, ``pulsed`` is as in
    :func:`~contactfpga.wire.framing.pulses`.
    """
    assert may_number(number), f"{number} is no number of a request"
    plain = digits(number, HEARD_DIGITS) + bytes([last_byte(KIND_REQUEST, REQUEST_HELLO * hello)])
    data = bytes([DELIMITER]) + seal(plain)
    return pulses(data) if pulsed else data


def may_number(number: int) -> bool:
    """Whether a request may have this number: neither a digit nor the bits that frames repeat are 0."""
    each = (number >> DIGIT_BITS * place & 0x7F for place in range(HEARD_DIGITS))
    return 0 <= number < 1 << DIGIT_BITS * HEARD_DIGITS and all(each) and number % (1 << HEARD_BITS) != 0


def check_prefix(skin: Skin | Hello) -> bytes:
    """Prefix of the check of frames: the start of the board's fingerprint."""
    return skin.fingerprint[:2]


@dataclasses.dataclass(frozen=True)
class Frame:
    sequence: int
    """Number of frames sent before this one, modulo 256."""
    time_us: int
    """Device time of the first row's sample, modulo 2^24 us."""
    flags: frozenset[str]
    overwritten: int
    """Number of frames that newer ones replaced before they were sent, modulo 2^``Widths.overwritten_bits``."""
    heard: int
    """Lowest bits of the number of the last request received before the frame's scan; 0: none."""
    zones: int
    """Number of zones on the sheet, including those beyond the capacity; 0 with ``report = "cells"``."""
    cells: int
    """Number of pressed switches."""
    moments: np.ndarray
    """(n, 3) int64 area, sum x, sum y of each zone with ``report = "moments"``; otherwise (0, 3). (n, 4) for a sheet
    whose ends meet, with the cells past the seam (:mod:`contactfpga.zones.around`)."""
    bitmap: np.ndarray | None
    """(rows, columns) bool with ``report = "cells"``; otherwise None."""
    levels: np.ndarray | None = None
    """(rows, columns) int64 of the levels of force that each cell reached, 0 at rest; None for a sheet of one level."""
    barycenters: np.ndarray | None = None
    """(n, 3) int64 area, x, y of each zone with ``report = "barycenter"``, x and y in cells / 2^``barycenter_bits``;
    otherwise None."""
    extents: np.ndarray | None = None
    """(n, 4) int64 smallest and largest column, smallest and largest row of each zone, as :class:`contactfpga.Box`;
    None for a sheet without."""


def decode(plain: bytes, widths: Widths) -> tuple[tuple[int, ...], list[list[int]]]:
    """Read an unsealed frame of the sheet of ``widths``: a row of :data:`contactfpga.wire.table.FIELDS`, and its zone
    records or bitmap rows. Raises :class:`PacketError` if its length contradicts its zone count, or, without a mismatch
    flag, its cells contradict its zones.
    """
    sheet = widths.sheet
    kind = KINDS[sheet.report]
    if kind_of(plain) != kind:
        raise PacketError("kind", f"packet of kind {kind_of(plain)}; report = {sheet.report!r} sends kind {kind}")
    body = len(plain) - widths.trailer_bytes
    items, rest = divmod(body, widths.item_bytes)
    if body < 0 or rest:
        raise PacketError("length", f"frame of {len(plain)} bytes holds no whole number of items")
    time_us, sequence, heard, cells, zones, overwritten = _split(
        int.from_bytes(plain[body:-1], "little"),
        *(TIME_BITS, SEQUENCE_BITS, HEARD_BITS, widths.area_bits, widths.zones_bits),
    )
    flags = plain[-1] & (1 << len(FLAGS)) - 1
    expected = sheet.rows if sheet.report == "cells" else zones
    carried = min(expected, widths.max_items)
    if items != carried or bool(flags & OVERFLOW) != (carried < expected):
        names = sorted(FLAG_SETS[flags])
        raise PacketError("length", f"frame carries {items} items, states {expected} and the flags {names}")
    if zones > (0 if sheet.report == "cells" else sheet.max_zones()):
        raise PacketError("content", f"frame states {zones} zones; the sheet holds at most {sheet.max_zones()}")
    records = _bitmap(plain[:body], widths) if sheet.report == "cells" else _records(plain[:body], widths)
    if not flags & MISMATCH:
        _check_sums(records, cells, flags, widths)
    return (1, time_us, sequence, heard, cells, zones, overwritten, flags, items), records


def decode_frame(plain: bytes, widths: Widths) -> Frame:
    """:func:`decode` as a frame."""
    fields, records = decode(plain, widths)
    return frame_of(fields, np.array(records, np.int64), widths.sheet)


def frame_of(fields: tuple[int, ...], records: np.ndarray, sheet: Sheet) -> Frame:
    """A frame from a row of :data:`contactfpga.wire.table.FIELDS` and its records as in
    :attr:`contactfpga.wire.table.PacketTable.records`."""
    _, time_us, sequence, heard, cells, zones, overwritten, flags, _ = fields
    divided, bitmap = sheet.report == "barycenter", sheet.report == "cells"
    extents = None
    if sheet.extent:
        records = records.reshape(-1, len(EXTENT) + sums_of(sheet))
        records, extents = records[:, : -len(EXTENT)], records[:, -len(EXTENT) :]
    frame = object.__new__(Frame)  # whose own way to begin takes most of the time of this
    vars(frame).update(
        sequence=sequence,
        time_us=time_us,
        flags=FLAG_SETS[flags],
        overwritten=overwritten,
        heard=heard,
        zones=zones,
        cells=cells,
        moments=no_records(sheet) if divided or bitmap or not len(records) else records,
        bitmap=records.astype(bool) if bitmap else None,
        levels=records if sheet.levels > 1 else None,
        barycenters=(records if len(records) else NO_RECORDS) if divided else None,
        extents=extents,
    )
    return frame


NO_RECORDS = np.zeros((0, 3), np.int64)
NO_RECORDS.flags.writeable = False
_NO_CLOSED_RECORDS = np.zeros((0, 4), np.int64)
_NO_CLOSED_RECORDS.flags.writeable = False


EXTENT = ("left", "right", "top", "bottom")
"""Fields at the end of a zone's record on a sheet with extents."""


def sums_of(sheet: Sheet) -> int:
    """Number of a zone's fields before those of its extent."""
    return 3 + sheet.closed


def no_records(sheet: Sheet) -> np.ndarray:
    return _NO_CLOSED_RECORDS if sheet.closed else NO_RECORDS


FLAG_SETS = [frozenset(name for bit, name in enumerate(FLAGS) if word >> bit & 1) for word in range(1 << len(FLAGS))]


def _check_sums(records: list[list[int]], cells: int, flags: int, widths: Widths) -> None:
    sheet = widths.sheet
    if sheet.report == "cells":
        carried = sum(map(bool, itertools.chain.from_iterable(records)))
        possible = carried == cells
    else:
        carried = sum(record[0] for record in records)
        possible = carried < cells if flags & OVERFLOW else carried == cells
        possible &= all(_is_inside(record, widths) for record in records)
    if not possible or cells > widths.cells:
        raise PacketError("content", f"frame carries {carried} cells and states {cells}, or zones that cannot be")


def _is_inside(record: list[int], widths: Widths) -> bool:
    sheet = widths.sheet
    area, x, y = record[:3]
    turned = record[3] if sheet.closed else 0
    scale = 1 << sheet.barycenter_bits if widths.report.divided else area
    if not (area > 0 and x <= (sheet.columns - 1) * scale and y <= (sheet.rows - 1) * scale):
        return False
    if turned > area and turned != (1 << widths.area_bits) - 1:
        return False
    return not sheet.extent or _has_extent(record, scale, sheet)


def _has_extent(record: list[int], scale: int, sheet: Sheet) -> bool:
    """Whether a zone with the barycenter (x, y) / ``scale`` may have its extent.

    It is on the sheet, has a place for each cell, is no longer or wider than its cells can reach, and holds the
    barycenter.
    """
    area, x, y, *turned, left, right, top, bottom = record
    if max(left, right) >= sheet.columns or not top <= bottom < sheet.rows or (left > right and not sheet.closed):
        return False
    width, height = (right - left) % sheet.columns + 1, bottom - top + 1
    if not max(width, height) <= area <= width * height or not top * scale <= y <= bottom * scale:
        return False
    if turned and turned[0] >= area:
        return (left, right) == (0, sheet.columns - 1)
    along = (x + sheet.columns * sum(turned) - left * scale) % (sheet.columns * scale)
    return width == sheet.columns or along <= (width - 1) * scale


def _records(data: bytes, widths: Widths) -> list[list[int]]:
    """Zone records; the area of all cells, sent as 0 with ``report = "barycenter"``, is restored."""
    size = widths.record_bytes
    *bits, last_bits = widths.record_bits
    rows = [_split(int.from_bytes(data[start : start + size], "little"), *bits) for start in range(0, len(data), size)]
    if any(row[-1] >> last_bits for row in rows):
        raise PacketError("content", "a zone record is filled up with something other than zeros")
    if widths.report.divided and widths.cells == 1 << widths.record_bits[0]:
        rows = [[row[0] or widths.cells, *row[1:]] for row in rows]
    return rows


def _bitmap(data: bytes, widths: Widths) -> list[list[int]]:
    raw = np.frombuffer(data, np.uint8).reshape(widths.sheet.rows, widths.bitmap_row_bytes)
    bits = np.unpackbits(raw, axis=1, bitorder="little")
    carried = widths.sheet.columns * widths.level_bits
    if bits[:, carried:].any():
        raise PacketError("content", "a bitmap row is filled up with something other than zeros")
    cells = bits[:, :carried].reshape(len(bits), -1, widths.level_bits)
    levels = (cells << np.arange(widths.level_bits, dtype=np.uint8)).sum(axis=2)
    if levels.max() > widths.sheet.levels:
        raise PacketError("content", f"a cell has level {levels.max()}; the sheet has {widths.sheet.levels}")
    rows: list[list[int]] = levels.tolist()
    return rows


def _split(word: int, *widths: int) -> list[int]:
    fields = []
    for width in widths:
        fields.append(word & (1 << width) - 1)
        word >>= width
    return [*fields, word]
