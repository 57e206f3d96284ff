"""Frames: packing, division into barycenters, and which frames are sent."""

from __future__ import annotations

import dataclasses
from fractions import Fraction

import numpy as np

from contactfpga_sim.model.golden.facts import Facts
from contactfpga_sim.model.golden.link import Link
from contactfpga_sim.model.golden.packet import Packet
from contactfpga_sim.model.golden.scan import Scan
from contactfpga_sim.model.golden.trace import Trace

ZONES, CELLS, BARYCENTERS = 5, 6, 7
OVERFLOW, FAULT, MOTION = 1, 4, 8


@dataclasses.dataclass(frozen=True)
class Items:
    """The packer's input from one scan."""

    scan: Scan
    cells: np.ndarray
    """(R, C) bool: debounced cells, or integers: their levels."""
    records: list[tuple[int, int]]
    """(cycle, data) of every item, in order."""
    end: int
    """Cycle of the end mark."""


class Queue:
    """The queue of items before the packer."""

    def offer(self, put: int, data: int) -> tuple[int, int]:
        """Put a record in; returns the cycle from which the packer can read the item, and the item's bits."""
        return put + 2, data

    def take(self, cycle: int, item: int) -> None:
        """The packer reads the last byte of the latest item."""

    def pass_end(self, cycle: int) -> None:
        """The packer reads an end mark."""


class Packer:
    """Packs frames, decides which are sent, and passes them to the link."""

    def __init__(self, facts: Facts, link: Link, queue: Queue):
        self._facts = facts
        self._link = link
        self._queue = queue
        self._free = 0
        self._since_sent = 0
        self._since_hello = 0
        self._before: np.ndarray | None = None
        self._fault_before = False
        self.due = 0
        """Cycle from which an unchanged frame is sent, for a scan that waits."""
        self._overwritten = 0

    def take(self, items: Items) -> int:
        """Pack one frame; returns the cycle from which the next frame's items can be read."""
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
        self._since_sent += 1
        self._since_hello += 1
        if self._is_sent(items, taken):
            self._send(packet, items, taken)
            self._since_sent = 0
            period = 1024 * self._facts.clocks_per_us
            self.due = (taken // period + self._facts.keep_alive_periods) * period + 1
        else:
            self._free = taken + 1
        self._before, self._fault_before = items.cells, items.scan.fault
        if not self._facts.scan.waits and self._since_hello >= self._facts.hello_scans:
            self._link.want_hello(taken + 1)
            self._since_hello = 0
        return self._free

    def _is_sent(self, items: Items, taken: int) -> bool:
        if self._facts.skin.send == "always" or self._before is None or items.scan.requested:
            return True
        changed = items.scan.fault != self._fault_before or not np.array_equal(items.cells, self._before)
        if self._facts.scan.waits:
            return changed or taken >= self.due
        return changed or self._since_sent >= self._facts.keep_alive_scans

    def _send(self, packet: Packet, items: Items, taken: int) -> None:
        self._overwritten += self._link.drop()
        closing = packet.push(self._trailer(items))
        self._link.offer(taken + closing + 2, packet.wire(self._facts.fingerprint[:2], self._facts.closing))
        self._free = taken + closing + 2

    def _trailer(self, items: Items) -> bytes:
        facts = self._facts
        overflow = len(items.records) > facts.capacity
        cells = int(np.count_nonzero(items.cells))
        zones = len(items.records) if facts.zones else 0
        counted = 24 + 8 + 3 + facts.area_bits + facts.zones_bits
        room = -(-(counted + 4) // 8) * 8 - counted
        word, width = join(
            (
                (items.scan.time_us % 2**24, 24),
                (self._link.sent % 256, 8),
                (items.scan.heard, 3),
                (cells, facts.area_bits),
                (zones, facts.zones_bits),
                (self._overwritten % 2**room, room),
                (overflow * OVERFLOW | items.scan.fault * FAULT | items.scan.motion * MOTION, 4),
                (BARYCENTERS if facts.divided else ZONES if facts.zones else CELLS, 4),
            )
        )
        return word.to_bytes(width // 8, "little")


def barycenter(total: int, area: int, fraction_bits: int) -> int:
    """total / area rounded to steps of 1/2^fraction_bits, halves upward."""
    return int(Fraction(total * 2**fraction_bits, area) + Fraction(1, 2))


class Divider(Queue):
    """Divides one zone at a time; an item enters a trace when the packer reads it."""

    def __init__(self, facts: Facts, trace: Trace):
        self._facts = facts
        self._trace = trace
        self._free = 0
        self._gone = 0

    def offer(self, put: int, data: int) -> tuple[int, int]:
        begun = max(self._free, put + 2)
        last_bit = max(begun + self._facts.division, self._gone)
        self._free = last_bit + 1
        return last_bit + 1, self._item(data)

    def take(self, cycle: int, item: int) -> None:
        self._gone = cycle
        self._trace.items.append((cycle, item, False))

    def pass_end(self, cycle: int) -> None:
        self._free = cycle + 1
        self._trace.items.append((cycle, 0, True))

    def _item(self, data: int) -> int:
        facts = self._facts
        area, rest = data % 2**facts.area_bits, data // 2**facts.area_bits
        sum_x, rest = rest % 2**facts.sum_x_bits, rest // 2**facts.sum_x_bits
        sum_y, extent = rest % 2**facts.sum_y_bits, rest // 2**facts.sum_y_bits
        x, y = (barycenter(total, area, facts.skin.barycenter_bits) for total in (sum_x, sum_y))
        widths = facts.barycenter_bits
        divided = ((area % 2 ** widths[0], widths[0]), (x, widths[1]), (y, widths[2]))
        return join((*divided, (extent, sum(facts.extent_bits))))[0]


def join(fields: tuple[tuple[int, int], ...]) -> tuple[int, int]:
    """Bit fields (value, width) joined without gaps, the first lowest; and their total width."""
    word = width = 0
    for value, field_width in fields:
        assert 0 <= value < 2**field_width, f"{value} does not fit {field_width} bits"
        word |= value << width
        width += field_width
    return word, width
