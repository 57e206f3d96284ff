"""Data layouts between the stages."""

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin.derived import HEARD_BITS, STUCK_BITS, TIME_BITS, Derived
from contactfpga.wire.faults import SLOT_DIGITS
from contactfpga.wire.framing import DIGIT_BITS


def row_layout(derived: Derived) -> data.StructLayout:
    """A sampled row: a bit per column, or its level; whether the row is the frame's last; and its number if the scan
    skips rows."""
    number = {"y": row_bits(derived)} if derived.skips else {}
    return data.StructLayout({"cells": derived.skin.columns * derived.level_bits, "last": 1, **number})


def pressed_cells(derived: Derived, cells: Value) -> Value:
    """A bit per column of a row's ``cells``."""
    bits = derived.level_bits
    return cells if bits == 1 else Cat(cells.word_select(column, bits).any() for column in range(derived.skin.columns))


def row_bits(derived: Derived) -> int:
    return max(1, (derived.skin.rows - 1).bit_length())


def moments_layout(derived: Derived) -> data.StructLayout:
    return data.StructLayout({"area": derived.area_bits, "sum_x": derived.sum_x_bits, "sum_y": derived.sum_y_bits})


def zone_layout(derived: Derived) -> data.StructLayout:
    """A zone; with ``report = "moments"`` the bits of a zone record on the wire, lowest first.

    ``turned``, on a sheet whose ends meet, counts the cells past the seam: fewer than all, all in a ``ring``, or all
    ones for a zone that is ``wound``. With ``extent`` smallest and largest column and row follow.
    """
    moments = moments_layout(derived).members
    turned = {"turned": derived.area_bits} if derived.skin.closed else {}
    return data.StructLayout(moments | turned | extent_layout(derived))


def extent_layout(derived: Derived) -> dict[str, int]:
    return dict(zip(("left", "right", "top", "bottom"), derived.extent_bits))


def record_layout(derived: Derived) -> data.StructLayout:
    """A zone, or with ``end`` the mark after a frame's last zone."""
    return data.StructLayout({"zone": zone_layout(derived), "end": 1})


def passed_layout(derived: Derived) -> data.StructLayout:
    """Output of the audit: items, or zones still to be divided."""
    return record_layout(derived) if derived.skin.report == "barycenter" else item_layout(derived)


def item_layout(derived: Derived) -> data.StructLayout:
    """A part of a frame that is packed unchanged: a zone record or a bitmap row, or the end mark."""
    return data.StructLayout({"data": 8 * derived.item_bytes, "end": 1})


def tag_layout(derived: Derived) -> data.StructLayout:
    """The scanner's data of a frame besides its cells.

    ``heard``: number of the last request before the frame's first sample. ``requested``: whether that request came
    since the previous frame's. ``fault``: columns are stuck, or other faults are reported. ``motion``, if the scan
    reads rows, complete with the last row: a row read touched as the frame began, and empty when driven.
    """
    motion = {"motion": 1} if derived.skin.reads_rows else {}
    known = {"time": TIME_BITS, "stuck": STUCK_BITS, "fault": 1, "heard": HEARD_BITS, "requested": 1}
    return data.StructLayout(known | motion)


def faults_layout(derived: Derived) -> data.StructLayout:
    """The fault word of a Skin with ``guard`` or ``self_test``: open rows; open columns; columns, the guard column
    last, that read pressed while no row was driven; and whether the self-test found joined lines."""
    skin = derived.skin
    lines = {"rows": skin.rows, "columns": skin.columns, "stuck": skin.column_lines} if skin.guard else {}
    return data.StructLayout(lines | ({"joined": 1} if skin.self_test else {}))


def slots_layout(derived: Derived) -> data.StructLayout:
    """A slot of the self-test: its number, and the rows and columns that read released."""
    skin = derived.skin
    return data.StructLayout({"number": DIGIT_BITS * SLOT_DIGITS, "rows": skin.rows, "columns": skin.columns})


def summary_layout(derived: Derived) -> data.StructLayout:
    """A frame's trailer, valid when the end mark is packed."""
    return data.StructLayout(
        {
            "cells": derived.area_bits,
            "zones": derived.zones_bits,
            "overflow": 1,
            "mismatch": 1,
            "changed": 1,
        }
    )


def row_number(m: Module, derived: Derived, row: data.View, taken: Value) -> Value:
    """The number of the offered row: carried by it if the scan skips rows, otherwise counted as rows are ``taken``."""
    if derived.skips:
        return row.y
    y_next = Signal(range(max(2, derived.skin.rows)))
    with m.If(taken):
        m.d.sync += y_next.eq(Mux(row.last, 0, y_next + 1))
    return y_next


def labeller_ports(derived: Derived) -> dict[str, wiring.Member]:
    """Ports of a labeller.

    rows (in): a frame's rows in ascending order.
    records (out): the frame's zones, then an end mark.
    """
    return {
        "rows": In(stream.Signature(row_layout(derived))),
        "records": Out(stream.Signature(record_layout(derived))),
    }
