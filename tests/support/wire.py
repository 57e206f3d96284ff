"""Packets as a board sends them, and as none does, by the golden model's encoder; shares no code with the product."""

import struct
import zlib

from cobs import cobs

from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.frame import join
from contactfpga_sim.model.golden.packet import check, crc16, stuff
from contactfpga_sim.model.golden.request import request

__all__ = ["check", "crc16", "request"]  # some tests take apart what others take whole

HELLO, ZONES, CELLS, BARYCENTERS, REQUEST, FAULTS, COMMAND = 4, 5, 6, 7, 5, 9, 10
FLAGS = {"overflow": 1, "mismatch": 2, "fault": 4, "motion": 8}
SHEET, STATE, PITCH, RADIUS, FINGERPRINT, RATES, NAME, COMMANDS, UNITS, CHECK = 1, 2, 3, 4, 5, 6, 7, 8, 9, 255
EPOCH_US = 2**22


def seal(plain: bytes, before: bytes = b"") -> bytes:
    stuffed = stuff(plain)
    return stuffed + check(stuffed, before) + b"\0"


def fields(*pairs) -> bytes:
    """(value, bits) pairs without gaps, lowest first, filled up to whole bytes."""
    word, width = join(pairs)
    return word.to_bytes(-(-width // 8), "little")


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


def line(data, bit_clocks) -> list[int]:
    """The levels that carry the bytes, without gaps: 8 data bits, lowest first, between a start and a stop bit."""
    bits = [bit for byte in data for bit in (0, *(byte >> place & 1 for place in range(8)), 1)]
    return [bit for bit in bits for _ in range(bit_clocks)]


def taken_in(packets) -> list:
    """(number, whether a hello is asked for, (what, value) of a command or None) of each packet that a board takes."""
    found = []
    for packet in packets:
        if len(packet) not in (8, 12) or check(packet[:-3]) != packet[-3:]:
            continue
        plain = cobs.decode(packet[:-3])
        command = (undigits(plain[3:4]), undigits(plain[4:7])) if len(packet) == 12 else None
        assert plain[-1] >> 1 == (REQUEST if command is None else COMMAND) << 3
        number = undigits(plain[:3])
        assert all(byte > 0x80 for byte in plain[:3])
        assert number % 8
        found.append((number, bool(plain[-1] & 1), command))
    return found


def field(kind, value) -> bytes:
    return bytes([kind, len(value)]) + value


class Wire:
    """Encodes the packets of one Skin."""

    def __init__(self, skin):
        self.skin = skin
        self.known = facts(skin)
        self.prefix = self.known.fingerprint[:2]
        counted = 24 + 8 + 3 + self.known.area_bits + self.known.zones_bits
        self.overwritten_bits = -(-(counted + 4) // 8) * 8 - counted

    def record(self, area, sum_x, sum_y, *more) -> bytes:
        """A zone's record; with ``report = "barycenter"`` of area, x and y in steps of 1/2^bits of a cell.

        more: the cells past the seam of a closed sheet, then an extent if the Skin has it; nothing stands for zeros.
        """
        known = self.known
        widths = [known.area_bits] * self.skin.closed + [*known.extent_bits]
        rest = zip(more or [0] * len(widths), widths, strict=True)
        if known.divided:
            area_bits, x_bits, y_bits = known.barycenter_bits
            return fields((area % (1 << area_bits), area_bits), (sum_x, x_bits), (sum_y, y_bits), *rest)
        return fields((area, known.area_bits), (sum_x, known.sum_x_bits), (sum_y, known.sum_y_bits), *rest)

    def trailer(self, *, time=0, sequence=0, overwritten=0, heard=1, cells=0, zones=0) -> bytes:
        return fields(
            (time % (1 << 24), 24),
            (sequence % 256, 8),
            (heard % 8, 3),
            (cells, self.known.area_bits),
            (zones, self.known.zones_bits),
            (overwritten % (1 << self.overwritten_bits), self.overwritten_bits),
        )

    def seal(self, plain) -> bytes:
        """Any packet but a hello."""
        return seal(plain, self.prefix)

    def plain_zones(self, moments, *, cells=None, zones=None, flags=(), **trailer) -> bytes:
        body = b"".join(self.record(*row) for row in moments)
        cells = sum(row[0] for row in moments) if cells is None else cells
        zones = len(moments) if zones is None else zones
        kind = BARYCENTERS if self.known.divided else ZONES
        return body + self.trailer(cells=cells, zones=zones, **trailer) + last_byte(kind, flags)

    def zones(self, moments, **options) -> bytes:
        """A frame with ``report = "moments"`` or ``"barycenter"``; moments are what :meth:`record` takes."""
        return self.seal(self.plain_zones(moments, **options))

    def plain_cells(self, bitmap, *, cells=None, flags=(), **trailer) -> bytes:
        width = 1 if self.skin.levels == 1 else 2
        body = b"".join(fields(*((int(cell), width) for cell in row)) for row in bitmap)
        cells = sum(int(cell > 0) for row in bitmap for cell in row) if cells is None else cells
        return body + self.trailer(cells=cells, **trailer) + last_byte(CELLS, flags)

    def cells(self, bitmap, **options) -> bytes:
        """A frame with ``report = "cells"``."""
        return self.seal(self.plain_cells(bitmap, **options))

    def sweep(self, readings, time, sequence, flags=0) -> bytes:
        """What pressure units of 12 bits read; flags: 1, over; 2, armed."""
        plain = b"".join(digits(reading, 2) for reading in readings)
        trailer = digits((sequence % 256) << 24 | time % (1 << 24), 5)
        return self.seal(plain + trailer + bytes([8 << 4 | flags]))

    def report(self, word) -> bytes:
        """What the board knows of its lines."""
        return self.seal(digits(word, -(-self.known.fault_bits // 7)) + last_byte(FAULTS))

    def slot(self, number, rows, columns) -> bytes:
        """A slot of the self-test."""
        word = rows | columns << self.skin.rows
        size = -(-(self.skin.rows + self.skin.columns) // 7)
        return self.seal(digits(number, 2) + digits(word, size) + bytes([FAULTS << 4 | 1]))

    def facts(self) -> dict:
        """Fields of a hello by type, in order, but for state and check."""
        skin = self.skin
        report = ["moments", "cells", "barycenter"].index(skin.report)
        bits = skin.barycenter_bits if skin.report == "barycenter" else 0
        joins = skin.connectivity + 128 * skin.closed + 64 * skin.extent + 16 * (skin.levels - 1)
        sizes = (skin.rows, skin.columns, joins, report, bits, skin.send == "on_change")
        facts = {
            SHEET: struct.pack("<BBBBBBHBB", *sizes, skin.zone_capacity, skin.diodes == "none", skin.guard),
            PITCH: struct.pack("<dd", skin.pitch_x_mm, skin.pitch_y_mm),
        }
        if skin.radius_mm is not None:
            facts[RADIUS] = struct.pack("<d", skin.radius_mm)
        facts[FINGERPRINT] = self.known.fingerprint
        facts[RATES] = struct.pack("<II", skin.clock_hz, skin.baud)
        if skin.name:
            facts[NAME] = skin.name.encode()
        if commands := self.commands:
            facts[COMMANDS] = commands
        if skin.units:  # an MCP3208 at 3.3 V, without sums: 20 clocks of 1 MHz for each
            clocks = 20 * skin.clock_hz // 1_000_000
            facts[UNITS] = struct.pack("<BBBBHI", skin.units, 12, 0, 0, clocks, clocks * skin.units)
        return facts

    @property
    def commands(self) -> bytes:
        """Numbers of the commands that its board takes: a self-test, "sample at", and those of units without sums."""
        moves = self.skin.report == "cells"
        return b"\x01" * self.skin.self_test + b"\x02" * moves + b"\x03\x04" * bool(self.skin.units)

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

    def seal_bare(self, hello_fields) -> bytes:
        """A packet with some fields of a hello."""
        return seal(b"".join(hello_fields) + last_byte(HELLO))


def old_hello() -> bytes:
    """What a board of protocol 1 said of the reference Skin."""
    plain = struct.pack("<BBBHfff", 16, 16, 0, 64, 10.0, 10.0, 0.0) + bytes(range(1, 9)) + bytes([0x20])
    return seal(plain)


def old_frame() -> bytes:
    """A frame of protocol 1."""
    return seal(bytes(7) + bytes([0x28]))
