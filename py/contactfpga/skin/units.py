"""Clocks, widths and commands of a Skin's pressure units."""

from __future__ import annotations

import dataclasses
import functools
import math
from typing import TYPE_CHECKING

from contactfpga.choices import converters
from contactfpga.choices.converters import Converter

if TYPE_CHECKING:
    from contactfpga.skin import Skin

ZERO, THRESHOLD, SUM_THRESHOLD = 3, 4, 5
"""Numbers of the commands that set a unit's zero, and the deviation from which a unit, or a sum, raises ``contact``
(docs/protocol.md).
"""

INDEX_BITS, NUMBER_BITS = 3, 18
"""Bits of the index of a unit or sum, and of the number, in such a command's value."""
MAX_SUMS, MAX_WEIGHT = 4, 127


@dataclasses.dataclass(frozen=True)
class Units:
    skin: Skin

    @functools.cached_property
    def converter(self) -> Converter:
        return converters.find(self.skin.converter)

    @property
    def level_clocks(self) -> int:
        """Clocks of each level, high or low, of the SPI clock."""
        most_hz = self.converter.most_hz(self.skin.converter_v)
        least = self.converter.least_level_ns * self.skin.clock_hz
        return max(-(-self.skin.clock_hz // (2 * most_hz)), -(-least // 1_000_000_000))

    @property
    def spacing_clocks(self) -> int:
        """Clocks from a unit's sample to that of the next unit; 0 for simultaneous samples."""
        return self.converter.spacing_levels * self.level_clocks

    @property
    def pace_level_clocks(self) -> int:
        """Clocks of each level of a converter's pacing clock; 0 without one."""
        pace, hz = self.converter.pace, self.skin.clock_hz
        return 0 if pace is None else max(-(-hz // (2 * pace.most_hz)), -(-pace.least_level_ns * hz // 1_000_000_000))

    @property
    def delay_us(self) -> int:
        """Latency of a conversion in us, rounded: from the middle of its average until it is ready."""
        pace = self.converter.pace
        return 0 if pace is None else round(pace.delay_halves * self.sweep_clocks * 500_000 / self.skin.clock_hz)

    @property
    def sweep_clocks(self) -> int:
        """Clocks from a unit's sample to its next one."""
        if (pace := self.converter.pace) is not None:
            return 2 * self.pace_level_clocks * pace.period
        return self.converter.sweep_levels * self.level_clocks * self.skin.units

    @functools.cached_property
    def sum_bits(self) -> int:
        """Bits of the largest magnitude of a weighted sum; 0 without sums."""
        full = (1 << self.converter.bits) - 1
        return max((full * sum(map(abs, row)) for row in self.skin.unit_sums), default=0).bit_length()

    @property
    def commands(self) -> tuple[int, ...]:
        if not self.skin.units:
            return ()
        return (ZERO, THRESHOLD, SUM_THRESHOLD) if self.skin.unit_sums else (ZERO, THRESHOLD)


def number_shift(bits: int) -> int:
    """Log2 of the step of a command's number, for a quantity of this many bits."""
    return max(0, bits - NUMBER_BITS)


def digits_of_reading(bits: int) -> int:
    """Seven-bit digits of a reading on the wire."""
    return math.ceil(bits / 7)
