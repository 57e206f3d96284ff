"""Frame: what is packed into a packet, when, and whether it is sent."""

from __future__ import annotations

import dataclasses
import struct

import numpy as np

from contactfpga_sim.golden.facts import Facts
from contactfpga_sim.golden.link import Link
from contactfpga_sim.golden.scan import Scan

HELLO, ZONES, CELLS, BARYCENTERS = 0, 1, 2, 3
OVERFLOW, REQUESTED = 1, 4
VERSION = 1


class Packet:
    """A packet while it is packed: COBS blocks fill up."""

    def __init__(self) -> None:
        self._plain = bytearray()
        self._block = 0

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

    def wire(self) -> bytes:
        """The packet as it goes over the wire: stuffed, check bytes, delimiter."""
        stuffed = stuff(bytes(self._plain))
        crc = crc16(stuffed)
        return stuffed + bytes(128 + piece for piece in (crc % 128, crc // 128 % 128, crc // 128**2)) + b"\0"


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


def hello(facts: Facts) -> bytes:
    """The hello of the board, as on the wire."""
    skin = facts.skin
    assert skin.zone_capacity is not None
    options = (skin.connectivity == 4) | (skin.report == "cells") << 1 | (skin.send == "on_change") << 2
    options += 8 * (1 + skin.barycenter_bits) * facts.divided
    options += 128 * (skin.diodes == "none")
    sizes = struct.pack("<BBBH", skin.rows, skin.columns, options, skin.zone_capacity)
    lengths = struct.pack("<fff", skin.pitch_x_mm, skin.pitch_y_mm, skin.radius_mm or 0.0)
    packet = Packet()
    packet.push(sizes + lengths + facts.fingerprint + bytes([VERSION << 5 | HELLO << 3]))
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


class Queue:
    """Where items wait for the packer."""

    def offer(self, put: int, data: int) -> tuple[int, int]:
        """A record put in at a cycle: from which one on the packer can take it, and the item's bits."""
        return put + 2, data

    def take(self, cycle: int, item: int) -> None:
        """The packer reads the last byte of the item offered last."""

    def pass_end(self, cycle: int) -> None:
        """The packer takes an end mark."""


class Packer:
    """Packs frame after frame, decides what is sent, and hands it to the link."""

    def __init__(self, facts: Facts, link: Link, queue: Queue):
        self._facts = facts
        self._link = link
        self._queue = queue
        self._free = 0
        self._since_sent = 0
        self._since_hello = 0
        self._before: np.ndarray | None = None
        self._overwritten = 0
        self._carried_request = False

    def take(self, items: Items) -> None:
        """Pack one frame."""
        packet = Packet()
        for put, data in items.records[: self._facts.capacity]:
            offered, item = self._queue.offer(put, data)
            plain = item.to_bytes(self._facts.item_bytes, "little")
            last = max(self._free, offered) + packet.push(plain[:-1])
            self._queue.take(last, item)
            self._free = last + packet.push(plain[-1:])
        taken = max(self._free, items.end + 2)
        self._queue.pass_end(taken)
        self._link.advance(taken)
        self._since_sent += items.scan.slots
        self._since_hello += items.scan.slots
        if self._is_sent(items):
            self._send(packet, items, taken)
            self._since_sent = 0
        else:
            self._free = taken + 1
        self._before = items.cells
        if self._since_hello >= self._facts.hello_slots:
            self._link.want_hello(taken + 1)
            self._since_hello = 0

    def _is_sent(self, items: Items) -> bool:
        if self._facts.skin.send == "always" or self._before is None or items.scan.requested:
            return True
        changed = not np.array_equal(items.cells, self._before)
        return changed or self._since_sent >= self._facts.keep_alive_slots

    def _send(self, packet: Packet, items: Items, taken: int) -> None:
        requested = items.scan.requested
        if self._link.drop():
            self._overwritten += 1
            requested |= self._carried_request
        self._carried_request = requested
        closing = packet.push(self._trailer(items, requested))
        self._link.offer(taken + closing + 2, packet.wire())
        self._free = taken + closing + 2

    def _trailer(self, items: Items, requested: bool) -> bytes:
        facts = self._facts
        overflow = len(items.records) > facts.capacity
        cells = int(items.cells.sum())
        zones = len(items.records) if facts.zones else 0
        counted = 24 + 8 + 3 + facts.area_bits + facts.zones_bits
        room = -(-(counted + 4) // 8) * 8 - counted
        word, width = join(
            (
                (items.scan.time_us % 2**24, 24),
                (self._link.sent % 256, 8),
                (min(items.scan.stuck, 7), 3),
                (cells, facts.area_bits),
                (zones, facts.zones_bits),
                (self._overwritten % 2**room, room),
                (overflow * OVERFLOW | requested * REQUESTED, 3),
                (BARYCENTERS if facts.divided else ZONES if facts.zones else CELLS, 2),
                (VERSION, 3),
            )
        )
        return word.to_bytes(width // 8, "little")


def join(fields: tuple[tuple[int, int], ...]) -> tuple[int, int]:
    """Bit fields (value, width) without gaps, the first one lowest; and the width of all."""
    word = width = 0
    for value, field_width in fields:
        assert 0 <= value < 2**field_width, f"{value} does not fit {field_width} bits"
        word |= value << width
        width += field_width
    return word, width
