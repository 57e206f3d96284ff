"""Framing of packets: stuffing, check bytes, delimiter, last byte."""

from __future__ import annotations

import binascii

from contactfpga.choices.reports import REPORTS
from contactfpga.skin.derived import CHECK_BYTES

VERSION = 2
DELIMITER = 0

FLAG_BITS = 4
KIND_BITS = 4

KIND_HELLO = 4
KINDS = {report.name: report.kind for report in REPORTS.values()}
"""Packet kind of a frame by the Skin's ``report``."""

OLD_KINDS = (2, 3)
"""Kind bytes of protocol 1."""
_OLD_HELLO_BITS = 0xF8, 0x20
_OLD_HELLO_BYTES = 26

SHORTEST_PACKET = CHECK_BYTES + 2

DIGIT_BITS = 7


def digits(value: int, count: int) -> bytes:
    """A number in ``count`` digits of seven bits, lowest first; no digit is a zero byte."""
    assert 0 <= value < 1 << DIGIT_BITS * count, f"{value} does not fit {count} digits"
    return bytes(0x80 | value >> DIGIT_BITS * place & 0x7F for place in range(count))


def number(data: bytes) -> int:
    return sum((byte & 0x7F) << DIGIT_BITS * place for place, byte in enumerate(data))


def last_byte(kind: int, flags: int = 0) -> int:
    """Last plain byte of every packet: flags in the lower four bits, kind in the upper four."""
    return kind << FLAG_BITS | flags


class PacketError(ValueError):
    """A packet's bytes are invalid. ``reason`` is a key of the driver's counters."""

    def __init__(self, reason: str, message: str):
        super().__init__(message)
        self.reason = reason


class OldPacket(PacketError):
    """A valid packet of protocol 1; ``hello``: whether it is a hello."""

    def __init__(self, hello: bool):
        super().__init__("version", f"packet of protocol version 1; this host speaks {VERSION}")
        self.hello = hello


def kind_of(plain: bytes) -> int:
    return plain[-1] >> FLAG_BITS


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
    """CRC-16/MCRF4XX of ``before`` and the stuffed bytes, lowest bits first, in three nonzero bytes.

    The CRC takes bits in line order; the standard library's takes them mirrored.
    """
    mirrored = binascii.crc_hqx((before + stuffed).translate(_MIRRORED), 0xFFFF)
    crc = _MIRRORED[mirrored >> 8] | _MIRRORED[mirrored & 0xFF] << 8
    return bytes([0x80 | crc & 0x7F, 0x80 | crc >> 7 & 0x7F, 0x80 | crc >> 14])


_MARK, _ONE, _ZERO = 0xF0, 0xFF, 0x00
_PULSES = [bytes(_ONE if byte >> bit & 1 else _ZERO for bit in range(8)) for byte in range(256)]
_PULSES[DELIMITER] = bytes([_MARK])


def pulses(data: bytes) -> bytes:
    """Bytes as pulses, for a board whose bits on the line are too short to be sampled. A zero byte is a low level of 5
    bits; a bit of another byte, lowest first, is one of 9 bits for 0 and of 1 for 1."""
    return b"".join(_PULSES[byte] for byte in data)


def seal(plain: bytes, before: bytes = b"") -> bytes:
    """A packet's bytes on the wire: stuffed, check bytes, delimiter; ``before`` as in :func:`check_bytes`."""
    stuffed = cobs_encode(plain)
    return stuffed + check_bytes(stuffed, before) + bytes([DELIMITER])


def unreadable(packet: bytes) -> bool:
    """Whether a packet from the board may be whole, as far as can be told without its fingerprint."""
    marked = all(byte & 0x80 for byte in packet[-CHECK_BYTES:]) and packet[-1] < 0x84
    return len(packet) >= SHORTEST_PACKET and marked and not _bare(packet[-CHECK_BYTES - 1])


def _bare(last: int) -> bool:
    """Whether the check of a packet with this last byte covers only its stuffed bytes."""
    return last >> FLAG_BITS in (KIND_HELLO, *OLD_KINDS)


def unseal(packet: bytes, before: bytes) -> bytes:
    """Undo :func:`seal` for a packet from the board, without its delimiter. Raises :class:`PacketError`.

    ``before``: :func:`contactfpga.wire.protocol.check_prefix`, in the checks of all packets except hellos.
    """
    stuffed, check = packet[:-CHECK_BYTES], packet[-CHECK_BYTES:]
    if len(stuffed) < 2:
        raise PacketError("framing", f"packet of {len(packet)} bytes; the shortest has {SHORTEST_PACKET}")
    last = stuffed[-1]  # the last plain byte is never zero, so that it is the last stuffed one as well
    if check != check_bytes(stuffed, b"" if _bare(last) else before):
        raise PacketError("crc", f"CRC of a packet of {len(packet)} bytes does not match")
    plain = cobs_decode(stuffed)
    if not plain or plain[-1] != last:
        raise PacketError("framing", f"packet of {len(packet)} bytes ends with a zero byte")
    if last >> FLAG_BITS in OLD_KINDS:
        mask, old = _OLD_HELLO_BITS
        raise OldPacket(last & mask == old and len(plain) == _OLD_HELLO_BYTES)
    return plain
