"""Pins between scanner and sheet, and drivers for one pin per row and per column.

A scanner and its direct pins are in the sheet's order, guard lines last; pins of shift registers are in line order.
"""

from amaranth.hdl import Module, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import HEARD_BITS, SAMPLE_AT, Derived
from contactfpga.wire.command import VALUE_DIGITS
from contactfpga.wire.framing import DIGIT_BITS
from contactfpga_hdl.payloads import faults_layout, row_layout, tag_layout
from contactfpga_hdl.util.upset import upset


def row_pins(skin: Skin) -> dict[str, wiring.Member]:
    """Pins that drive the rows: one per row, or those of shift registers with one ``row_data`` per chain. A scan that
    reads the rows drives each bit of ``rows`` while that of ``rows_drive`` is high, and reads ``rows_read``."""
    if skin.reads_rows:
        return {"rows": Out(skin.row_lines), "rows_drive": Out(skin.row_lines), "rows_read": In(skin.row_lines)}
    if skin.row_drive == "direct":
        return {"rows": Out(skin.row_lines)}
    return {"row_data": Out(skin.row_chains), "row_clock": Out(1), "row_latch": Out(1), "row_enable_n": Out(1, init=1)}


def column_pins(skin: Skin) -> dict[str, wiring.Member]:
    """Pins that read the columns: one per column, or those of shift registers with one ``column_data`` per chain.

    With precharge a column is driven to the released level while its bit of ``columns_drive`` is high. A scan that
    reads rows and has guard lines or a self-test drives columns to ``columns_level``, and the last one, the guard
    column, to the other level.
    """
    if skin.precharge_us:
        level = {"columns_level": Out(1, init=int(skin.selects_low))} if drives_columns_both_ways(skin) else {}
        return _read_pins(skin) | {"columns_drive": Out(skin.column_lines)} | level
    return _read_pins(skin)


def drives_columns_both_ways(skin: Skin) -> bool:
    return skin.reads_rows and (skin.guard or skin.self_test)


def _read_pins(skin: Skin) -> dict[str, wiring.Member]:
    if skin.column_read == "direct":
        return {"columns": In(skin.column_lines)}
    return {"column_load_n": Out(1, init=1), "column_clock": Out(1), "column_data": In(skin.column_chains)}


def connect_pins(m: Module, inner: wiring.PureInterface, outer: wiring.PureInterface) -> None:
    """Connect pins of ``inner`` to those of the same names in ``outer``."""
    for name, member in inner.signature.members.items():
        inside, outside = getattr(inner, name), getattr(outer, name)
        m.d.comb += outside.eq(inside) if member.flow == Out else inside.eq(outside)


def first_row(skin: Skin) -> int:
    """The row of a raster's first slot: the guard row, if any."""
    return skin.rows if skin.guard else 0


def row_driver(skin: Skin) -> wiring.Signature:
    """Interface of a row driver to the scanner. Direct rows drive the first row at power-up.

    pins (out): pins at the sheet.
    pattern (in): rows of the next slot as ones, stable from ``shift`` until ``drive``.
    shift (in): pulse ``Derived.row_shift_clocks`` before the slot, unused by direct rows.
    drive (in): pulse in the last clock before the slot.
    release (in): pulse in the last clock in which rows are driven.
    upset (out): see :func:`scan_ports`.
    """
    return wiring.Signature(
        {
            "pins": Out(wiring.Signature(row_pins(skin))),
            "pattern": In(skin.row_lines),
            "shift": In(1),
            "drive": In(1),
            "release": In(1),
            "upset": Out(1),
        }
    )


def column_reader(skin: Skin) -> wiring.Signature:
    """Interface of a column reader to the scanner.

    pins (out): pins at the sheet.
    begin (in): pulse ``Derived.column_load_clocks`` before the columns are sampled.
    levels (out): levels of the columns while ``done``.
    done (out): pulse ``2 + Derived.column_shift_clocks`` after the sample.
    """
    return wiring.Signature(
        {
            "pins": Out(wiring.Signature(_read_pins(skin))),
            "begin": In(1),
            "levels": Out(skin.column_lines),
            "done": Out(1),
        }
    )


def released_levels(skin: Skin, lines: int) -> int:
    """Levels of ``lines`` columns that read released."""
    return (1 << lines) - 1 if skin.selects_low else 0


class DirectRows(wiring.Component):
    """Row pins from registers, so that no glitch selects a row; they follow ``drive`` and ``release`` by a clock."""

    def __init__(self, skin: Skin):
        self.skin = skin
        super().__init__(row_driver(skin))

    def elaborate(self, platform):
        m = Module()
        skin = self.skin
        selected = Signal(skin.row_lines, init=1 << first_row(skin))
        with m.If(self.drive):
            m.d.sync += selected.eq(self.pattern)
        with m.Elif(self.release):
            m.d.sync += selected.eq(0)
        m.d.comb += self.pins.rows.eq(~selected if skin.selects_low else selected)
        if not skin.dual:
            m.d.comb += self.upset.eq(upset(m, "selected", selected, self.drive | self.release))
        return m


class DirectColumns(wiring.Component):
    """Column pins through two synchronizer stages, a delay of two clocks."""

    def __init__(self, skin: Skin):
        self.skin = skin
        super().__init__(column_reader(skin))

    def elaborate(self, platform):
        m = Module()
        released = released_levels(self.skin, self.skin.column_lines)
        m.submodules.sync = FFSynchronizer(self.pins.columns, self.levels, init=released)
        begun = Signal()
        m.d.sync += [begun.eq(self.begin), self.done.eq(begun)]
        return m


def scan_ports(derived: Derived) -> dict[str, wiring.Member]:
    """Ports of every scan to the sheet, the stages that take its rows, and the link.

    pins: pins of row driver and column reader.
    rows (out): rows in ascending order.
    tag (out): data of the frame whose last row had a strobe; each scan states when the tag is complete.
    request (in): pulse that the tag of the next frame to start answers with ``requested``.
    heard (in): copied into that tag.
    epoch (out): pulse every 2^22 us.
    faults (out): fault word, with ``guard`` or ``self_test``.
    upset (out): pulse when a register flipped by itself (:mod:`contactfpga_hdl.util.upset`); never with ``dual``, which
        finds more.
    contact (out): high while any switch reads pressed; each scan states when it rises and falls.
    """
    skin = derived.skin
    faults = faults_layout(derived)
    return {
        "pins": Out(wiring.Signature(row_pins(skin) | column_pins(skin))),
        "rows": Out(stream.Signature(row_layout(derived))),
        "tag": Out(tag_layout(derived)),
        "request": In(1),
        "heard": In(HEARD_BITS),
        "epoch": Out(1),
        "upset": Out(1),
        "contact": Out(1),
        **({"faults": Out(faults)} if faults.size else {}),
        **sample_at_ports(derived),
    }


def moves_sample(derived: Derived) -> bool:
    return SAMPLE_AT in derived.commands


def sample_at_ports(derived: Derived) -> dict[str, wiring.Member]:
    """Ports of a scan that obeys the command "sample at".

    moves (in): pulse with each command.
    clocks (in): value of the command, in that clock.
    """
    return {"moves": In(1), "clocks": In(DIGIT_BITS * VALUE_DIGITS)} if moves_sample(derived) else {}
