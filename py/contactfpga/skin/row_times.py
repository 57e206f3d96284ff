"""Clocks of a row: how long it is driven and released, what shift registers take, and with them a scan's period."""

from __future__ import annotations

import functools
import math
from typing import TYPE_CHECKING

from contactfpga.choices import scans
from contactfpga.choices.scans import Scan
from contactfpga.skin import rates
from contactfpga.skin.widths import Widths

if TYPE_CHECKING:
    from contactfpga.skin import Skin


class RowTimes(Widths):
    """Clocks in which lines are driven and read, by a Skin's times; and those of a bit on the link."""

    skin: Skin

    def __init__(self, skin: Skin):
        super().__init__(skin.sheet)
        self.skin = skin

    @functools.cached_property
    def scan(self) -> Scan:
        return scans.find(self.skin.scan)

    @property
    def clocks_per_us(self) -> int:
        return self.skin.clock_hz // 1_000_000

    def clocks(self, us: float) -> int:
        """Clocks that last at least this many microseconds."""
        return whole(us * self.clocks_per_us)

    @property
    def settle_clocks(self) -> int:
        """How long a row is driven: as asked, until the columns of the slot before and the next row are shifted."""
        row = 2 if self.scan.waits else self.row_shift_clocks - self.release_clocks
        return max(self.clocks(self.skin.settle_us), self.column_load_clocks + self.column_shift_clocks, row)

    @property
    def first_sample_clocks(self) -> int:
        """The least value of the command "sample at": with shift registers the columns of the slot before are in by
        then."""
        return max(2, self.column_load_clocks + self.column_shift_clocks)

    @property
    def release_clocks(self) -> int:
        """How long no row is driven: as asked, until the columns are shifted, the next row is latched, or chosen and
        then shifted."""
        column = self.column_load_clocks + self.column_shift_clocks
        row = self.choice_clocks + self.row_shift_clocks if self.choice_clocks else self.row_latch_clocks
        precharge = self.precharge_clocks + 2 if self.precharge_clocks else 0  # a gap on either side
        return max(self.clocks(self.skin.release_us), column, row, precharge)

    @property
    def precharge_clocks(self) -> int:
        """How long columns are driven at least before a row is; 0: they never are."""
        return self.clocks(self.skin.precharge_us)

    @property
    def project_clocks(self) -> int:
        """How long all columns are driven and rows let go before these are sampled."""
        return self.clocks(self.skin.project_us)

    @property
    def row_clocks(self) -> int:
        return self.settle_clocks + self.release_clocks

    @property
    def shift_clocks(self) -> int:
        """A bit on a chain of shift registers; two at least, as its clock has to rise and fall."""
        return max(2, math.ceil(self.skin.clock_hz / self.skin.shift_hz))

    @property
    def row_latch_clocks(self) -> int:
        """The pulse that puts a shifted row pattern on the outputs; 0 with direct rows."""
        return self.shift_clocks if self.skin.row_drive == "74hc595" else 0

    @property
    def row_shift_clocks(self) -> int:
        """From the order to shift a row pattern until it can be driven; 0 with direct rows."""
        return (self.row_chain_lines + 1) * self.shift_clocks + 1 if self.row_latch_clocks else 0

    @property
    def column_load_clocks(self) -> int:
        """The pulse that takes all columns at once, in whose last clock they are sampled; 0 with direct columns."""
        return self.shift_clocks if self.skin.column_read == "74hc165" else 0

    @property
    def column_shift_clocks(self) -> int:
        """How much later than direct ones the columns of a sample are known; 0 with direct columns."""
        return self.column_chain_lines * self.column_load_clocks

    @property
    def row_levels(self) -> int:
        """ceil(log2 rows): how often the rows can be halved until one is left."""
        return (self.skin.rows - 1).bit_length()

    @property
    def choice_clocks(self) -> int:
        """From a strobe until the scan can drive its next rows; 0 where it knows them beforehand."""
        return self.scan.choice_clocks(self)

    @property
    def row_chain_lines(self) -> int:
        return math.ceil(self.skin.row_lines / self.skin.row_chains)

    @property
    def column_chain_lines(self) -> int:
        return math.ceil(self.skin.column_lines / self.skin.column_chains)

    @property
    def frame_clocks(self) -> int:
        """One scan period: every row once, a guard row too. Frames of an adaptive scan take fewer or more clocks."""
        return self.row_clocks * self.skin.row_lines

    @property
    def bit_clocks(self) -> int:
        return rates.bit_clocks(self.skin.clock_hz, self.skin.baud)

    @property
    def pulsed(self) -> bool:
        """Requests come as pulses: a bit is too short to be sampled."""
        return rates.pulsed(self.skin.clock_hz, self.skin.baud)


def whole(value: float) -> int:
    """The next whole number upward, not counting what a float's rounding added."""
    return math.ceil(value - 1e-9)
