"""Quantities derived from a Skin or its sheet."""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING

from contactfpga.choices import debounces, labellers, scans
from contactfpga.choices.labellers import Labeller
from contactfpga.choices.reports import REPORTS, Report
from contactfpga.choices.scans import Scan
from contactfpga.skin.sheet import MAX_LINES, Sheet
from contactfpga.skin.units import Units

if TYPE_CHECKING:
    from contactfpga.skin import Skin


CHECK_BYTES = 3
TIME_BITS = 24
SEQUENCE_BITS = 8
HEARD_BITS = 3
"""Bits of a request's number that each frame repeats."""

MIN_OVERWRITTEN_BITS = 4

HELLO_PERIOD_US = 500_000
"""Interval of hellos; one still comes every second if each waits for a frame."""

HELLO_BIT = 19
"""Bit of the us clock whose toggles, every 0.52 s, make a hello of a waiting scan due."""
KEEP_ALIVE_BIT = 10
"""Bit of the us clock whose toggles, every 1.024 ms, count a keep-alive."""

EPOCH_BITS = 22
"""Log2 of an epoch in us, below half of a frame time's range."""
LATENCY_US = 1000
"""Shortest latency timer of an FTDI bridge, after which it sends what it holds."""
STUCK_BITS = 3
STUCK_MAX = (1 << STUCK_BITS) - 1

SELF_TEST = 1
"""Number of the command that tests all lines (docs/protocol.md)."""
SAMPLE_AT = 2
"""Number of the command that sets the clock of a row at which the columns are sampled, or with a ruler the sixteenths
of its time, plus ``LEVEL_STEP`` times the level, counted from 0, that is meant."""
MAX_RULER = 255
"""Latest sample in sixteenths of the ruler's time."""
LEVEL_STEP = MAX_RULER + 1


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
    def extent_bits(self) -> tuple[int, ...]:
        """Bits of a zone's smallest and largest column, then row; () without ``extent``."""
        lines = (self.sheet.columns, self.sheet.columns, self.sheet.rows, self.sheet.rows) if self.sheet.extent else ()
        return tuple(max(1, (count - 1).bit_length()) for count in lines)

    @functools.cached_property
    def record_bits(self) -> tuple[int, ...]:
        """Bits of a zone's fields on the wire: area, and sums or barycenter; on a sheet whose ends meet, also cells
        past the seam; :attr:`extent_bits`.

        Divided areas are never 0, so an area of all cells is sent as 0; if the cells are a power of two, this saves a
        bit.
        """
        if not self.report.divided:
            past = (self.area_bits,) if self.sheet.closed else ()
            return self.area_bits, self.sum_x_bits, self.sum_y_bits, *past, *self.extent_bits
        x_bits, y_bits = (
            max(1, (lines - 1 << self.sheet.barycenter_bits).bit_length())
            for lines in (self.sheet.columns, self.sheet.rows)
        )
        return max(1, (self.cells - 1).bit_length()), x_bits, y_bits, *self.extent_bits

    @functools.cached_property
    def record_bytes(self) -> int:
        return math.ceil(sum(self.record_bits) / 8)

    @functools.cached_property
    def bitmap_row_bytes(self) -> int:
        """Bytes of one row on the wire with ``report = "cells"``."""
        return math.ceil(self.sheet.columns * self.level_bits / 8)

    @property
    def level_bits(self) -> int:
        """Bits of a cell on the wire with ``report = "cells"``."""
        return self.sheet.levels.bit_length()

    @functools.cached_property
    def trailer_bytes(self) -> int:
        """Bytes of a frame's trailer, including its kind byte."""
        return math.ceil((self._counted_bits + MIN_OVERWRITTEN_BITS) / 8) + 1

    @functools.cached_property
    def overwritten_bits(self) -> int:
        """Bits of the trailer's count of overwritten frames, at least four."""
        return 8 * (self.trailer_bytes - 1) - self._counted_bits

    @property
    def _counted_bits(self) -> int:
        return TIME_BITS + SEQUENCE_BITS + HEARD_BITS + self.area_bits + self.zones_bits

    @functools.cached_property
    def item_bytes(self) -> int:
        """Bytes of one zone, or of one bitmap row."""
        return self.record_bytes if self.report.zones else self.bitmap_row_bytes

    @functools.cached_property
    def max_items(self) -> int:
        return self.zone_capacity if self.report.zones else self.sheet.rows

    @functools.cached_property
    def max_stored_bytes(self) -> int:
        """Bytes of the longest stuffed frame without check bytes."""
        plain = self.max_items * self.item_bytes + self.trailer_bytes
        return plain + math.ceil(plain / 254)

    @functools.cached_property
    def max_frame_bytes(self) -> int:
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
        extent=True,
    )
).max_frame_bytes
"""Upper bound on the wire bytes of a frame of any Skin."""


SAMPLED_BIT_CLOCKS = 4
"""Least clocks per bit with which a receiver can sample near the middle of each bit."""


def bit_clocks(clock_hz: int, baud: int) -> int:
    return round(clock_hz / baud)


def pulsed(clock_hz: int, baud: int) -> bool:
    """Whether the board has too few clocks per bit to sample, and needs requests as pulses (docs/protocol.md)."""
    return bit_clocks(clock_hz, baud) < SAMPLED_BIT_CLOCKS


class Derived(Widths):
    """Clocks, widths and depths of a :class:`~contactfpga.Skin`."""

    def __init__(self, skin: Skin):
        super().__init__(skin.sheet)
        self.skin = skin

    @functools.cached_property
    def scan(self) -> Scan:
        return scans.find(self.skin.scan)

    @functools.cached_property
    def labeller(self) -> Labeller:
        return labellers.find(self.skin.labeller)

    @functools.cached_property
    def debounced(self) -> bool:
        return bool(debounces.find(self.skin.debounce).gateware)

    @property
    def commands(self) -> tuple[int, ...]:
        self_test = (SELF_TEST,) if self.skin.self_test else ()
        moves = not self.report.zones or self.skin.ruler
        return self_test + ((SAMPLE_AT,) if moves else ()) + self.units.commands

    @functools.cached_property
    def units(self) -> Units:
        return Units(self.skin)

    # ---- clocks in which lines are driven and read, and those of a bit on the link

    @property
    def clocks_per_us(self) -> int:
        return self.skin.clock_hz // 1_000_000

    def clocks(self, us: float) -> int:
        """The least clocks that last this many microseconds."""
        return whole(us * self.clocks_per_us)

    @property
    def settle_clocks(self) -> int:
        """Clocks for which a row is driven: at least until the previous slot's columns and the next row are shifted."""
        row = 2 if self.scan.waits else self.row_shift_clocks - self.release_clocks
        return max(self.clocks(self.skin.settle_us), self.column_load_clocks + self.column_shift_clocks, row)

    @property
    def first_sample_clocks(self) -> int:
        """Least value of the command "sample at": shift registers are read by then."""
        return max(2, self.column_load_clocks + self.column_shift_clocks)

    @property
    def rulers(self) -> tuple[int, ...]:
        """Instants of a row's samples in sixteenths of the ruler's time, the lightest level's first."""
        return self.skin.ruler, *self.skin.harder

    @property
    def release_clocks(self) -> int:
        """Clocks without a driven row: at least until the columns are shifted and the next row is latched."""
        column = self.column_load_clocks + self.column_shift_clocks
        precharge = self.precharge_clocks + 2 if self.precharge_clocks else 0  # a gap on either side
        return max(self.clocks(self.skin.release_us), column, self.row_latch_clocks, precharge)

    @property
    def precharge_clocks(self) -> int:
        """Least clocks for which columns are driven before a row; 0: never."""
        return self.clocks(self.skin.precharge_us)

    @property
    def project_clocks(self) -> int:
        """Clocks for which all columns are driven, and rows released, before the rows are sampled."""
        return self.clocks(self.skin.project_us)

    @property
    def row_clocks(self) -> int:
        return self.settle_clocks + self.release_clocks

    @property
    def shift_clocks(self) -> int:
        """Clocks per bit of a shift-register chain; at least two, for both levels of the shift clock."""
        return max(2, math.ceil(self.skin.clock_hz / self.skin.shift_hz))

    @property
    def row_latch_clocks(self) -> int:
        """Clocks of the pulse that latches a row pattern; 0 with direct rows."""
        return self.shift_clocks if self.skin.row_drive == "74hc595" else 0

    @property
    def row_shift_clocks(self) -> int:
        """Clocks from the order to shift a row pattern until its drive; 0 with direct rows."""
        return (self.row_chain_lines + 1) * self.shift_clocks + 1 if self.row_latch_clocks else 0

    @property
    def start_clocks(self) -> int:
        """Clocks from a restart to a raster scan's first slot: those of a slot if rows are shifted, otherwise 0."""
        return self.row_clocks if self.row_shift_clocks else 0

    @property
    def column_load_clocks(self) -> int:
        """Clocks of the pulse that loads all columns in its last clock; 0 with direct columns."""
        return self.shift_clocks if self.skin.column_read == "74hc165" else 0

    @property
    def column_shift_clocks(self) -> int:
        """Latency of a sample's columns against direct ones in clocks."""
        return self.column_chain_lines * self.column_load_clocks

    @property
    def row_chain_lines(self) -> int:
        return math.ceil(self.skin.row_lines / self.skin.row_chains)

    @property
    def column_chain_lines(self) -> int:
        return math.ceil(self.skin.column_lines / self.skin.column_chains)

    @property
    def frame_clocks(self) -> int:
        """Clocks in which every row, and a guard row, is driven once."""
        return self.row_clocks * self.skin.row_lines

    @property
    def bit_clocks(self) -> int:
        return bit_clocks(self.skin.clock_hz, self.skin.baud)

    @property
    def pulsed(self) -> bool:
        return pulsed(self.skin.clock_hz, self.skin.baud)

    # ---- times, in clocks unless named otherwise

    @property
    def max_frame_clocks(self) -> int:
        """The most clocks of a frame, from its first sample to its last."""
        return self.scan.max_frame_clocks(self)

    @property
    def skips(self) -> bool:
        """Whether undriven rows are not passed on, except an empty row where zones must end."""
        return self.scan.waits and self.report.zones

    @property
    def min_row_clocks(self) -> int:
        """Least clocks of a row: debounce and labeller finish the row before, and a frame outlasts the packing of the
        frame before."""
        return self.scan.min_row_clocks(self)

    @property
    def debounce_clocks(self) -> int:
        return self.skin.columns + 3 if self.debounced else 0

    @property
    def packed_clocks(self) -> int:
        """Clocks from the offer of a frame's last row to the end of its packing, besides bytes packed meanwhile."""
        return 1 + self.debounce_clocks + self.label_clocks + 2 + 4

    def items_clocks(self, items: int) -> int:
        """Clocks to pack items and trailer: one per byte, or the longer division of items."""
        plain = items * self.item_bytes + self.trailer_bytes
        stuffing = math.ceil(plain / 254)
        if not self.report.divided:
            return plain + stuffing
        return items * self.item_clocks + self.item_bytes + self.trailer_bytes + stuffing

    @property
    def keep_alive_frames(self) -> int:
        """Scans within which a frame is sent, unless the scan waits."""
        return math.floor(self.skin.keep_alive_ms * 1000 * self.clocks_per_us / self.frame_clocks + 1e-9)

    @property
    def keep_alive_toggles(self) -> int:
        """Toggles of ``KEEP_ALIVE_BIT`` after which a waiting scan sends a frame."""
        return math.floor(self.skin.keep_alive_ms * 1000 / (1 << KEEP_ALIVE_BIT) + 1e-9) - self._spare_toggles

    @property
    def rests(self) -> bool:
        """Whether the pause between frames may outlast a bridge's latency timer, so that a packet may meet a bridge
        that empties itself in the middle of it; a second delimiter then closes what is left."""
        on_change = self.skin.send == "on_change"
        pause_us = 1000 * self.skin.keep_alive_ms if on_change else self.frame_clocks / self.clocks_per_us
        return pause_us > LATENCY_US

    @property
    def min_keep_alive_ms(self) -> float:
        return (self._spare_toggles + 1) * (1 << KEEP_ALIVE_BIT) / 1000

    @property
    def _spare_toggles(self) -> int:
        return 1 + math.ceil(2 * self.frame_clocks / ((1 << KEEP_ALIVE_BIT) * self.clocks_per_us))

    @property
    def hello_frames(self) -> int:
        """Scans after which a hello is due, unless the scan waits."""
        return max(1, math.floor(HELLO_PERIOD_US * self.clocks_per_us / self.frame_clocks + 1e-9))

    @property
    def press_scans(self) -> int:
        return whole(self.skin.debounce_press_us * self.clocks_per_us / self.frame_clocks)

    @property
    def release_scans(self) -> int:
        return whole(self.skin.debounce_release_us * self.clocks_per_us / self.frame_clocks)

    @property
    def press_ticks(self) -> int:
        """Steps of the us clock that ``debounce_press_us`` lasts with a waiting scan (docs/timing.md)."""
        return _ticks(self.skin.debounce_press_us)

    @property
    def release_ticks(self) -> int:
        return _ticks(self.skin.debounce_release_us)

    # ---- widths in bits and sizes in bytes

    @functools.cached_property
    def tick_bits(self) -> int:
        """Bits of the us clock, with a waiting scan, for a debounce time and two frames."""
        longest = max(self.press_ticks, self.release_ticks)
        frame = self.max_frame_clocks + self.packed_clocks + self.items_clocks(self.max_items)
        return (longest + 2 * math.ceil(frame / self.clocks_per_us)).bit_length()

    @property
    def cell_bits(self) -> int:
        """Integer bits of a barycenter, along the longer side."""
        return (max(self.skin.rows, self.skin.columns) - 1).bit_length()

    @property
    def quotient_bits(self) -> int:
        """Bits of a barycenter before rounding, with one more fraction bit; one is computed per clock."""
        return self.cell_bits + self.skin.barycenter_bits + 1

    @property
    def item_clocks(self) -> int:
        """The most clocks from an item to the next while many wait."""
        divided = self.quotient_bits + 1 if self.report.divided else 0
        return max(self.item_bytes, divided)

    # ---- sizes of tables

    @functools.cached_property
    def open_zones(self) -> int:
        """The most zones in two adjacent rows: C/2 with 8-connectivity, C with 4."""
        return math.ceil(self.skin.columns / 2) if self.skin.connectivity == 8 else self.skin.columns

    @property
    def label_clocks(self) -> int:
        """The most clocks from a frame's last row to its end mark."""
        return self.labeller.end_clocks(self) if self.report.zones else 3

    @property
    def label_row_clocks(self) -> int:
        """The most clocks that the labeller, or its replacement, needs from a row to the next."""
        return self.labeller.row_clocks(self) if self.report.zones else 1

    @property
    def label_empty_row_clocks(self) -> int:
        """The most clocks that the labeller needs from an empty row below an empty row to the next."""
        return self.labeller.empty_row_clocks(self) if self.report.zones else 1

    @functools.cached_property
    def backlog(self) -> int:
        """Items that the queue before the packer holds.

        Two rows close at most ``open_zones`` zones, in one burst; if packing takes longer than two rows, the rest
        accumulates over at most two frames. A waiting scan has one frame under way; its depth is a power of two, which
        needs less logic.
        """
        if self.scan.waits:
            return max(8, 1 << (self.max_items - 1).bit_length())
        if not self.report.zones:
            return 4
        busy = self.open_zones * self.item_clocks
        late = max(0.0, 1 - 2 * self.row_clocks / busy)
        return 2 * self.open_zones + math.ceil(2 * self.zone_capacity * late) + 2


def _ticks(us: float) -> int:
    return whole(us) + 1 if us else 0


def whole(value: float) -> int:
    """The next integer upward; ignores float rounding below 1e-9."""
    return math.ceil(value - 1e-9)
