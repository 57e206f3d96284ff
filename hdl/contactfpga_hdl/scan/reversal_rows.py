"""Line reversal: rows passed on, the contact pin, and motion within a frame."""

from amaranth.hdl import Const, Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.payloads import row_bits, row_layout
from contactfpga_hdl.scan.stuck import present


def offer_ports(derived: Derived) -> dict[str, wiring.Member]:
    """Ports of the stage that passes rows on.

    untouched (in): pulse when a frame without a driven row begins.
    strobe (in): pulse with the columns of a row.
    pressed, y, last (in): columns that read pressed in that row, its number, and whether it is the frame's last.
    following (in): number of the next row.
    rows (out), alone (out): see :class:`~contactfpga_hdl.scan.reversal.ReversalScanner`.
    """
    number = row_bits(derived)
    return {
        "untouched": In(1),
        "strobe": In(1),
        "pressed": In(derived.skin.columns),
        "y": In(number),
        "following": In(number),
        "last": In(1),
        "rows": Out(stream.Signature(row_layout(derived))),
        "alone": Out(1),
    }


class DrivenRows(wiring.Component):
    """Passes on the driven rows, and an empty row after a row whose neighbor was not driven."""

    def __init__(self, skin: Skin):
        super().__init__(offer_ports(skin.derived))

    def elaborate(self, platform):
        m = Module()
        rows, row = self.rows, self.rows.payload
        below, follows = Signal(), Signal()  # an empty row is on offer, or comes next
        m.d.comb += [row.y.eq(self.y + below), self.alone.eq(~below)]
        # Row on offer
        with m.If(rows.valid & rows.ready):
            m.d.sync += [rows.valid.eq(follows), below.eq(follows), follows.eq(0), row.cells.eq(0)]
        with m.If(self.strobe):
            m.d.sync += [rows.valid.eq(1), row.cells.eq(self.pressed), row.last.eq(self.last)]
            m.d.sync += follows.eq((self.following != self.y + 1) & ~self.last)
        with m.If(self.untouched):
            m.d.sync += [rows.valid.eq(1), below.eq(1), row.last.eq(1)]
        return m


class AllRows(wiring.Component):
    """Passes on all rows, undriven ones as empty."""

    def __init__(self, skin: Skin):
        self.skin = skin
        super().__init__(offer_ports(skin.derived))

    def elaborate(self, platform):
        m = Module()
        rows, row = self.rows, self.rows.payload
        place = Signal(range(max(2, self.skin.rows)))  # of the row on offer
        driven = Signal()  # rows up to the one that was driven are known
        rest = Signal()  # all others are
        cells = Signal(self.skin.columns)
        m.d.comb += [
            rows.valid.eq(driven | rest),
            self.alone.eq(driven & (place == self.y)),
            row.cells.eq(Mux(self.alone, cells, 0)),
            row.last.eq(place == self.skin.rows - 1),
        ]
        # Rows in order
        with m.If(rows.valid & rows.ready):
            m.d.sync += place.eq(Mux(row.last, 0, place + 1))
            with m.If(self.alone):
                m.d.sync += driven.eq(0)
            with m.If(row.last):
                m.d.sync += rest.eq(0)
        with m.If(self.strobe):
            m.d.sync += [driven.eq(1), rest.eq(self.last), cells.eq(self.pressed)]
        with m.If(self.untouched):
            m.d.sync += rest.eq(1)
        return m


class Contact(wiring.Component):
    """The contact pin.

    begins, untouched (in): pulses when a frame begins, and when it has no driven row.
    wakes (in): a row without a masked switch of a resting sheet reads touched.
    strobe (in): pulse with the columns of a row.
    pressed, last (in): a switch of that row is pressed; the row is the frame's last.
    contact (out): rises with ``wakes`` or ``pressed``, and falls with a frame without a pressed switch.
    """

    def __init__(self) -> None:
        inputs = ("begins", "untouched", "wakes", "strobe", "pressed", "last")
        super().__init__({**dict.fromkeys(inputs, In(1)), "contact": Out(1)})

    def elaborate(self, platform):
        m = Module()
        seen = Signal()  # in this frame's rows so far
        with m.If(self.begins):
            m.d.sync += seen.eq(0)
        with m.If(self.untouched):
            m.d.sync += self.contact.eq(0)
        with m.If(self.wakes):
            m.d.sync += self.contact.eq(1)
        with m.If(self.strobe):
            m.d.sync += seen.eq(seen | self.pressed)
            with m.If(self.pressed):
                m.d.sync += self.contact.eq(1)
            with m.Elif(self.last & ~seen):
                m.d.sync += self.contact.eq(0)
        return m


class Motion(wiring.Component):
    """Whether a row without a masked switch read touched as the frame began, and empty when driven.

    begins (in): pulse when a frame begins.
    read (in): rows that then read touched.
    strobe (in): pulse with the columns of a row.
    pressed, y (in): a switch of that row is pressed; number of the row.
    motion (out): such a row was found since the frame began.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = skin.derived
        inputs = dict.fromkeys(("begins", "strobe", "pressed"), In(1))
        super().__init__({**inputs, "read": In(skin.rows), "y": In(row_bits(self.derived)), "motion": Out(1)})

    def elaborate(self, platform):
        m = Module()
        rows, whole = self.skin.rows, clean_rows(self.skin)
        counts = Const(whole, rows).bit_select(self.y, 1) if whole != (1 << rows) - 1 else 1
        if self.derived.debounced:  # others are driven, too
            touched = Signal(rows)
            with m.If(self.begins):
                m.d.sync += touched.eq(self.read & whole)
            counts = touched.bit_select(self.y, 1)
        with m.If(self.begins):
            m.d.sync += self.motion.eq(0)
        with m.If(self.strobe & ~self.pressed & counts):
            m.d.sync += self.motion.eq(1)
        return m


def clean_rows(skin: Skin) -> int:
    """Rows, as bits, without a masked switch."""
    return sum(1 << row for row in range(skin.rows) if present(skin, row) == (1 << skin.columns) - 1)
