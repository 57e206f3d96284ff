"""Packets on the wire and their fields."""

from __future__ import annotations

import dataclasses
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
    "FLAGS",
    "FLAG_BITS",
    "FLAG_SETS",
    "HEARD_DIGITS",
    "KINDS",
    "KIND_BITS",
    "KIND_HELLO",
    "KIND_REQUEST",
    "NO_RECORDS",
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
    "decode_frame",
    "digits",
    "encode_hello",
    "encode_request",
    "kind_of",
    "last_byte",
    "may_number",
    "seal",
    "unseal",
]

FLAGS = ("overflow", "mismatch", "fault", "motion")
"""Names of a frame's flags, lowest bit first."""

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
    barycenters: np.ndarray | None = None
    """(n, 3) int64 area, x, y of each zone with ``report = "barycenter"``, x and y in cells / 2^``barycenter_bits``;
    otherwise None."""


def decode_frame(plain: bytes, widths: Widths) -> Frame:
    """Read an unsealed frame of the sheet of ``widths``. Raises :class:`PacketError` if its length contradicts its zone
    count, or, without a mismatch flag, its cells contradict its zones."""
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
    flags = FLAG_SETS[plain[-1] & (1 << len(FLAGS)) - 1]
    expected = sheet.rows if sheet.report == "cells" else zones
    carried = min(expected, widths.max_items)
    if items != carried or ("overflow" in flags) != (carried < expected):
        raise PacketError("length", f"frame carries {items} items, states {expected} and the flags {sorted(flags)}")
    if zones > (0 if sheet.report == "cells" else sheet.max_zones()):
        raise PacketError("content", f"frame states {zones} zones; the sheet holds at most {sheet.max_zones()}")
    frame = Frame(
        sequence=sequence,
        time_us=time_us,
        flags=flags,
        overwritten=overwritten,
        heard=heard,
        zones=zones,
        cells=cells,
        moments=_records(plain[:body], items, widths) if sheet.report == "moments" else no_records(sheet),
        bitmap=_bitmap(plain[:body], widths) if sheet.report == "cells" else None,
        barycenters=_barycenters(plain[:body], items, widths) if sheet.report == "barycenter" else None,
    )
    if "mismatch" not in flags:
        _check_sums(frame, widths)
    return frame


NO_RECORDS = np.zeros((0, 3), np.int64)
NO_RECORDS.flags.writeable = False
_NO_CLOSED_RECORDS = np.zeros((0, 4), np.int64)
_NO_CLOSED_RECORDS.flags.writeable = False


def no_records(sheet: Sheet) -> np.ndarray:
    return _NO_CLOSED_RECORDS if sheet.closed else NO_RECORDS


FLAG_SETS = [frozenset(name for bit, name in enumerate(FLAGS) if word >> bit & 1) for word in range(1 << len(FLAGS))]


def _check_sums(frame: Frame, widths: Widths) -> None:
    sheet = widths.sheet
    if frame.bitmap is not None:
        carried = int(frame.bitmap.sum())
        possible = carried == frame.cells
    else:
        most_x, most_y = sheet.columns - 1, sheet.rows - 1
        if frame.barycenters is None:
            area, x, y, *past = frame.moments.T.tolist()
            inside = all(x <= a * most_x and y <= a * most_y for a, x, y in zip(area, x, y))
            whole = (1 << widths.area_bits) - 1
            inside &= all(t <= a or t == whole for cells in past for a, t in zip(area, cells))
        else:
            area, x, y = frame.barycenters.T.tolist()
            bits = sheet.barycenter_bits
            inside = all(x <= most_x << bits and y <= most_y << bits for x, y in zip(x, y))
        carried = sum(area)
        possible = (
            all(area) and inside and (carried < frame.cells if "overflow" in frame.flags else carried == frame.cells)
        )
    if not possible or frame.cells > widths.cells:
        raise PacketError("content", f"frame carries {carried} cells and states {frame.cells}, or zones that cannot be")


def _records(data: bytes, zones: int, widths: Widths) -> np.ndarray:
    if not zones:
        return no_records(widths.sheet)
    size = widths.record_bytes
    *bits, last_bits = widths.record_bits
    rows = [_split(int.from_bytes(data[start : start + size], "little"), *bits) for start in range(0, len(data), size)]
    if max(row[-1] for row in rows) >> last_bits:
        raise PacketError("content", "a zone record is filled up with something other than zeros")
    return np.array(rows, np.int64)


def _barycenters(data: bytes, zones: int, widths: Widths) -> np.ndarray:
    """(zones, 3) int64 with ``report = "barycenter"``; an area of all cells, sent as 0, is restored."""
    records = _records(data, zones, widths)
    if widths.cells == 1 << widths.record_bits[0] and zones:
        records[records[:, 0] == 0, 0] = widths.cells
    return records


def _bitmap(data: bytes, widths: Widths) -> np.ndarray:
    raw = np.frombuffer(data, np.uint8).reshape(widths.sheet.rows, widths.bitmap_row_bytes)
    bits = np.unpackbits(raw, axis=1, bitorder="little")
    if bits[:, widths.sheet.columns :].any():
        raise PacketError("content", "a bitmap row is filled up with something other than zeros")
    return bits[:, : widths.sheet.columns].astype(bool)


def _split(word: int, *widths: int) -> list[int]:
    fields = []
    for width in widths:
        fields.append(word & (1 << width) - 1)
        word >>= width
    return [*fields, word]
