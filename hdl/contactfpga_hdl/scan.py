"""Drives one row after the other and samples all columns of it at once."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

from contactfpga.derived import STUCK_MAX, TIME_BITS, Derived
from contactfpga.skin import Skin
from contactfpga_hdl.payloads import row_layout, tag_layout


class Scanner(wiring.Component):
    """Raster scan: a row a settle time, then a release time with no row driven.

    A row's columns are sampled at the pins in the last clock it is driven and offered three clocks later
    (two synchroniser stages and the row register). ``contact`` rises with the offer of the first row that holds a
    pressed switch and falls with the last row of a scan without one. ``tag`` belongs to the frame whose last row is
    being offered and holds until the next frame's first sample. A ``request`` is answered by ``requested`` in the tag
    of the next frame to start.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = Derived(skin)
        super().__init__(
            {
                "pins": Out(wiring.Signature({"rows": Out(skin.rows), "columns": In(skin.columns)})),
                "rows": Out(stream.Signature(row_layout(self.derived))),
                "tag": Out(tag_layout()),
                "request": In(1),
                "contact": Out(1),
            }
        )

    def elaborate(self, platform):
        m = Module()
        self._drive_rows(m)
        self._strobe(m)
        self._read_columns(m)
        self._offer_row(m)
        self._watch_contact(m)
        self._watch_stuck(m)
        self._tag_frame(m)
        return m

    def _drive_rows(self, m):
        """The pins come from registers, so that no row is selected by a glitch."""
        derived = self.derived
        clock = Signal(range(derived.row_clocks))
        turn = Signal(self.skin.rows, init=1)  # the row whose slot it is, one-hot
        selected = Signal(self.skin.rows, init=1)  # the same while it is driven
        self._ends_settle = clock == derived.settle_clocks - 1
        self._ends_release = clock == derived.row_clocks - 1
        m.d.sync += clock.eq(clock + 1)
        with m.If(self._ends_release):
            following = turn.rotate_left(1)
            m.d.sync += [clock.eq(0), turn.eq(following), selected.eq(following)]
        with m.If(self._ends_settle):
            m.d.sync += selected.eq(0)
        m.d.comb += self.pins.rows.eq(~selected if self.skin.diodes == "col2row" else selected)

    def _strobe(self, m):
        """The slot's two sampling moments, delayed by the two synchroniser stages."""
        settle = Signal(2)
        release = Signal(2)
        m.d.sync += [
            settle.eq(Cat(self._ends_settle, settle[0])),
            release.eq(Cat(self._ends_release, release[0])),
        ]
        self._sampled = settle[1]
        self._released = release[1]
        self._row = Signal(range(max(2, self.skin.rows)))
        self._first = self._row == 0
        self._last = self._row == self.skin.rows - 1
        with m.If(self._sampled):
            m.d.sync += self._row.eq(Mux(self._last, 0, self._row + 1))

    def _read_columns(self, m):
        inactive = (1 << self.skin.columns) - 1 if self.skin.diodes == "col2row" else 0
        synced = Signal(self.skin.columns, init=inactive)
        m.submodules.sync_columns = FFSynchronizer(self.pins.columns, synced, init=inactive)
        self._columns = Signal(self.skin.columns)
        self._pressed = Signal(self.skin.columns)
        m.d.comb += [
            self._columns.eq(~synced if self.skin.diodes == "col2row" else synced),
            self._pressed.eq(self._columns),
        ]
        with m.Switch(self._row):
            for row in sorted({row for row, _ in self.skin.mask}):
                present = sum(1 << c for c in range(self.skin.columns) if (row, c) not in self.skin.mask)
                with m.Case(row):
                    m.d.comb += self._pressed.eq(self._columns & present)

    def _offer_row(self, m):
        with m.If(self._sampled):
            m.d.sync += [
                self.rows.valid.eq(1),
                self.rows.payload.cells.eq(self._pressed),
                self.rows.payload.last.eq(self._last),
            ]
        with m.Elif(self.rows.ready):
            m.d.sync += self.rows.valid.eq(0)

    def _watch_contact(self, m):
        seen = Signal()  # in this scan's rows so far
        with m.If(self._sampled):
            now = self._pressed.any()
            m.d.sync += [
                seen.eq(~self._last & (seen | now)),
                self.contact.eq(now | Mux(self._last, seen, self.contact)),
            ]

    def _watch_stuck(self, m):
        present = sum(
            1 << c
            for c in range(self.skin.columns)
            if any((row, c) not in self.skin.mask for row in range(self.skin.rows))
        )
        stuck = Signal(self.skin.columns)
        count = sum(stuck[1:], stuck[0])
        with m.If(self._released):
            m.d.sync += stuck.eq(stuck | self._columns & present)
        with m.If(self._sampled & self._last):
            m.d.sync += [stuck.eq(0), self.tag.stuck.eq(Mux(count > STUCK_MAX, STUCK_MAX, count))]

    def _tag_frame(self, m):
        per_us = self.derived.clocks_per_us
        prescaler = Signal(range(max(2, per_us)))
        time = Signal(TIME_BITS)
        with m.If(prescaler == per_us - 1):
            m.d.sync += [prescaler.eq(0), time.eq(time + 1)]
        with m.Else():
            m.d.sync += prescaler.eq(prescaler + 1)
        waiting = Signal()
        with m.If(self._sampled & self._first):
            m.d.sync += [self.tag.time.eq(time), self.tag.requested.eq(waiting), waiting.eq(self.request)]
        with m.Elif(self.request):
            m.d.sync += waiting.eq(1)
