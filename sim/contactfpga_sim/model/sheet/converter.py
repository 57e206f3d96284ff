"""A converter at the board's pins, edge by edge as its data sheet has it, with what its inputs are set to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from contactfpga.choices import converters
from contactfpga.errors import SkinError
from contactfpga_sim.model.sheet.ads131m08 import Ads131m08

if TYPE_CHECKING:
    from contactfpga.skin import Skin


class Mcp3208:
    """Microchip DS21298E, chapter 5: single-ended channels, bits on falling edges, the highest first."""

    reads: tuple[str, ...] = ("spi_clock", "spi_select_n", "spi_mosi")
    gives: tuple[str, ...] = ("spi_miso",)

    def __init__(self, codes: Sequence[int]):
        self.codes = list(codes)
        """What each input would read now."""
        self._select_n = self._clock = self._mosi = 1
        self._rises = 0  # since the start bit, that one counted
        self._command: list[int] = []
        self._held = self._output = 0

    def step(self, clock: int, select_n: int, mosi: int) -> tuple[int, ...]:
        """The levels that it gives in this cycle."""
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


Model = Mcp3208 | Ads131m08
_MODELS: dict[str, type[Model]] = {"mcp3208": Mcp3208, "ads131m08": Ads131m08}


def converter_of(skin: Skin) -> Model | None:
    """The one of a Skin, or None without units."""
    if not skin.units:
        return None
    check_simulated(skin)
    chosen = converters.find(skin.converter)
    return _MODELS[chosen.name]([0] * chosen.channels)


def check_simulated(skin: Skin) -> None:
    """Raises SkinError for units on a converter that no simulation knows."""
    chosen = converters.find(skin.converter)
    if skin.units and chosen.name not in _MODELS:
        raise SkinError(f"converter is {chosen.name!r}, which is not simulated; give it a model (docs/extend.md)")
