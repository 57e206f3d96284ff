"""Packing of bytes for the wire, with stuffing and check."""

from __future__ import annotations


class Packet:
    """A packet being packed into COBS blocks."""

    def __init__(self) -> None:
        self._plain = bytearray()
        self._block = 0

    def push(self, plain: bytes) -> int:
        """Pack bytes; returns the number of cycles."""
        cycles = 0
        for byte in plain:
            cycles += 1
            if self._block == 254:
                cycles += 1
                self._block = 0
            self._block = self._block + 1 if byte else 0
            self._plain.append(byte)
        return cycles

    def wire(self, before: bytes = b"", after: bytes = b"") -> bytes:
        """The packet as on the wire: stuffed bytes, ``after``, check bytes, delimiter. The check also covers
        ``before``."""
        stuffed = stuff(bytes(self._plain)) + after
        return stuffed + check(stuffed, before) + b"\0"


def check(stuffed: bytes, before: bytes = b"") -> bytes:
    """Check bytes of a packet."""
    crc = crc16(before + stuffed)
    return bytes(128 + piece for piece in (crc % 128, crc // 128 % 128, crc // 128**2))


def crc16(data: bytes) -> int:
    """CRC-16/MCRF4XX: x^16 + x^12 + x^5 + 1, register full of ones, lowest bit of each byte first."""
    crc = 0xFFFF
    for byte in data:
        for bit in range(8):
            feedback = (crc ^ byte >> bit) & 1
            crc = crc >> 1 ^ feedback * 0x8408
    return crc


def stuff(plain: bytes) -> bytes:
    """Consistent Overhead Byte Stuffing (Cheshire and Baker, 1999), table 1, byte by byte."""
    out = bytearray([0])
    code = 0
    for index, byte in enumerate(plain):
        if byte:
            out.append(byte)
        length = len(out) - code
        full = length == 255 and index + 1 < len(plain)
        if not byte or full:
            out[code] = length
            code = len(out)
            out.append(0)
    out[code] = len(out) - code
    return bytes(out)
