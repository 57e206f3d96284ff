"""What travels on the wire: packets, their fields and their framing (docs/protocol.md)."""

from __future__ import annotations

import binascii
import dataclasses
import struct
import zlib
from typing import Any

import numpy as np

from contactfpga.derived import CHECK_BYTES, HEARD_BITS, SEQUENCE_BITS, TIME_BITS, Derived
from contactfpga.skin import Skin

VERSION = 2
DELIMITER = 0

FLAGS = ("overflow", "mismatch", "fault")
"""Names of a frame's flags, lowest bit first."""

FLAG_BITS = 4
KIND_BITS = 4

KIND_HELLO = 4
KINDS = {"moments": 5, "cells": 6, "barycenter": 7}
"""Kind of a frame, by the Skin's ``report``."""

KIND_REQUEST = 5
"""To the board."""
REQUEST_HELLO = 1
"""Flag of a request that asks for a hello as well."""

# ---- fields of a hello

SHEET, STATE, PITCH, RADIUS, FINGERPRINT, RATES, NAME, COMMANDS, CHECK = 1, 2, 3, 4, 5, 6, 7, 8, 255

_SHEET = struct.Struct("<BBBBBBHBx")
_PITCH = struct.Struct("<dd")
_RADIUS = struct.Struct("<d")
_RATES = struct.Struct("<II")
_CHECK = struct.Struct("<I")
_REPORTS = ("moments", "cells", "barycenter")
_SENDS = ("always", "on_change")

DIGIT_BITS = 7
SENT_DIGITS, EPOCH_DIGITS, HEARD_DIGITS, STUCK_DIGITS = 7, 4, 3, 1
STATE_DIGITS = 16
"""Of which the last is not used yet."""

STATE_OFFSET = 16
"""Of the first digit in a hello as :func:`encode_hello` writes it, from the leading delimiter on."""


def digits(value: int, count: int) -> bytes:
    """A number in ``count`` digits of seven bits, lowest first, none of them a zero byte."""
    assert 0 <= value < 1 << DIGIT_BITS * count, f"{value} does not fit {count} digits"
    return bytes(0x80 | value >> DIGIT_BITS * place & 0x7F for place in range(count))


def encode_hello(skin: Skin, sent: int = 0, epoch: int = 0, heard: int = 0, stuck: int = 0) -> bytes:
    """The hello of a board built from ``skin``, as on the wire, with a delimiter at either end."""
    assert skin.zone_capacity is not None
    fraction_bits = skin.barycenter_bits if skin.report == "barycenter" else 0
    sheet = _SHEET.pack(
        skin.rows,
        skin.columns,
        skin.connectivity,
        _REPORTS.index(skin.report),
        fraction_bits,
        _SENDS.index(skin.send),
        skin.zone_capacity,
        skin.ghosts,
    )
    facts = [(SHEET, sheet), (PITCH, _PITCH.pack(skin.pitch_x_mm, skin.pitch_y_mm))]
    if skin.radius_mm is not None:
        facts.append((RADIUS, _RADIUS.pack(skin.radius_mm)))
    facts += [(FINGERPRINT, skin.fingerprint), (RATES, _RATES.pack(skin.clock_hz, skin.baud))]
    if skin.name:
        facts.append((NAME, skin.name.encode()))
    fixed = [bytes([kind, len(value)]) + value for kind, value in facts]
    counters = ((sent, SENT_DIGITS), (epoch, EPOCH_DIGITS), (heard, HEARD_DIGITS), (stuck, STUCK_DIGITS), (0, 1))
    state = bytes([STATE, STATE_DIGITS]) + b"".join(digits(value, count) for value, count in counters)
    check = bytes([CHECK, _CHECK.size]) + _CHECK.pack(zlib.crc32(b"".join(fixed)))
    plain = fixed[0] + state + b"".join(fixed[1:]) + check + bytes([last_byte(KIND_HELLO)])
    return bytes([DELIMITER]) + seal(plain)


def encode_request(number: int, hello: bool = False) -> bytes:
    """A request with a number that :func:`may_number` allows, as on the wire, with a delimiter at either end."""
    assert may_number(number), f"{number} is no number of a request"
    plain = digits(number, HEARD_DIGITS) + bytes([last_byte(KIND_REQUEST, REQUEST_HELLO * hello)])
    return bytes([DELIMITER]) + seal(plain)


def may_number(number: int) -> bool:
    """Whether a request may have this number: no digit of it is 0, nor are the bits that frames repeat."""
    each = (number >> DIGIT_BITS * place & 0x7F for place in range(HEARD_DIGITS))
    return 0 <= number < 1 << DIGIT_BITS * HEARD_DIGITS and all(each) and number % (1 << HEARD_BITS) != 0


def last_byte(kind: int, flags: int = 0) -> int:
    """Last plain byte of every packet: flags in the lower four bits, kind in the upper four."""
    return kind << FLAG_BITS | flags


class PacketError(ValueError):
    """Bytes that are not a whole, valid packet.

    ``reason`` is a key of the driver's counters; ``kind`` and ``version`` are those of a packet of another version.
    """

    def __init__(self, reason: str, message: str, kind: int = 0, version: int = VERSION):
        super().__init__(message)
        self.reason = reason
        self.kind = kind
        self.version = version


def kind_of(plain: bytes) -> int:
    """Kind of an unsealed packet."""
    return plain[-1] >> FLAG_BITS


class Hello:
    """What the board says of itself."""


@dataclasses.dataclass(frozen=True)
class Frame:
    """One frame as it came over the wire."""

    sequence: int
    """Frames sent before this one, modulo 256."""
    time_us: int
    """Device time of the first row's sample, modulo 2^24 us."""
    flags: frozenset[str]
    overwritten: int
    """Complete frames that a newer one replaced before they were sent, modulo 2^``Derived.overwritten_bits``."""
    stuck: int
    """Columns that read pressed while no row was driven; 7 stands for 7 or more."""
    zones: int
    """Zones on the sheet, also those beyond the capacity; 0 with ``report = "cells"``."""
    cells: int
    """Pressed switches."""
    moments: np.ndarray
    """(n, 3) int64: area, sum x, sum y of each zone the frame carries; (0, 3) with another report than ``moments``."""
    bitmap: np.ndarray | None
    """(rows, columns) bool with ``report = "cells"``, else None."""
    barycenters: np.ndarray | None = None
    """With ``report = "barycenter"`` (n, 3) int64: area, x, y of each zone the frame carries, x and y in cells /
    2^``barycenter_bits``; else None."""


def cobs_encode(data: bytes) -> bytes:
    """Consistent Overhead Byte Stuffing (Cheshire and Baker, 1999), without the delimiter."""
    out = bytearray()
    for index, block in enumerate(blocks := data.split(b"\0")):
        while len(block) > 254 or (len(block) == 254 and index < len(blocks) - 1):
            out += b"\xff" + block[:254]
            block = block[254:]
        out += bytes([len(block) + 1]) + block
    return bytes(out)


def cobs_decode(data: bytes) -> bytes:
    """Undo :func:`cobs_encode`; raises :class:`PacketError` where the blocks do not fit the length."""
    out = bytearray()
    position = 0
    while position < len(data):
        code = data[position]
        end = position + code
        if code == 0 or end > len(data):
            raise PacketError("framing", f"block of {code} bytes at {position} in a packet of {len(data)} bytes")
        out += data[position + 1 : end]
        position = end
        if code < 255 and position < len(data):
            out.append(0)
    return bytes(out)


_MIRRORED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))


def check_bytes(stuffed: bytes, before: bytes = b"") -> bytes:
    """CRC-16/MCRF4XX of ``before`` and the stuffed bytes, lowest bits first, in three bytes that are never zero.

    That CRC takes bits in the order of the line; the standard library has its mirror image.
    """
    mirrored = binascii.crc_hqx((before + stuffed).translate(_MIRRORED), 0xFFFF)
    crc = _MIRRORED[mirrored >> 8] | _MIRRORED[mirrored & 0xFF] << 8
    return bytes([0x80 | crc & 0x7F, 0x80 | crc >> 7 & 0x7F, 0x80 | crc >> 14])


def check_prefix(skin: Skin) -> bytes:
    """What the check of frames covers besides their bytes: the start of the board's fingerprint."""
    return skin.fingerprint[:2]


def seal(plain: bytes, before: bytes = b"") -> bytes:
    """A packet's bytes on the wire: stuffed, check bytes, delimiter. ``before`` as for :func:`check_bytes`."""
    stuffed = cobs_encode(plain)
    return stuffed + check_bytes(stuffed, before) + bytes([DELIMITER])


def unseal(packet: bytes) -> bytes:
    """Undo :func:`seal` for a packet without its delimiter; raises :class:`PacketError`."""
    stuffed, check = packet[:-CHECK_BYTES], packet[-CHECK_BYTES:]
    if len(stuffed) < 2:
        raise PacketError("framing", f"packet of {len(packet)} bytes; the shortest has {CHECK_BYTES + 2}")
    if check != check_bytes(stuffed):
        raise PacketError("crc", f"CRC of a packet of {len(packet)} bytes does not match")
    plain = cobs_decode(stuffed)
    version = plain[-1] >> FLAG_BITS + KIND_BITS if plain else 0
    if version != VERSION:
        message = f"packet of protocol version {version}; this host speaks {VERSION}"
        raise PacketError("version", message, kind_of(plain) if plain else 0, version)
    return plain


def decode_frame(plain: bytes, derived: Derived) -> Frame:
    """Read an unsealed frame of the Skin behind ``derived``.

    Raises :class:`PacketError` unless its length agrees with its zone count and, where the board does not itself
    flag a mismatch, its cells with its zones.
    """
    skin = derived.skin
    kind = KINDS[skin.report]
    if kind_of(plain) != kind:
        raise PacketError("kind", f"packet of kind {kind_of(plain)}; report = {skin.report!r} sends kind {kind}")
    body = len(plain) - derived.trailer_bytes
    items, rest = divmod(body, derived.item_bytes)
    if body < 0 or rest:
        raise PacketError("length", f"frame of {len(plain)} bytes holds no whole number of items")
    time_us, sequence, stuck, cells, zones, overwritten = _split(
        int.from_bytes(plain[body:-1], "little"),
        *(TIME_BITS, SEQUENCE_BITS, STUCK_BITS, derived.area_bits, derived.zones_bits),
    )
    flags = _FLAG_SETS[plain[-1] & (1 << FLAG_BITS) - 1]
    expected = skin.rows if skin.report == "cells" else zones
    carried = min(expected, derived.max_items)
    if items != carried or ("overflow" in flags) != (carried < expected):
        raise PacketError("length", f"frame carries {items} items, states {expected} and the flags {sorted(flags)}")
    if zones > (0 if skin.report == "cells" else skin.max_zones()):
        raise PacketError("content", f"frame states {zones} zones; the sheet holds at most {skin.max_zones()}")
    frame = Frame(
        sequence=sequence,
        time_us=time_us,
        flags=flags,
        overwritten=overwritten,
        stuck=stuck,
        zones=zones,
        cells=cells,
        moments=_records(plain[:body], items, derived) if skin.report == "moments" else _NO_RECORDS,
        bitmap=_bitmap(plain[:body], derived) if skin.report == "cells" else None,
        barycenters=_barycenters(plain[:body], items, derived) if skin.report == "barycenter" else None,
    )
    if "mismatch" not in flags:
        _check_sums(frame, derived)
    return frame


_NO_RECORDS = np.zeros((0, 3), np.int64)
_NO_RECORDS.flags.writeable = False
_FLAG_SETS = [frozenset(name for bit, name in enumerate(FLAGS) if word >> bit & 1) for word in range(1 << FLAG_BITS)]


def _check_sums(frame: Frame, derived: Derived) -> None:
    """Zones and cells of one sheet agree; raises :class:`PacketError`."""
    skin = derived.skin
    if frame.bitmap is not None:
        carried = int(frame.bitmap.sum())
        possible = carried == frame.cells
    else:
        most_x, most_y = skin.columns - 1, skin.rows - 1
        if frame.barycenters is None:
            area, x, y = frame.moments.T.tolist()
            inside = all(x <= a * most_x and y <= a * most_y for a, x, y in zip(area, x, y))
        else:
            area, x, y = frame.barycenters.T.tolist()
            bits = skin.barycenter_bits
            inside = all(x <= most_x << bits and y <= most_y << bits for x, y in zip(x, y))
        carried = sum(area)
        possible = (
            all(area) and inside and (carried < frame.cells if "overflow" in frame.flags else carried == frame.cells)
        )
    if not possible or frame.cells > derived.cells:
        raise PacketError("content", f"frame carries {carried} cells and states {frame.cells}, or zones that cannot be")


def _records(data: bytes, zones: int, derived: Derived) -> np.ndarray:
    """(zones, 3) int64: the fields of zone records."""
    if not zones:
        return _NO_RECORDS
    size = derived.record_bytes
    area_bits, x_bits, y_bits = derived.record_bits
    area_mask, x_mask, shift = (1 << area_bits) - 1, (1 << x_bits) - 1, area_bits + x_bits
    rows = []
    for start in range(0, len(data), size):
        word = int.from_bytes(data[start : start + size], "little")
        rows.append((word & area_mask, word >> area_bits & x_mask, word >> shift))
    if max(row[2] for row in rows) >> y_bits:
        raise PacketError("content", "a zone record is filled up with something other than zeros")
    return np.array(rows, np.int64)


def _barycenters(data: bytes, zones: int, derived: Derived) -> np.ndarray:
    """The same with ``report = "barycenter"``; where all cells of the sheet are sent as 0 they are put back."""
    records = _records(data, zones, derived)
    if derived.cells == 1 << derived.record_bits[0] and zones:
        records[records[:, 0] == 0, 0] = derived.cells
    return records


def _bitmap(data: bytes, derived: Derived) -> np.ndarray:
    raw = np.frombuffer(data, np.uint8).reshape(derived.skin.rows, derived.bitmap_row_bytes)
    bits = np.unpackbits(raw, axis=1, bitorder="little")
    if bits[:, derived.skin.columns :].any():
        raise PacketError("content", "a bitmap row is filled up with something other than zeros")
    return bits[:, : derived.skin.columns].astype(bool)


def _split(word: int, *widths: int) -> list[int]:
    """Fields of a word, lowest first, and what is left above them."""
    fields = []
    for width in widths:
        fields.append(word & (1 << width) - 1)
        word >>= width
    return [*fields, word]


def _shortest(value: float) -> float:
    """The decimal number that a 32-bit float was made from."""
    return float(f"{value:.7g}")
