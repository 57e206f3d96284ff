"""What board and host send, written from docs/protocol.md for the tests alone; shares no code with the product."""

import json
import struct
import zlib
from dataclasses import asdict
from dataclasses import fields as dataclass_fields
from hashlib import sha256

from cobs import cobs

HELLO, ZONES, CELLS, BARYCENTERS, REQUEST = 4, 5, 6, 7, 5
FLAGS = {"overflow": 1, "mismatch": 2, "fault": 4}
SHEET, STATE, PITCH, RADIUS, FINGERPRINT, RATES, NAME, COMMANDS, CHECK = 1, 2, 3, 4, 5, 6, 7, 8, 255
EPOCH_US = 2**22


def crc16(data: bytes) -> int:
    """CRC-16/MCRF4XX, bit by bit in the order of the line."""
    crc = 0xFFFF
    for byte in data:
        for index in range(8):
            feedback = (crc ^ byte >> index) & 1
            crc = crc >> 1 ^ (0x8408 if feedback else 0)
    return crc


def check(stuffed: bytes, before: bytes = b"") -> bytes:
    """The three bytes after the stuffed ones; ``before``: what is covered and not sent."""
    bits = format(crc16(before + stuffed), "016b")[::-1]
    return bytes(0x80 | int(part[::-1], 2) for part in (bits[:7], bits[7:14], bits[14:]))


def seal(plain: bytes, before: bytes = b"") -> bytes:
    stuffed = cobs.encode(plain)
    return stuffed + check(stuffed, before) + b"\0"


def bits_for(largest: int) -> int:
    return max(1, largest.bit_length())


def fields(*pairs) -> bytes:
    """(value, bits) pairs without gaps, lowest first, filled up to whole bytes."""
    text = "".join(format(value, f"0{bits}b")[::-1] for value, bits in pairs)
    assert len(text) == sum(bits for _, bits in pairs), "a value does not fit its field"
    text += "0" * (-len(text) % 8)
    return bytes(int(text[start : start + 8][::-1], 2) for start in range(0, len(text), 8))


def last_byte(kind, flags=()) -> bytes:
    return bytes([sum(FLAGS[flag] for flag in flags) + 16 * kind])


def digits(value, count) -> bytes:
    out = []
    for _ in range(count):
        value, digit = divmod(value, 128)
        out.append(128 + digit)
    return bytes(out)


def undigits(data) -> int:
    return sum((byte - 128) * 128**place for place, byte in enumerate(data))


def fingerprint(skin) -> bytes:
    """Of the fields that differ from their defaults, but for the name and a capacity that is the sheet's default."""
    values = asdict(skin)
    changed = {
        field.name: values[field.name]
        for field in dataclass_fields(skin)
        if field.name not in ("name", "zone_capacity") and values[field.name] != field.default
    }
    if skin.zone_capacity != skin.replace(zone_capacity=None).zone_capacity:
        changed["zone_capacity"] = skin.zone_capacity
    return sha256(json.dumps(changed, sort_keys=True).encode()).digest()[:8]


def request(number, hello=False) -> bytes:
    """A request as the host sends it."""
    return b"\0" + seal(digits(number, 3) + bytes([16 * REQUEST + hello]))


def requests_in(packets) -> list:
    """(number, whether a hello is asked for) of each packet of a host that a board takes."""
    found = []
    for packet in packets:
        if len(packet) != 8 or check(packet[:-3]) != packet[-3:]:
            continue
        plain = cobs.decode(packet[:-3])
        assert plain[3] in (0x50, 0x51)
        number = undigits(plain[:3])
        assert all(byte > 0x80 for byte in plain[:3])
        assert number % 8
        found.append((number, plain[3] == 0x51))
    return found


def field(kind, value) -> bytes:
    return bytes([kind, len(value)]) + value


class Wire:
    """Encodes the packets of one Skin."""

    def __init__(self, skin):
        self.skin = skin
        self.prefix = fingerprint(skin)[:2]
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

    def trailer(self, *, time=0, sequence=0, overwritten=0, heard=1, cells=0, zones=0) -> bytes:
        return fields(
            (time % (1 << 24), 24),
            (sequence % 256, 8),
            (heard % 8, 3),
            (cells, self.area_bits),
            (zones, self.zones_bits),
            (overwritten % (1 << self.overwritten_bits), self.overwritten_bits),
        )

    def seal(self, plain) -> bytes:
        """Any packet but a hello."""
        return seal(plain, self.prefix)

    def plain_zones(self, moments, *, cells=None, zones=None, flags=(), **trailer) -> bytes:
        body = b"".join(self.record(*row) for row in moments)
        cells = sum(row[0] for row in moments) if cells is None else cells
        zones = len(moments) if zones is None else zones
        kind = BARYCENTERS if self.skin.report == "barycenter" else ZONES
        return body + self.trailer(cells=cells, zones=zones, **trailer) + last_byte(kind, flags)

    def zones(self, moments, **options) -> bytes:
        """A frame with ``report = "moments"`` or ``"barycenter"``; moments are what :meth:`record` takes."""
        return self.seal(self.plain_zones(moments, **options))

    def plain_cells(self, bitmap, *, cells=None, flags=(), **trailer) -> bytes:
        body = b"".join(fields(*((int(cell), 1) for cell in row)) for row in bitmap)
        cells = sum(int(cell) for row in bitmap for cell in row) if cells is None else cells
        return body + self.trailer(cells=cells, **trailer) + last_byte(CELLS, flags)

    def cells(self, bitmap, **options) -> bytes:
        """A frame with ``report = "cells"``."""
        return self.seal(self.plain_cells(bitmap, **options))

    def facts(self) -> dict:
        """Fields of a hello by type, in order, but for state and check."""
        skin = self.skin
        report = ["moments", "cells", "barycenter"].index(skin.report)
        bits = skin.barycenter_bits if skin.report == "barycenter" else 0
        sizes = (skin.rows, skin.columns, skin.connectivity, report, bits, skin.send == "on_change")
        facts = {
            SHEET: struct.pack("<BBBBBBHBB", *sizes, skin.zone_capacity, skin.diodes == "none", 0),
            PITCH: struct.pack("<dd", skin.pitch_x_mm, skin.pitch_y_mm),
        }
        if skin.radius_mm is not None:
            facts[RADIUS] = struct.pack("<d", skin.radius_mm)
        facts[FINGERPRINT] = fingerprint(skin)
        facts[RATES] = struct.pack("<II", skin.clock_hz, skin.baud)
        if skin.name:
            facts[NAME] = skin.name.encode()
        return facts

    def hello_fields(self, *, sent=0, epoch=0, heard=0, stuck=0, facts=None) -> list:
        """The fields of a hello, as bytes, in order."""
        facts = self.facts() if facts is None else facts
        checked = [field(kind, value) for kind, value in facts.items()]
        state = digits(sent, 7) + digits(epoch, 4) + digits(heard, 3) + digits(stuck, 1) + digits(0, 1)
        crc = struct.pack("<I", zlib.crc32(b"".join(checked)))
        return [checked[0], field(STATE, state), *checked[1:], field(CHECK, crc)]

    def plain_hello(self, **options) -> bytes:
        return b"".join(self.hello_fields(**options)) + last_byte(HELLO)

    def hello(self, **options) -> bytes:
        return b"\0" + seal(self.plain_hello(**options))


def old_hello() -> bytes:
    """What a board of protocol 1 said of the reference Skin."""
    plain = struct.pack("<BBBHfff", 16, 16, 0, 64, 10.0, 10.0, 0.0) + bytes(range(1, 9)) + bytes([0x20])
    return seal(plain)


def old_frame() -> bytes:
    """A frame of protocol 1."""
    return seal(bytes(7) + bytes([0x28]))
