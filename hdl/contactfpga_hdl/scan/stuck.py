"""Columns that read pressed while no row is driven."""

from amaranth.hdl import Module, Mux, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import STUCK_BITS, STUCK_MAX
from contactfpga_hdl.util.bits import popcount


def present(skin: Skin, row: int, bits: int = 1) -> int:
    """A word with ``bits`` bits for each column: ones where the row has a switch that is not masked."""
    return sum((1 << bits) - 1 << bits * column for column in range(skin.columns) if (row, column) not in skin.mask)


def anywhere(skin: Skin) -> int:
    """Columns, as bits, in which any row has an unmasked switch."""
    word = 0
    for row in range(skin.rows):
        word |= present(skin, row)
    return word


def watched(skin: Skin) -> int:
    """Columns, as bits, that are not masked in every row, and the guard column."""
    return anywhere(skin) | (1 << skin.columns if skin.guard else 0)


class Stuck(wiring.Component):
    """Counts columns that read pressed in any ``released`` clock up to ``take``, except fully masked ones and a guard
    column; ``count`` is valid two clocks later, ``seen`` accumulates the lines."""

    def __init__(self, skin: Skin):
        self.skin = skin
        super().__init__(
            {
                "columns": In(skin.column_lines),
                "released": In(1),
                "take": In(1),
                "seen": Out(skin.column_lines),
                "count": Out(STUCK_BITS),
            },
        )

    def elaborate(self, platform):
        m = Module()
        with m.If(self.released):
            m.d.sync += self.seen.eq(self.seen | self.columns & watched(self.skin))
        with m.If(self.take):
            m.d.sync += self.seen.eq(0)
        count_columns(m, self.seen[: self.skin.columns], self.take, self.count)
        return m


def count_columns(m: Module, columns: Value, take: Value, count: Signal) -> None:
    """Set ``count`` to the number of columns two clocks after ``take``; 64 are too many for one clock."""
    groups = [columns[first : first + 8] for first in range(0, len(columns), 8)]
    counts = [Signal(range(len(group) + 1), name=f"stuck_{index}") for index, group in enumerate(groups)]
    with m.If(take):
        m.d.sync += [one.eq(popcount(group)) for one, group in zip(counts, groups)]
    total = popcount(counts)
    m.d.sync += count.eq(Mux(total > STUCK_MAX, STUCK_MAX, total))
