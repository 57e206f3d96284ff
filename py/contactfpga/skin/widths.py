"""Widths in bits and sizes in bytes of what a board sends, from its :class:`~contactfpga.skin.sheet.Sheet`."""

from __future__ import annotations

import functools
import math

from contactfpga.choices.reports import REPORTS, Report
from contactfpga.skin.limits import MAX_LINES
from contactfpga.skin.sheet import Sheet

CHECK_BYTES = 3
TIME_BITS = 24
SEQUENCE_BITS = 8
HEARD_BITS = 3
"""Of a request's number, in each frame."""

MIN_OVERWRITTEN_BITS = 4


class Widths:
    """Widths and sizes of a sheet's frames (docs/protocol.md)."""

    def __init__(self, sheet: Sheet):
        self.sheet = sheet

    @property
    def report(self) -> Report:
        return REPORTS[self.sheet.report]

    @functools.cached_property
    def cells(self) -> int:
        return self.sheet.rows * self.sheet.columns

    @property
    def zone_capacity(self) -> int:
        return self.sheet.zone_capacity

    @functools.cached_property
    def area_bits(self) -> int:
        return self.cells.bit_length()

    @functools.cached_property
    def sum_x_bits(self) -> int:
        return max(1, (self.sheet.rows * math.comb(self.sheet.columns, 2)).bit_length())

    @functools.cached_property
    def sum_y_bits(self) -> int:
        return max(1, (self.sheet.columns * math.comb(self.sheet.rows, 2)).bit_length())

    @functools.cached_property
    def zones_bits(self) -> int:
        return self.sheet.max_zones().bit_length()

    @functools.cached_property
    def record_bits(self) -> tuple[int, ...]:
        """Of a zone on the wire: area, and sum x and sum y, or x and y of the barycenter; on a sheet whose ends meet
        after them the cells past the seam.

        An area that a barycenter goes with is never 0. So where the sheet's cells are a power of two all of them are
        sent as 0, which saves a bit, and with 4 fraction bits and 16x16 or 64x64 cells a byte.
        """
        if not self.report.divided:
            turned = (self.area_bits,) if self.sheet.closed else ()
            return self.area_bits, self.sum_x_bits, self.sum_y_bits, *turned
        x_bits, y_bits = (
            max(1, (lines - 1 << self.sheet.barycenter_bits).bit_length())
            for lines in (self.sheet.columns, self.sheet.rows)
        )
        return max(1, (self.cells - 1).bit_length()), x_bits, y_bits

    @functools.cached_property
    def record_bytes(self) -> int:
        """Bytes of one zone on the wire."""
        return math.ceil(sum(self.record_bits) / 8)

    @functools.cached_property
    def bitmap_row_bytes(self) -> int:
        """Bytes of one row on the wire with ``report = "cells"``."""
        return math.ceil(self.sheet.columns / 8)

    @functools.cached_property
    def trailer_bytes(self) -> int:
        """Bytes that close a frame, its kind byte among them."""
        return math.ceil((self._counted_bits + MIN_OVERWRITTEN_BITS) / 8) + 1

    @functools.cached_property
    def overwritten_bits(self) -> int:
        """What the other fields leave of the trailer: four bits or more."""
        return 8 * (self.trailer_bytes - 1) - self._counted_bits

    @property
    def _counted_bits(self) -> int:
        return TIME_BITS + SEQUENCE_BITS + HEARD_BITS + self.area_bits + self.zones_bits

    @functools.cached_property
    def item_bytes(self) -> int:
        """Bytes of one item of a frame: a zone or a bitmap row."""
        return self.record_bytes if self.report.zones else self.bitmap_row_bytes

    @functools.cached_property
    def max_items(self) -> int:
        return self.zone_capacity if self.report.zones else self.sheet.rows

    @functools.cached_property
    def max_stored_bytes(self) -> int:
        """The longest frame as the board keeps it: items and trailer, stuffed."""
        plain = self.max_items * self.item_bytes + self.trailer_bytes
        return plain + math.ceil(plain / 254)

    @functools.cached_property
    def max_frame_bytes(self) -> int:
        """The longest frame on the wire: with its check bytes and its delimiter."""
        return self.max_stored_bytes + CHECK_BYTES + 1


LONGEST_PACKET = Widths(
    Sheet(
        rows=MAX_LINES,
        columns=MAX_LINES,
        connectivity=4,
        report="moments",
        barycenter_bits=0,
        zone_capacity=MAX_LINES * MAX_LINES // 2,
        pitch_x_mm=1.0,
        pitch_y_mm=1.0,
        radius_mm=1.0,
        closed=True,
        ghosts=False,
    )
).max_frame_bytes
"""No frame of any Skin takes more bytes on the wire."""
