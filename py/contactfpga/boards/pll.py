"""PLL dividers from a board's crystal to a clock; without Amaranth.

iCE40 (SB_PLL40_PAD, SB_PLL40_CORE): the oscillator runs at ``crystal / (DIVR + 1) * (DIVF + 1)`` and is divided by
``2**DIVQ``. ECP5 (EHXPLLL): the output is fed back, so it is ``crystal / CLKI_DIV * CLKFB_DIV`` and the oscillator
``CLKOP_DIV`` times that.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Mapping
from fractions import Fraction

from contactfpga.skin import SkinError

Dividers = Mapping[str, int]

MHZ = 1_000_000

ICE40_COMPARED = 10 * MHZ, 133 * MHZ
ICE40_OSCILLATOR = 533 * MHZ, 1066 * MHZ
ICE40_OUTPUT = 16 * MHZ, 275 * MHZ
ICE40_FILTERS = ((17, 1), (26, 2), (44, 3), (66, 4), (101, 5), (134, 6))
"""FILTER_RANGE by the upper limit in MHz of the phase comparator's frequency."""

ECP5_COMPARED = 3_125_000, 400 * MHZ
ECP5_OSCILLATOR = 400 * MHZ, 800 * MHZ
ECP5_OUTPUT = 10 * MHZ, 400 * MHZ


def dividers(cell: str, crystal_hz: int, clock_hz: int) -> Dividers:
    """The dividers for exactly this clock: those of the highest comparison frequency, then of the oscillator nearest to
    the middle of its range. Raises SkinError with the nearest whole MHz if no dividers give the clock."""
    clocks = _clocks(cell, crystal_hz)
    if clock_hz in clocks:
        return clocks[clock_hz]
    below = max((made for made in clocks if made < clock_hz), default=None)
    above = min((made for made in clocks if made > clock_hz), default=None)
    nearest = " and ".join(str(made) for made in (below, above) if made is not None)
    raise SkinError(
        f"clock_hz is {clock_hz}: the PLL ({cell}) makes no such clock from a crystal of {crystal_hz} Hz; "
        f"nearest are {nearest}; or the crystal's own {crystal_hz}"
    )


@functools.cache
def _clocks(cell: str, crystal_hz: int) -> dict[int, Dividers]:
    clocks: dict[int, Dividers] = {}
    for made, found in _SETTINGS[cell](crystal_hz):
        if made % MHZ == 0:
            clocks.setdefault(int(made), found)
    return clocks


def ice40(crystal_hz: int) -> Iterator[tuple[Fraction, Dividers]]:
    """(Hz, dividers) of every setting of an iCE40's PLL."""
    for divr in range(16):
        compared = Fraction(crystal_hz, divr + 1)
        if not _within(compared, ICE40_COMPARED):
            continue
        band = next(number for limit, number in ICE40_FILTERS if compared < limit * MHZ)
        for divf in range(128):
            if not _within(compared * (divf + 1), ICE40_OSCILLATOR):
                continue
            for divq in range(1, 7):
                made = compared * (divf + 1) / 2**divq
                if _within(made, ICE40_OUTPUT):
                    yield made, {"DIVR": divr, "DIVF": divf, "DIVQ": divq, "FILTER_RANGE": band}


def ecp5(crystal_hz: int) -> Iterator[tuple[Fraction, Dividers]]:
    """(Hz, dividers) of every output of an ECP5's PLL, with the most suitable CLKOP_DIV."""
    middle = sum(ECP5_OSCILLATOR) // 2
    for clki in range(1, 129):
        compared = Fraction(crystal_hz, clki)
        if not _within(compared, ECP5_COMPARED):
            continue
        for clkfb in range(1, 81):
            made = compared * clkfb
            low, high = math.ceil(ECP5_OSCILLATOR[0] / made), math.floor(ECP5_OSCILLATOR[1] / made)
            if _within(made, ECP5_OUTPUT) and low <= high:
                # Any of them makes the same clock.
                clkop = min(range(low, min(high, 128) + 1), key=lambda divider: abs(made * divider - middle))
                yield made, {"CLKI_DIV": clki, "CLKFB_DIV": clkfb, "CLKOP_DIV": clkop}


def _within(value: Fraction, limits: tuple[int, int]) -> bool:
    return limits[0] <= value <= limits[1]


_SETTINGS = {"SB_PLL40_PAD": ice40, "SB_PLL40_CORE": ice40, "EHXPLLL": ecp5}
