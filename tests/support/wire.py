"""What a board sends, written from docs/protocol.md for the tests alone; shares no code with the product."""

import struct

from cobs import cobs

VERSION = 1
HELLO, ZONES, CELLS, BARYCENTERS = 0, 1, 2, 3
FLAGS = {"overflow": 1, "mismatch": 2, "requested": 4}


def crc16(data: bytes) -> int:
    """CRC-16/MCRF4XX, bit by bit in the order of the line."""
    crc = 0xFFFF
    for byte in data:
        for index in range(8):
            feedback = (crc ^ byte >> index) & 1
            crc = crc >> 1 ^ (0x8408 if feedback else 0)
    return crc


def check(stuffed: bytes) -> bytes:
    """The three bytes behind the stuffed ones."""
    bits = format(crc16(stuffed), "016b")[::-1]
    return bytes(0x80 | int(part[::-1], 2) for part in (bits[:7], bits[7:14], bits[14:]))


def seal(plain: bytes) -> bytes:
    stuffed = cobs.encode(plain)
    return stuffed + check(stuffed) + b"\0"


def bits_for(largest: int) -> int:
    return max(1, largest.bit_length())


def fields(*pairs) -> bytes:
    """(value, bits) pairs without gaps, lowest first, filled up to whole bytes."""
    text = "".join(format(value, f"0{bits}b")[::-1] for value, bits in pairs)
    assert len(text) == sum(bits for _, bits in pairs), "a value does not fit its field"
    text += "0" * (-len(text) % 8)
    return bytes(int(text[start : start + 8][::-1], 2) for start in range(0, len(text), 8))


def last_byte(kind, flags=(), version=VERSION) -> bytes:
    return bytes([sum(FLAGS[flag] for flag in flags) + 8 * kind + 32 * version])


class Wire:
    """Encodes the packets of one Skin."""

    def __init__(self, skin):
        self.skin = skin
        rows, columns = skin.rows, skin.columns
        self.area_bits = bits_for(rows * columns)
        self.sum_x_bits = bits_for(rows * sum(range(columns)))
        self.sum_y_bits = bits_for(columns * sum(range(rows)))
        if skin.connectivity == 8:
            self.zones_bits = bits_for(-(-rows // 2) * -(-columns // 2))
        else:
            self.zones_bits = bits_for(-(-rows * columns // 2))
        self.overwritten_bits = 4
        while (24 + 8 + 3 + self.area_bits + self.zones_bits + self.overwritten_bits) % 8:
            self.overwritten_bits += 1

    def record(self, area, sum_x, sum_y) -> bytes:
        """A zone's record; with ``report = "barycenter"`` of area, x and y in steps of 1/2^bits of a cell."""
        if self.skin.report == "barycenter":
            step = 2**self.skin.barycenter_bits
            area_bits = bits_for(self.skin.rows * self.skin.columns - 1)
            x_bits, y_bits = (bits_for((lines - 1) * step) for lines in (self.skin.columns, self.skin.rows))
            return fields((area % (1 << area_bits), area_bits), (sum_x, x_bits), (sum_y, y_bits))
        return fields((area, self.area_bits), (sum_x, self.sum_x_bits), (sum_y, self.sum_y_bits))

    def trailer(self, *, time=0, sequence=0, overwritten=0, stuck=0, cells=0, zones=0) -> bytes:
        return fields(
            (time % (1 << 24), 24),
            (sequence % 256, 8),
            (stuck, 3),
            (cells, self.area_bits),
            (zones, self.zones_bits),
            (overwritten % (1 << self.overwritten_bits), self.overwritten_bits),
        )

    def plain_zones(self, moments, *, cells=None, zones=None, flags=(), version=VERSION, **trailer) -> bytes:
        body = b"".join(self.record(*row) for row in moments)
        cells = sum(row[0] for row in moments) if cells is None else cells
        zones = len(moments) if zones is None else zones
        kind = BARYCENTERS if self.skin.report == "barycenter" else ZONES
        return body + self.trailer(cells=cells, zones=zones, **trailer) + last_byte(kind, flags, version)

    def zones(self, moments, **options) -> bytes:
        """A frame with ``report = "moments"`` or ``"barycenter"``; moments are what :meth:`record` takes."""
        return seal(self.plain_zones(moments, **options))

    def plain_cells(self, bitmap, *, cells=None, flags=(), **trailer) -> bytes:
        body = b"".join(fields(*((int(cell), 1) for cell in row)) for row in bitmap)
        cells = sum(int(cell) for row in bitmap for cell in row) if cells is None else cells
        return body + self.trailer(cells=cells, **trailer) + last_byte(CELLS, flags)

    def cells(self, bitmap, **options) -> bytes:
        """A frame with ``report = "cells"``."""
        return seal(self.plain_cells(bitmap, **options))

    def plain_hello(self, version=VERSION) -> bytes:
        skin = self.skin
        options = (skin.connectivity == 4) | (skin.report == "cells") << 1 | (skin.send == "on_change") << 2
        if skin.report == "barycenter":
            options |= (skin.barycenter_bits + 1) << 3
        options |= (skin.diodes == "none") << 7
        sizes = struct.pack("<BBBH", skin.rows, skin.columns, options, skin.zone_capacity)
        lengths = struct.pack("<fff", skin.pitch_x_mm, skin.pitch_y_mm, skin.radius_mm or 0)
        return sizes + lengths + skin.fingerprint + last_byte(HELLO, version=version)

    def hello(self, **options) -> bytes:
        return seal(self.plain_hello(**options))
