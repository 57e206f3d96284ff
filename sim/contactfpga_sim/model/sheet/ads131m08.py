"""An ADS131M08 at the board's pins, edge by edge as Texas Instruments SBAS950B has it, as it is at power-up."""

from __future__ import annotations

from collections.abc import Sequence

PERIOD, AHEAD = 2048, 4
"""Periods of its clock from one conversion to the next, and before that during which ready is high anyhow."""
WORDS, BITS = 10, 24
SETTLING = 2
"""Results after power-up from the filter that settles within one period."""


class Ads131m08:
    """All channels at once. A result is what the inputs were in the middle of what its filter averages: three periods,
    but one alone for the first two results after power-up (SBAS950B 8.3.7.1). It keeps two results that were not read.
    """

    reads: tuple[str, ...] = ("spi_clock", "spi_select_n", "spi_mosi", "spi_pace")
    gives: tuple[str, ...] = ("spi_miso", "spi_ready_n")

    def __init__(self, codes: Sequence[int]):
        self.codes = list(codes)
        """What each input would read now, from 0 on, with no voltage in the middle."""
        self._middles: list[list[int]] = []
        self._results: list[list[int]] = []
        self._ready_n, self._pace, self._clock, self._select_n = 1, 0, 0, 1
        self._periods = self._bits = 0
        self._frame = 0
        self._output = 0

    def step(self, clock: int, select_n: int, mosi: int, pace: int) -> tuple[int, ...]:
        """The levels of data and ready that it gives in this cycle."""
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
        """The oldest result, or where there is none the last one again: its status, eight channels in two's complement,
        a check that nobody looks at."""
        if self._results:
            self._last = self._results[0]
        status, check = 0x050000 | 0xFF00 * bool(self._results), 0xA5A500
        words = [status, *(code ^ 1 << BITS - 1 for code in self._last), check]
        return sum(word << BITS * (WORDS - 1 - place) for place, word in enumerate(words))

    _last: Sequence[int] = (0,) * 8
