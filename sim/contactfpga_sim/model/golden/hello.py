"""Hello: a board's self-description with counters (docs/protocol.md)."""

from __future__ import annotations

import bisect
import struct
import zlib
from collections.abc import Sequence

from contactfpga.choices import converters
from contactfpga_sim.model.golden.facts import Facts
from contactfpga_sim.model.golden.packet import Packet
from contactfpga_sim.model.golden.request import Reception
from contactfpga_sim.model.golden.scan import Scan

KIND = 4
SHEET, STATE, PITCH, RADIUS, FINGERPRINT, RATES, NAME, COMMANDS, UNITS, PLACE, CHECK = *range(1, 11), 255
DIGITS = range(16, 32)
"""Positions of the digits, counted from the leading delimiter."""


def hello(facts: Facts, digits: Sequence[int] = (0,) * len(DIGITS)) -> bytes:
    """A hello as on the wire, with a delimiter at either end."""
    skin = facts.skin
    assert skin.zone_capacity is not None
    report = ("moments", "cells", "barycenter").index(skin.report)
    fraction_bits = skin.barycenter_bits if facts.divided else 0
    on_change, no_diodes = skin.send == "on_change", skin.diodes == "none"
    joins = skin.connectivity + 128 * skin.closed + 64 * skin.extent + 16 * (skin.levels - 1)
    head = (skin.rows, skin.columns, joins, report, fraction_bits, on_change)
    fixed = _field(SHEET, bytes(map(int, head)) + struct.pack("<HBB", skin.zone_capacity, no_diodes, skin.guard))
    rest = _field(PITCH, struct.pack("<dd", skin.pitch_x_mm, skin.pitch_y_mm))
    if skin.radius_mm is not None:
        rest += _field(RADIUS, struct.pack("<d", skin.radius_mm))
    rest += _field(FINGERPRINT, facts.fingerprint) + _field(RATES, struct.pack("<II", skin.clock_hz, skin.baud))
    if skin.name:
        rest += _field(NAME, skin.name.encode("utf-8"))
    if facts.commands:
        rest += _field(COMMANDS, facts.commands)
    if skin.units:
        rest += _field(UNITS, _units(facts))
    if facts.place is not None:
        rest += _field(PLACE, bytes(facts.place))
    checked = _field(CHECK, struct.pack("<I", zlib.crc32(fixed + rest)))
    packet = Packet()
    packet.push(fixed + _field(STATE, bytes(128 + digit for digit in digits)) + rest + checked + bytes([KIND << 4]))
    return b"\0" + packet.wire(after=facts.closing)


def _units(facts: Facts) -> bytes:
    skin = facts.skin
    rule = converters.find(skin.converter).load_golden()
    most = max((sum(map(abs, row)) for row in skin.unit_sums), default=0) * (2**rule.bits - 1)
    sizes = (skin.units, rule.bits, len(skin.unit_sums), most.bit_length())
    return struct.pack("<BBBBHI", *sizes, *rule.spans(facts))


class State:
    """Counters in a hello, by cycle."""

    def __init__(self, facts: Facts, scanned: Sequence[Scan], heard: Reception):
        self._facts = facts
        self._scanned = scanned
        self._heard = heard

    def digit(self, place: int, cycle: int, sent: int, taken: int) -> int:
        """The digit at a place, read in ``cycle``, for a hello taken in cycle ``taken`` after ``sent`` frames."""
        if place < 7:
            return sent // 128**place % 128
        if place < 11:
            return self._epoch(taken) // 128 ** (place - 7) % 128
        if place < 14:
            return self._heard.number(cycle) // 128 ** (place - 11) % 128
        return min(7, self._stuck(cycle)) if place == 14 else 0

    def _epoch(self, taken: int) -> int:
        facts = self._facts
        late = 0 if facts.scan.waits else facts.column_shift + (facts.rows - 1) * facts.row_clocks
        return max(0, taken - 1 - late) // facts.clocks_per_us // 2**22

    def _stuck(self, cycle: int) -> int:
        index = bisect.bisect_right(self._scanned, cycle, key=lambda scan: scan.reported)
        return self._scanned[index - 1].stuck if index else 0


def _field(kind: int, value: bytes) -> bytes:
    return bytes([kind, len(value)]) + value
