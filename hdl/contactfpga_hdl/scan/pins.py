"""Between scanner and sheet: which pins there are, and the drivers for one pin per row and per column."""

from amaranth.hdl import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

from contactfpga.choices import scans
from contactfpga.skin import Skin


def row_pins(skin: Skin) -> dict[str, wiring.Member]:
    """The pins that drive the rows: one per row, or those of the shift registers with one ``row_data`` per chain.

    A scan that reads the rows drives ``rows`` while ``rows_drive``, both bit by bit, and reads ``rows_read``.
    """
    if skin.reads_rows:
        return {"rows": Out(skin.rows), "rows_drive": Out(skin.rows), "rows_read": In(skin.rows)}
    if skin.row_drive == "direct":
        return {"rows": Out(skin.rows)}
    return {"row_data": Out(skin.row_chains), "row_clock": Out(1), "row_latch": Out(1), "row_enable_n": Out(1, init=1)}


def column_pins(skin: Skin) -> dict[str, wiring.Member]:
    """The pins that read the columns: one per column, or those of the shift registers with one ``column_data`` per
    chain. With precharge columns are driven to the released level while ``columns_drive``, bit by bit."""
    if skin.precharge_us:
        return _read_pins(skin) | {"columns_drive": Out(skin.columns)}
    return _read_pins(skin)


def _read_pins(skin: Skin) -> dict[str, wiring.Member]:
    if skin.column_read == "direct":
        return {"columns": In(skin.columns)}
    return {"column_load_n": Out(1, init=1), "column_clock": Out(1), "column_data": In(skin.column_chains)}


def connect_pins(m: Module, inner: wiring.PureInterface, outer: wiring.PureInterface) -> None:
    """Connect the pins of ``inner`` to the ones of the same names further out."""
    for name, member in inner.signature.members.items():
        inside, outside = getattr(inner, name), getattr(outer, name)
        m.d.comb += outside.eq(inside) if member.flow == Out else inside.eq(outside)


def row_driver(skin: Skin) -> wiring.Signature:
    """What drives the rows, as the scanner sees it.

    pins (out): those at the sheet.
    pattern (in): the rows of the next slot as ones. It must be stable from ``shift`` until ``drive``.
    shift (in): high for a clock, ``Derived.row_shift_clocks`` before the slot; direct rows need none. A pattern that is
    driven already may be shifted again.
    drive (in): high in the last clock before the slot; the rows are driven from the next clock on.
    release (in): high in the last clock in which they are driven.

    Direct rows drive row 0 after power-up, in an adaptive scan all rows.
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

    pins (out): those at the sheet.
    begin (in): high for a clock; the columns are sampled ``Derived.column_load_clocks`` later.
    levels (out): of the columns, while ``done``.
    done (out): high for a clock, ``2 + Derived.column_shift_clocks`` after they were sampled.
    """
    return wiring.Signature(
        {
            "pins": Out(wiring.Signature(_read_pins(skin))),
            "begin": In(1),
            "levels": Out(skin.columns),
            "done": Out(1),
        }
    )


def released_levels(skin: Skin, lines: int) -> int:
    """Levels of ``lines`` columns that read released."""
    return (1 << lines) - 1 if skin.selects_low else 0


class DirectRows(wiring.Component):
    """The pins come from registers, so that no row is selected by a glitch. Nothing needs to be shifted."""

    def __init__(self, skin: Skin):
        self.skin = skin
        super().__init__(row_driver(skin))

    def elaborate(self, platform):
        m = Module()
        first = 1 if scans.find(self.skin.scan).even else (1 << self.skin.rows) - 1
        selected = Signal(self.skin.rows, init=first)
        with m.If(self.drive):
            m.d.sync += selected.eq(self.pattern)
        with m.Elif(self.release):
            m.d.sync += selected.eq(0)
        m.d.comb += self.pins.rows.eq(~selected if self.skin.selects_low else selected)
        return m


class DirectColumns(wiring.Component):
    """Two synchronizer stages."""

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
