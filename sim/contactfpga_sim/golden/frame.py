"""Frame: what is packed into a packet, when, and whether it is sent."""

from __future__ import annotations

import binascii
import dataclasses
import struct

import numpy as np

from contactfpga_sim.golden.facts import Facts
from contactfpga_sim.golden.link import Link
from contactfpga_sim.golden.scan import Scan

HELLO, ZONES, CELLS = 1, 2, 3
OVERFLOW, REQUESTED = 1, 4


def lead(kind: int) -> int:
    """First byte of a packet of protocol version 1."""
    return 1 << 3 | kind


class Packet:
    """A packet while it is packed: the CRC runs along, and COBS blocks fill up."""

    def __init__(self, kind: int):
        self._plain = bytearray()
        self._block = 0
        self.push(bytes([lead(kind)]))

    def push(self, plain: bytes) -> int:
        """Pack bytes; returns the cycles that takes."""
        cycles = 0
        for byte in plain:
            cycles += 1
            if self._block == 254:
                cycles += 1
                self._block = 0
            self._block = self._block + 1 if byte else 0
            self._plain.append(byte)
        return cycles

    def push_crc(self) -> int:
        """Pack the CRC of all bytes so far; returns the cycles that takes."""
        return self.push(binascii.crc_hqx(bytes(self._plain), 0xFFFF).to_bytes(2, "big"))

    def wire(self) -> bytes:
        """The packet as it goes over the wire, delimiter included."""
        return stuff(bytes(self._plain)) + b"\0"


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


def hello(facts: Facts) -> bytes:
    """The hello of the board, as on the wire."""
    skin = facts.skin
    assert skin.zone_capacity is not None
    options = (skin.connectivity == 4) | (skin.report == "cells") << 1 | (skin.send == "on_change") << 2
    sizes = struct.pack("<BBBH", skin.rows, skin.columns, options, skin.zone_capacity)
    lengths = struct.pack("<fff", skin.pitch_x_mm, skin.pitch_y_mm, skin.radius_mm or 0.0)
    packet = Packet(HELLO)
    packet.push(sizes + lengths + facts.fingerprint)
    packet.push_crc()
    return packet.wire()


@dataclasses.dataclass(frozen=True)
class Items:
    """What one scan hands to the packer."""

    scan: Scan
    cells: np.ndarray
    """(R, C) bool: the cells that count, debounced."""
    records: list[tuple[int, int]]
    """(cycle, data) of every item, in the order of cycles."""
    end: int
    """Cycle of the end mark."""


class Packer:
    """Packs frame after frame, decides what is sent, and hands it to the link."""

    def __init__(self, facts: Facts, link: Link):
        self._facts = facts
        self._link = link
        self._free = 1
        self._index = 0
        self._last_sent = 0
        self._before: np.ndarray | None = None
        self._overwritten = 0
        self._carried_request = False

    def take(self, items: Items) -> None:
        """Pack one frame."""
        packet = Packet(ZONES if self._facts.moments else CELLS)
        for put, data in items.records[: self._facts.capacity]:
            taken = max(self._free, put + 2)
            self._free = taken + packet.push(data.to_bytes(self._facts.item_bytes, "little"))
        taken = max(self._free, items.end + 2)
        self._link.advance(taken)
        if self._is_sent(items):
            self._send(packet, items, taken)
        else:
            self._free = taken + 2
        self._before = items.cells
        self._index += 1
        if self._index % self._facts.hello_scans == 0:
            self._link.want_hello(taken + 1)

    def _is_sent(self, items: Items) -> bool:
        if self._facts.skin.send == "always" or self._before is None or items.scan.requested:
            return True
        changed = not np.array_equal(items.cells, self._before)
        return changed or self._index - self._last_sent >= self._facts.keep_alive_scans

    def _send(self, packet: Packet, items: Items, taken: int) -> None:
        requested = items.scan.requested
        if self._link.drop():
            self._overwritten += 1
            requested |= self._carried_request
        self._carried_request = requested
        closing = packet.push(self._trailer(items, requested)) + packet.push_crc()
        self._link.offer(taken + closing + 2, packet.wire())
        self._free = taken + closing + 3
        self._last_sent = self._index

    def _trailer(self, items: Items, requested: bool) -> bytes:
        facts = self._facts
        overflow = len(items.records) > facts.capacity
        fields = (
            (items.scan.time_us % 2**24, 24),
            (self._link.sent % 256, 8),
            (self._overwritten % 256, 8),
            (overflow * OVERFLOW | requested * REQUESTED, 3),
            (min(items.scan.stuck, 15), 4),
            (int(items.cells.sum()), facts.area_bits),
            (len(items.records) if facts.moments else 0, facts.zones_bits),
        )
        word, width = join(fields)
        return word.to_bytes(-(-width // 8), "little")


def join(fields: tuple[tuple[int, int], ...]) -> tuple[int, int]:
    """Bit fields (value, width) without gaps, the first one lowest; and the width of all."""
    word = width = 0
    for value, field_width in fields:
        assert 0 <= value < 2**field_width, f"{value} does not fit {field_width} bits"
        word |= value << width
        width += field_width
    return word, width
