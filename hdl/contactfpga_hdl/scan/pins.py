"""Between scanner and sheet: which pins there are, and the drivers for a pin a row and a pin a column."""

from amaranth.hdl import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin


def row_pins(skin: Skin) -> dict[str, wiring.Member]:
    """The pins that drive the rows: one a row, or those of the shift registers with one ``row_data`` a chain."""
    if skin.row_drive == "direct":
        return {"rows": Out(skin.rows)}
    return {"row_data": Out(skin.row_chains), "row_clock": Out(1), "row_latch": Out(1), "row_enable_n": Out(1, init=1)}


def column_pins(skin: Skin) -> dict[str, wiring.Member]:
    """The pins that read the columns: one a column, or those of the shift registers, one ``column_data`` a chain."""
    if skin.column_read == "direct":
        return {"columns": In(skin.columns)}
    return {"column_load_n": Out(1, init=1), "column_clock": Out(1), "column_data": In(skin.column_chains)}


def connect_pins(m: Module, inner: wiring.PureInterface, outer) -> None:
    """Connect the pins of ``inner`` to the ones of the same names further out."""
    for name, member in inner.signature.members.items():
        inside, outside = getattr(inner, name), getattr(outer, name)
        m.d.comb += outside.eq(inside) if member.flow == Out else inside.eq(outside)


def row_driver(skin: Skin) -> wiring.Signature:
    """What drives the rows, as the scanner sees it.

    ``pattern`` holds the rows of the next slot as ones. It must be stable from ``shift``, given
    ``Derived.row_shift_clocks`` before the slot, until ``drive`` in the last clock before it. They are driven from the
    clock after ``drive`` to that of ``release``; a pattern that is driven already may be shifted anew. Direct rows need
    no ``shift``, and after power-up drive row 0 at once, in an adaptive scan all rows.
    """
    return wiring.Signature(
        {
            "pins": Out(wiring.Signature(row_pins(skin))),
            "pattern": In(skin.rows),
            "shift": In(1),
            "drive": In(1),
            "release": In(1),
        }
    )


def column_reader(skin: Skin) -> wiring.Signature:
    """What reads the columns, as the scanner sees it.

    The columns are sampled ``Derived.column_load_clocks`` after ``begin``. Their ``levels`` are there while ``done``,
    ``2 + Derived.column_shift_clocks`` after they were sampled.
    """
    return wiring.Signature(
        {
            "pins": Out(wiring.Signature(column_pins(skin))),
            "begin": In(1),
            "levels": Out(skin.columns),
            "done": Out(1),
        }
    )


def released_levels(skin: Skin, lines: int) -> int:
    """Levels of so many columns that read released."""
    return (1 << lines) - 1 if skin.selects_low else 0


class DirectRows(wiring.Component):
    """The pins come from registers, so that no row is selected by a glitch. Nothing needs to be shifted."""

    def __init__(self, skin: Skin):
        self.skin = skin
        super().__init__(row_driver(skin))

    def elaborate(self, platform):
        m = Module()
        first = 1 if self.skin.scan == "raster" else (1 << self.skin.rows) - 1
        selected = Signal(self.skin.rows, init=first)
        with m.If(self.drive):
            m.d.sync += selected.eq(self.pattern)
        with m.Elif(self.release):
            m.d.sync += selected.eq(0)
        m.d.comb += self.pins.rows.eq(~selected if self.skin.selects_low else selected)
        return m


class DirectColumns(wiring.Component):
    """Two synchroniser stages."""

    def __init__(self, skin: Skin):
        self.skin = skin
        super().__init__(column_reader(skin))

    def elaborate(self, platform):
        m = Module()
        released = released_levels(self.skin, self.skin.columns)
        m.submodules.sync = FFSynchronizer(self.pins.columns, self.levels, init=released)
        begun = Signal()
        m.d.sync += [begun.eq(self.begin), self.done.eq(begun)]
        return m
