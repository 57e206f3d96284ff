"""Converters at the board's pins, edge by edge by data sheet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from contactfpga.choices import converters
from contactfpga.errors import SkinError

if TYPE_CHECKING:
    from contactfpga.skin import Skin


class Mcp3208:
    """Microchip DS21298E, chapter 5: single-ended channels, bits on falling edges, the highest first."""

    reads: tuple[str, ...] = ("spi_clock", "spi_select_n", "spi_mosi")
    gives: tuple[str, ...] = ("spi_miso",)

    def __init__(self, codes: Sequence[int]):
        self.codes = list(codes)
        """Current reading of each input."""
        self._select_n = self._clock = self._mosi = 1
        self._rises = 0  # since the start bit, that one counted
        self._command: list[int] = []
        self._held = self._output = 0

    def step(self, clock: int, select_n: int, mosi: int) -> tuple[int, ...]:
        """Output levels in this cycle."""
        rose, fell = clock and not self._clock, self._clock and not clock
        if select_n:
            self._rises, self._command, self._output = 0, [], 0
        elif rose and (self._rises or self._mosi):
            self._rises += 1
            self._command.append(self._mosi)  # as it was before the edge
        elif fell and self._rises:
            self._fall()
        self._clock, self._select_n, self._mosi = clock, select_n, mosi
        return (self._output,)

    def _fall(self) -> None:
        if self._rises == 6:  # the fifth clock after the start bit
            single, *channel = self._command[1:5]
            assert single, "only single-ended channels are simulated"
            self._held = self.codes[channel[0] << 2 | channel[1] << 1 | channel[2]]
            self._output = 0
        elif 7 <= self._rises <= 18:
            self._output = self._held >> 18 - self._rises & 1


PERIOD, AHEAD = 2048, 4
"""Clock periods per conversion, and periods before its end in which ready is high anyhow."""
WORDS, BITS = 10, 24
SETTLING = 2
"""Results after power-up from a filter that settles within one period."""


class Ads131m08:
    """All channels at once. A result is of the middle of the filter's window: three periods, one for the first two
    results (SBAS950B 8.3.7.1). Two unread results are kept."""

    reads: tuple[str, ...] = ("spi_clock", "spi_select_n", "spi_mosi", "spi_pace")
    gives: tuple[str, ...] = ("spi_miso", "spi_ready_n")

    def __init__(self, codes: Sequence[int]):
        self.codes = list(codes)
        """Current reading of each input, from 0 on; 0 V is in the middle."""
        self._middles: list[list[int]] = []
        self._results: list[list[int]] = []
        self._ready_n, self._pace, self._clock, self._select_n = 1, 0, 0, 1
        self._periods = self._bits = 0
        self._frame = 0
        self._output = 0

    def step(self, clock: int, select_n: int, mosi: int, pace: int) -> tuple[int, ...]:
        """Levels of data and ready in this cycle."""
        if pace and not self._pace:
            self._convert()
        if select_n:
            self._bits = self._output = 0
        elif self._select_n:
            self._frame = self._next_frame()
        elif clock and not self._clock and self._bits < WORDS * BITS:
            self._output = self._frame >> WORDS * BITS - 1 - self._bits & 1
        elif self._clock and not clock:
            assert not mosi, "commands are not simulated"
            self._bits += 1
            if self._bits == WORDS * BITS:
                self._results = self._results[1:]
                self._ready_n = int(not self._results)
        self._clock, self._select_n, self._pace = clock, select_n, pace
        return self._output, self._ready_n

    def _convert(self) -> None:
        self._periods += 1
        result, into = divmod(self._periods, PERIOD)
        if into == PERIOD // 2:
            self._middles = [*self._middles[-1:], list(self.codes)]
        elif into == PERIOD - AHEAD:
            self._ready_n = 1
        elif into == 0:
            self._results = [*self._results[-1:], self._middles[-1 if result <= SETTLING else 0]]
            self._ready_n = 0

    def _next_frame(self) -> int:
        if self._results:
            self._last = self._results[0]
        status, check = 0x050000 | 0xFF00 * bool(self._results), 0xA5A500
        words = [status, *(code ^ 1 << BITS - 1 for code in self._last), check]
        return sum(word << BITS * (WORDS - 1 - place) for place, word in enumerate(words))

    _last: Sequence[int] = (0,) * 8


Model = Mcp3208 | Ads131m08
_MODELS: dict[str, type[Model]] = {"mcp3208": Mcp3208, "ads131m08": Ads131m08}


def converter_of(skin: Skin) -> Model | None:
    """The converter of a Skin; None without units."""
    if not skin.units:
        return None
    check_simulated(skin)
    chosen = converters.find(skin.converter)
    return _MODELS[chosen.name]([0] * chosen.channels)


def check_simulated(skin: Skin) -> None:
    """Raises SkinError for a converter without a simulation."""
    chosen = converters.find(skin.converter)
    if skin.units and chosen.name not in _MODELS:
        raise SkinError(f"converter is {chosen.name!r}, which is not simulated; give it a model (docs/extend.md)")
