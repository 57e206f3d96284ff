"""Line reversal: which rows are handed on, the contact pin, and what moved within a frame."""

from amaranth.hdl import Const, Module, Mux, Signal, Value
from amaranth.lib import wiring

from contactfpga.skin import Skin
from contactfpga_hdl.scan.reversal_state import Sheet, Turn
from contactfpga_hdl.scan.stuck import present


def offer_driven_rows(m: Module, scan: wiring.Component, sheet: Sheet, turn: Turn, pressed: Value) -> None:
    rows, row = scan.rows, scan.rows.payload
    below, follows = Signal(), Signal()  # an empty row is on offer, or comes next
    m.d.comb += [row.y.eq(turn.y + below), scan.alone.eq(~below)]
    with m.If(rows.valid & rows.ready):
        m.d.sync += [rows.valid.eq(follows), below.eq(follows), follows.eq(0), row.cells.eq(0)]
    with m.If(turn.strobe):
        apart = turn.following != turn.y + 1
        m.d.sync += [rows.valid.eq(1), row.cells.eq(pressed), row.last.eq(~turn.todo.any())]
        m.d.sync += follows.eq(apart & turn.todo.any())
    with m.If(turn.begins & ~sheet.touched.any()):
        m.d.sync += [rows.valid.eq(1), below.eq(1), row.last.eq(1)]


def offer_all_rows(m: Module, scan: wiring.Component, sheet: Sheet, turn: Turn, pressed: Value) -> None:
    rows, row = scan.rows, scan.rows.payload
    place = Signal(range(max(2, scan.skin.rows)))  # of the row on offer
    driven = Signal()  # rows up to the one that was driven are known
    rest = Signal()  # all others are
    cells = Signal(scan.skin.columns)
    m.d.comb += [
        rows.valid.eq(driven | rest),
        scan.alone.eq(driven & (place == turn.y)),
        row.cells.eq(Mux(scan.alone, cells, 0)),
        row.last.eq(place == scan.skin.rows - 1),
    ]
    with m.If(rows.valid & rows.ready):
        m.d.sync += place.eq(Mux(row.last, 0, place + 1))
        with m.If(scan.alone):
            m.d.sync += driven.eq(0)
        with m.If(row.last):
            m.d.sync += rest.eq(0)
    with m.If(turn.strobe):
        m.d.sync += [driven.eq(1), rest.eq(~turn.todo.any()), cells.eq(pressed)]
    with m.If(turn.begins & ~sheet.touched.any()):
        m.d.sync += rest.eq(1)


def watch_contact(m: Module, scan: wiring.Component, sheet: Sheet, turn: Turn, pressed: Value) -> None:
    seen = Signal()  # in this frame's rows so far
    with m.If(turn.begins):
        m.d.sync += seen.eq(0)
        with m.If(~sheet.touched.any()):
            m.d.sync += scan.contact.eq(0)
    with m.If(turn.rests & turn.settled & sheet.clean):
        m.d.sync += scan.contact.eq(1)
    with m.If(turn.strobe):
        m.d.sync += seen.eq(seen | pressed.any())
        with m.If(pressed.any()):
            m.d.sync += scan.contact.eq(1)
        with m.Elif(~turn.todo.any() & ~seen):
            m.d.sync += scan.contact.eq(0)


def watch_motion(m: Module, scan: wiring.Component, sheet: Sheet, turn: Turn, pressed: Value) -> None:
    """A row without a masked switch read touched as the frame began, and empty when it was driven."""
    skin, moved = scan.skin, scan.tag.motion
    whole = clean_rows(skin)
    counts = Const(whole, skin.rows).bit_select(turn.y, 1) if whole != (1 << skin.rows) - 1 else 1
    if scan.derived.debounced:  # others are driven, too
        touched = Signal(skin.rows)
        with m.If(turn.begins):
            m.d.sync += touched.eq(sheet.read & whole)
        counts = touched.bit_select(turn.y, 1)
    with m.If(turn.begins):
        m.d.sync += moved.eq(0)
    with m.If(turn.strobe & ~pressed.any() & counts):
        m.d.sync += moved.eq(1)


def clean_rows(skin: Skin) -> int:
    """Rows, as bits, without a masked switch."""
    return sum(1 << row for row in range(skin.rows) if present(skin, row) == (1 << skin.columns) - 1)
