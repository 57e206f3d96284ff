"""Rows and columns in the order of their soldered lines."""

from collections.abc import Sequence

from amaranth.hdl import Cat, Module, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import Out

from contactfpga.skin import Skin


def connect_lines(m: Module, skin: Skin, scan: wiring.PureInterface, lines: wiring.PureInterface) -> None:
    """Connect a scanner's pins to those at the lines."""
    for name, member in scan.signature.members.items():
        inside, outside = getattr(scan, name), getattr(lines, name)
        order = line_order(skin, name)
        if member.flow == Out:
            m.d.comb += outside.eq(on_lines(inside, order))
        else:
            m.d.comb += inside.eq(of_lines(outside, order))


def line_order(skin: Skin, name: str) -> tuple[int, ...]:
    """The line of each bit of a port with one bit per row or column; otherwise ()."""
    if name in ("rows", "rows_drive", "rows_read"):
        return skin.line_of_row
    return skin.line_of_column if name in ("columns", "columns_drive") else ()


def on_lines(word: Value, order: Sequence[int]) -> Value:
    """A word of rows or columns in line order."""
    return word if _in_order(order) else Cat(word[order.index(line)] for line in range(len(order)))


def of_lines(word: Value, order: Sequence[int]) -> Value:
    """Inverse of :func:`on_lines`."""
    return word if _in_order(order) else Cat(word[line] for line in order)


def _in_order(order: Sequence[int]) -> bool:
    return tuple(order) == tuple(range(len(order)))
