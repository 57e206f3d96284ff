"""What travels on the wire: packets, their fields and their framing (docs/protocol.md)."""

from __future__ import annotations

import binascii
import dataclasses
import struct
from typing import Any

import numpy as np

from contactfpga.derived import CHECK_BYTES, SEQUENCE_BITS, STUCK_BITS, TIME_BITS, Derived
from contactfpga.limits import BARYCENTER_BITS, MAX_BARYCENTER_BITS
from contactfpga.skin import Skin

VERSION = 1
DELIMITER = 0

KIND_HELLO = 0
KIND_ZONES = 1
KIND_CELLS = 2
KIND_BARYCENTERS = 3

KINDS = {"moments": KIND_ZONES, "cells": KIND_CELLS, "barycenter": KIND_BARYCENTERS}
"""Of a frame, by the Skin's ``report``."""

FLAGS = ("overflow", "mismatch", "requested")
"""Names of a frame's flags, lowest bit first."""

FLAG_BITS = len(FLAGS)
KIND_BITS = 2

_HELLO = struct.Struct("<BBBHfff8s")
_OPTIONS = {"connectivity": (8, 4), "report": ("moments", "cells"), "send": ("always", "on_change")}
_FRACTION = len(_OPTIONS)
"""Four of the options' bits from here on: 0, or with ``report = "barycenter"`` one more than its fraction bits."""
_GHOSTS = _FRACTION + 4
"""The bit that is set without diodes."""


class PacketError(ValueError):
    """Bytes that are not a whole, valid packet.

    ``reason`` is a key of the driver's counters; ``kind`` and ``version`` are those of a packet of another version.
    """

    def __init__(self, reason: str, message: str, kind: int = 0, version: int = VERSION):
        super().__init__(message)
        self.reason = reason
        self.kind = kind
        self.version = version


def kind_byte(kind: int, flags: int = 0) -> int:
    """Last plain byte of every packet: flags in the lower three bits, kind in two, version in the upper three."""
    return VERSION << FLAG_BITS + KIND_BITS | kind << FLAG_BITS | flags


def kind_of(plain: bytes) -> int:
    """Kind of an unsealed packet."""
    return plain[-1] >> FLAG_BITS & (1 << KIND_BITS) - 1


@dataclasses.dataclass(frozen=True)
class Hello:
    """What the board says of itself: all that decoding its frames needs."""

    rows: int
    columns: int
    connectivity: int
    report: str
    barycenter_bits: int
    send: str
    zone_capacity: int
    pitch_x_mm: float
    pitch_y_mm: float
    radius_mm: float | None
    fingerprint: bytes
    ghosts: bool = False
    """The sheet has no diodes."""

    @classmethod
    def of(cls, skin: Skin) -> Hello:
        assert skin.zone_capacity is not None
        shared = {field.name for field in dataclasses.fields(cls)}
        return cls(**{name: getattr(skin, name) for name in shared})

    def skin(self) -> Skin:
        """A Skin with this hello's facts: it decodes the board's frames; its clock and scan times are unknown."""
        slow: dict[str, Any] = {
            "clock_hz": 400_000_000,
            "settle_us": 10_000.0,
        }  # what the host does not know must not refuse
        return Skin(
            **{name: getattr(self, name) for name in _FACTS},
            surface="plane" if self.radius_mm is None else "cylinder",
            diodes="none" if self.ghosts else "col2row",
            **slow,
        )


_FACTS = (
    *("rows", "columns", "connectivity", "report", "barycenter_bits", "zone_capacity"),
    *("pitch_x_mm", "pitch_y_mm", "radius_mm"),
)


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


def check_bytes(stuffed: bytes) -> bytes:
    """CRC-16/MCRF4XX of the stuffed bytes, lowest bits first, in three bytes that are never zero.

    That CRC takes bits in the order of the line; the standard library has its mirror image.
    """
    mirrored = binascii.crc_hqx(stuffed.translate(_MIRRORED), 0xFFFF)
    crc = _MIRRORED[mirrored >> 8] | _MIRRORED[mirrored & 0xFF] << 8
    return bytes([0x80 | crc & 0x7F, 0x80 | crc >> 7 & 0x7F, 0x80 | crc >> 14])


def seal(plain: bytes) -> bytes:
    """A packet's bytes on the wire: stuffed, check bytes, delimiter."""
    stuffed = cobs_encode(plain)
    return stuffed + check_bytes(stuffed) + bytes([DELIMITER])


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


def encode_hello(skin: Skin) -> bytes:
    """The hello of a board built from ``skin``, as on the wire: at most 32 bytes."""
    facts = Hello.of(skin)
    chosen = {name: getattr(facts, name) for name in _OPTIONS}
    options = facts.ghosts << _GHOSTS
    if facts.report == "barycenter":
        chosen["report"] = "moments"
        options |= facts.barycenter_bits + 1 << _FRACTION
    options |= sum(choices.index(chosen[name]) << bit for bit, (name, choices) in enumerate(_OPTIONS.items()))
    plain = _HELLO.pack(
        facts.rows,
        facts.columns,
        options,
        facts.zone_capacity,
        facts.pitch_x_mm,
        facts.pitch_y_mm,
        facts.radius_mm or 0.0,
        facts.fingerprint,
    )
    return seal(plain + bytes([kind_byte(KIND_HELLO)]))


def decode_hello(plain: bytes) -> Hello:
    """Read an unsealed hello."""
    if kind_of(plain) != KIND_HELLO or len(plain) != _HELLO.size + 1:
        raise PacketError("length", f"hello of {len(plain)} bytes; it has {1 + _HELLO.size}")
    rows, columns, options, capacity, pitch_x, pitch_y, radius, fingerprint = _HELLO.unpack(plain[:-1])
    chosen: dict[str, Any] = {name: choices[options >> bit & 1] for bit, (name, choices) in enumerate(_OPTIONS.items())}
    chosen["barycenter_bits"] = BARYCENTER_BITS
    if fraction := options >> _FRACTION & (1 << _GHOSTS - _FRACTION) - 1:
        if fraction > MAX_BARYCENTER_BITS + 1 or chosen["report"] != "moments":
            raise PacketError("content", f"hello with options {options:#x}, which this version does not know")
        chosen |= {"report": "barycenter", "barycenter_bits": fraction - 1}
    return Hello(
        rows=rows,
        columns=columns,
        zone_capacity=capacity,
        pitch_x_mm=_shortest(pitch_x),
        pitch_y_mm=_shortest(pitch_y),
        radius_mm=_shortest(radius) or None,
        fingerprint=fingerprint,
        ghosts=bool(options >> _GHOSTS),
        **chosen,
    )


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
