"""Clocks, widths and fixed bytes by docs/timing.md and docs/protocol.md, in exact fractions."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
import math
from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np

from contactfpga.choices import scans

if TYPE_CHECKING:
    from contactfpga.skin import Skin


def exact(value: float) -> Fraction:
    """The Skin's decimal number, without binary rounding."""
    return Fraction(repr(value))


def upwards(value: Fraction) -> int:
    """The next integer upward, ignoring an excess of a billionth: 37/12 us is 37 clocks of 12 MHz."""
    return math.ceil(value - Fraction(1, 10**9))


def downwards(value: Fraction) -> int:
    """The next integer downward, ignoring a deficit of a billionth."""
    return math.floor(value + Fraction(1, 10**9))


def _ticks(us: Fraction) -> int:
    return upwards(us) + 1 if us else 0


class ScanTiming:
    """The part of a scan's golden rule that clocks and widths need."""

    waits: bool
    """Whether the scan waits for later stages, and the link counts time; otherwise every frame takes the same time and
    every row once."""


@dataclasses.dataclass(frozen=True)
class Facts:
    """Quantities R, C, M, E, X, Z, S, L, T, D, P and Q of the rules, and widths of fields on the wire."""

    skin: Skin
    place: tuple[int, int] | None = None
    """(number, sheets) of one of several sheets on one FPGA; None: a single sheet."""

    @property
    def closing(self) -> bytes:
        """Bytes after a packet's stuffed ones: among several sheets 2, and kind 11 with the sheet's number."""
        return b"" if self.place is None else bytes([2, 11 * 16 + self.place[0]])

    @property
    def rows(self) -> int:
        return self.skin.rows

    @property
    def columns(self) -> int:
        return self.skin.columns

    @property
    def row_lines(self) -> int:
        """Rows with the guard row."""
        return self.rows + (1 if self.skin.guard else 0)

    @property
    def column_lines(self) -> int:
        """Columns with the guard column."""
        return self.columns + (1 if self.skin.guard else 0)

    @functools.cached_property
    def mask(self) -> np.ndarray:
        """(R, C) bool: True without a readable switch."""
        mask = np.zeros((self.rows, self.columns), bool)
        for row, column in self.skin.mask:
            mask[row, column] = True
        return mask

    @functools.cached_property
    def fault_bits(self) -> int:
        """Bits of the fault word: open rows and columns, stuck columns with the guard column, joined lines; 0: none."""
        lines = [*range(self.rows), *range(self.columns), *range(self.columns + 1)] if self.skin.guard else []
        return len(lines) + int(self.skin.self_test)

    @property
    def commands(self) -> bytes:
        """Commands: 1 is the self-test, 2 the sample time, 3 to 5 are of units."""
        of_units = b"\x03\x04" + b"\x05" * bool(self.skin.unit_sums) if self.skin.units else b""
        return b"\x01" * self.skin.self_test + b"\x02" * self.samples_early + of_units

    @property
    def samples_early(self) -> bool:
        """Whether columns can be sampled before the settle time ends."""
        return self.skin.report == "cells" or self.skin.ruler > 0

    @property
    def first_sample(self) -> int:
        """Earliest clock of a row, from 1, in which columns can be sampled."""
        return max(2, self.load + self.column_shift)

    @functools.cached_property
    def clocks_per_us(self) -> int:
        return self.skin.clock_hz // 1_000_000

    @functools.cached_property
    def shift_bit(self) -> int:
        """E: clocks of a bit in the shift registers; 0 without any."""
        if self.skin.row_drive == "direct" and self.skin.column_read == "direct":
            return 0
        return max(2, -(-self.skin.clock_hz // self.skin.shift_hz))

    @functools.cached_property
    def column_shift(self) -> int:
        """X: clocks to shift in a sample of the columns."""
        if self.skin.column_read == "direct":
            return 0
        return -(-self.column_lines // self.skin.column_chains) * self.shift_bit

    @functools.cached_property
    def row_shift(self) -> int:
        """H: clocks by which a row pattern is shifted before its slot."""
        if self.skin.row_drive == "direct":
            return 0
        return 1 + -(-self.row_lines // self.skin.row_chains) * self.shift_bit + self.shift_bit

    @functools.cached_property
    def load(self) -> int:
        """Clocks of the pulse that loads the columns."""
        return 0 if self.skin.column_read == "direct" else self.shift_bit

    @functools.cached_property
    def scan(self) -> ScanTiming:
        found: ScanTiming = scans.find(self.skin.scan).load_golden()
        return found

    @functools.cached_property
    def release(self) -> int:
        asked = upwards(exact(self.skin.release_us) * self.clocks_per_us)
        latch = 0 if self.skin.row_drive == "direct" else self.shift_bit
        charged = 1 + self.precharge + 1 if self.precharge else 0
        return max(asked, self.load + self.column_shift, latch, charged)

    @functools.cached_property
    def precharge(self) -> int:
        """Least clocks of driven columns before a row."""
        return upwards(exact(self.skin.precharge_us) * self.clocks_per_us)

    @functools.cached_property
    def settle(self) -> int:
        asked = upwards(exact(self.skin.settle_us) * self.clocks_per_us)
        chosen = 2 if self.scan.waits else 0
        return max(asked, self.load + self.column_shift, self.row_shift - self.release, chosen)

    @functools.cached_property
    def row_clocks(self) -> int:
        return self.settle + self.release

    @functools.cached_property
    def first_slot(self) -> int:
        """Z: clock in which the first slot begins."""
        return 0 if self.skin.row_drive == "direct" else self.row_clocks

    @functools.cached_property
    def scan_clocks(self) -> int:
        """Clocks of a scan period: every row once, with the guard row."""
        return self.row_lines * self.row_clocks

    @functools.cached_property
    def bit_clocks(self) -> int:
        return round(Fraction(self.skin.clock_hz, self.skin.baud))

    @functools.cached_property
    def project(self) -> int:
        """Clocks for which all columns are driven before rows are sampled."""
        return upwards(exact(self.skin.project_us) * self.clocks_per_us)

    @functools.cached_property
    def column_groups(self) -> int:
        """Number of groups of 4, 8 or 16 columns in which a row is counted."""
        group = next(width for width in (4, 8, 16) if 4 * width >= self.columns)
        return -(-self.columns // group)

    @property
    def debounced(self) -> bool:
        return self.skin.debounce != "none"

    @functools.cached_property
    def press_scans(self) -> int:
        return upwards(self._scans(exact(self.skin.debounce_press_us)))

    @functools.cached_property
    def release_scans(self) -> int:
        return upwards(self._scans(exact(self.skin.debounce_release_us)))

    @functools.cached_property
    def keep_alive_scans(self) -> int:
        """Scans after which an unchanged frame is sent."""
        return downwards(self._scans(exact(self.skin.keep_alive_ms) * 1000))

    @property
    def rests(self) -> bool:
        """Whether a second delimiter follows a packet if nothing waits: of a single sheet whose frames may be more than
        a millisecond apart."""
        on_change = self.skin.send == "on_change"
        ms = exact(self.skin.keep_alive_ms) if on_change else Fraction(self.scan_clocks, 1000 * self.clocks_per_us)
        return self.place is None and ms > 1

    @property
    def keep_alive_periods(self) -> int:
        """Keep-alive time in periods of 1024 us, for a scan that waits."""
        periods = exact(self.skin.keep_alive_ms) * 1000 / 1024
        return downwards(periods) - 1 - math.ceil(2 * self.scan_clocks / Fraction(1024 * self.clocks_per_us))

    @functools.cached_property
    def press_ticks(self) -> int:
        """Press time in steps of the us clock, for a scan that waits."""
        return _ticks(exact(self.skin.debounce_press_us))

    @functools.cached_property
    def release_ticks(self) -> int:
        return _ticks(exact(self.skin.debounce_release_us))

    @functools.cached_property
    def hello_scans(self) -> int:
        """Scans after which a hello is due."""
        return max(1, math.floor(self._scans(Fraction(500_000))))

    def _scans(self, microseconds: Fraction) -> Fraction:
        return microseconds * self.clocks_per_us / self.scan_clocks

    @property
    def zones(self) -> bool:
        """Whether a frame has zone records, not bitmap rows."""
        return self.skin.report in ("moments", "barycenter")

    @property
    def divided(self) -> bool:
        """Whether zone records hold barycenters."""
        return self.skin.report == "barycenter"

    @property
    def capacity(self) -> int:
        """Items per frame."""
        if not self.zones:
            return self.rows
        assert self.skin.zone_capacity is not None
        return self.skin.zone_capacity

    @functools.cached_property
    def area_bits(self) -> int:
        return bits(self.rows * self.columns)

    @functools.cached_property
    def sum_x_bits(self) -> int:
        return bits(self.rows * sum(range(self.columns)))

    @functools.cached_property
    def sum_y_bits(self) -> int:
        return bits(self.columns * sum(range(self.rows)))

    @functools.cached_property
    def zones_bits(self) -> int:
        return bits(self._most_zones)

    @functools.cached_property
    def barycenter_bits(self) -> tuple[int, int, int]:
        """Bits of area, x and y in barycenter records. The largest area, R C, may wrap to 0."""
        steps = 2**self.skin.barycenter_bits
        return bits(self.rows * self.columns - 1), bits((self.columns - 1) * steps), bits((self.rows - 1) * steps)

    @functools.cached_property
    def extent_bits(self) -> tuple[int, ...]:
        """Bits of smallest and largest column, smallest and largest row, in records that have them."""
        column, row = bits(self.columns - 1), bits(self.rows - 1)
        return (column, column, row, row) if self.skin.extent else ()

    @functools.cached_property
    def division(self) -> int:
        """Q: clocks of a division: one per bit of a row or column number, one per fraction bit, and rounding."""
        return math.ceil(math.log2(max(self.rows, self.columns))) + self.skin.barycenter_bits + 1

    @functools.cached_property
    def item_bytes(self) -> int:
        """Bytes per zone record or bitmap row."""
        if self.divided:
            width = sum(self.barycenter_bits) + sum(self.extent_bits)
        else:
            sums = self.area_bits + self.sum_x_bits + self.sum_y_bits
            record = sums + (self.area_bits if self.skin.closed else 0) + sum(self.extent_bits)
            width = record if self.zones else self.columns * self.level_bits
        return -(-width // 8)

    @property
    def level_bits(self) -> int:
        """Bits of a cell on the wire, 2 with levels."""
        return 1 if self.skin.levels == 1 else 2

    @functools.cached_property
    def fingerprint(self) -> bytes:
        fields = {}
        for field in dataclasses.fields(self.skin):
            value = getattr(self.skin, field.name)
            chosen = self._capacity_by_default if field.name == "zone_capacity" else field.default
            if field.name != "name" and value != chosen:
                fields[field.name] = value
        return hashlib.sha256(json.dumps(fields, sort_keys=True).encode()).digest()[:8]

    @property
    def _most_zones(self) -> int:
        """The most zones: one per 2x2 block with 8-connectivity, a checkerboard with 4, half the columns around a
        cylinder."""
        if self.skin.closed:
            return self.columns // 2 * (self.rows if self.skin.connectivity == 4 else math.ceil(self.rows / 2))
        if self.skin.connectivity == 4:
            return math.ceil(self.rows * self.columns / 2)
        return math.ceil(self.rows / 2) * math.ceil(self.columns / 2)

    @property
    def _capacity_by_default(self) -> int:
        most = self._most_zones
        if max(self.rows, self.columns) > 32:
            most = min(most, 256)
        return min(most, 64) if self.divided else most


def bits(largest: int) -> int:
    """Least width, at least one bit, for 0 to ``largest``."""
    width = 1
    while 2**width <= largest:
        width += 1
    return width


@functools.lru_cache(maxsize=64)
def facts(skin: Skin) -> Facts:
    return Facts(skin)
