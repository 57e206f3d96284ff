"""Drives rows together where nothing is touched, one by one where something is."""

from amaranth.hdl import Cat, Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import HEARD_BITS, TIME_BITS, Derived
from contactfpga_hdl.payloads import row_layout, tag_layout
from contactfpga_hdl.scan.pins import DirectColumns, DirectRows, column_pins, connect_pins, row_pins
from contactfpga_hdl.scan.raster import watch_epoch
from contactfpga_hdl.scan.seek import Seek
from contactfpga_hdl.scan.shift import RowChain
from contactfpga_hdl.scan.stuck import Stuck, anywhere, present


class AdaptiveScanner(wiring.Component):
    """Adaptive scan: a diode a switch makes the columns the OR of the rows that are driven.

    Rows are offered in ascending order, each as soon as it and those before it are known: one that was driven alone
    three clocks after its sample, those that a probe found empty a clock each behind that. Untouched, all rows are
    driven without a pause and the columns looked at in each clock: ``contact`` rises three clocks behind a touch, and
    the next slots find it. ``contact`` falls two clocks behind the last strobe of a frame in which no row had a pressed
    switch. ``tag`` belongs to the frame whose last strobe was; it is complete three clocks after that and holds until
    the next frame's.

    With debounce ``alone`` says of the row on offer that it was driven alone, and ``sampled`` in which slot, counted
    from power-up on; ``busy``, a bit a row, keeps rows on the list.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = Derived(skin)
        super().__init__(
            {
                "pins": Out(wiring.Signature(row_pins(skin) | column_pins(skin))),
                "rows": Out(stream.Signature(row_layout(self.derived))),
                "tag": Out(tag_layout(self.derived)),
                "request": In(1),
                "heard": In(HEARD_BITS),
                "epoch": Out(1),
                "contact": Out(1),
                "alone": Out(1),
                "sampled": Out(self.derived.slot_bits),
                "busy": In(skin.rows),
            }
        )

    def elaborate(self, platform):
        m = Module()
        m.submodules.seek = self._seek = Seek(self.skin)
        m.submodules.driver = self._driver = self._row_driver()
        m.submodules.reader = self._reader = DirectColumns(self.skin)
        connect_pins(m, self._driver.pins, self.pins)
        connect_pins(m, self._reader.pins, self.pins)
        self._read_columns(m)
        self._time_slots(m)
        self._offer_rows(m)
        self._keep_listed(m)
        self._watch_contact(m)
        self._watch_stuck(m)
        self._tag_frame(m)
        return m

    def _row_driver(self):
        return DirectRows(self.skin) if self.skin.row_drive == "direct" else RowChain(self.skin)

    def _read_columns(self, m):
        levels, seek = self._reader.levels, self._seek
        self._columns = Signal(self.skin.columns)
        self._pressed = Signal(self.skin.columns)  # of the row that is driven alone
        m.d.comb += [
            self._columns.eq(~levels if self.skin.selects_low else levels),
            self._pressed.eq(self._columns),
            # A masked switch that is closed keeps its row on the list, so that it hides no other row's.
            seek.hit.eq((self._columns & anywhere(self.skin)).any()),
        ]
        for row in sorted({row for row, _ in self.skin.mask}):
            with m.If(seek.pattern[row]):
                m.d.comb += self._pressed.eq(self._columns & present(self.skin, row))

    def _time_slots(self, m):
        """As in a raster scan, but that idle rows stay driven. A column that reads pressed then ends the wait at once:
        that is the slot's strobe, and the release begins behind it."""
        derived, driver, seek = self.derived, self._driver, self._seek
        slot, settled, shifting = derived.row_clocks, derived.settle_clocks, derived.row_shift_clocks
        clock = Signal(range(slot), init=(slot - shifting) % slot)
        ends = clock == slot - 1
        off = Signal()  # no row is driven
        row_due = Signal(2)  # a sample on its way through the synchroniser
        released_due = Signal(2)
        self._watches = Signal()  # idle rows were driven for the settle time and still are
        wakes = seek.strobe & seek.idle & seek.hit
        self._released = released_due[-1]
        m.d.comb += [
            seek.strobe.eq(row_due[-1] | self._watches & seek.idle & seek.hit),
            driver.pattern.eq(seek.pattern),
            driver.drive.eq(ends & ~wakes),
            driver.release.eq((clock == settled - 1) & ~seek.idle | wakes),
        ]
        m.d.sync += [
            row_due.eq(Cat(clock == settled - 1, row_due)),
            released_due.eq(Cat(ends & off, released_due)),
            clock.eq(Mux(ends, 0, clock + 1)),
        ]
        if shifting:
            self._shift_rows(m, clock == slot - shifting, clock == 0, off, ends)
        with m.If(driver.release):
            m.d.sync += off.eq(1)
        with m.Elif(driver.drive):
            m.d.sync += off.eq(0)
        with m.If(seek.strobe):
            m.d.sync += self._watches.eq(seek.idle & ~seek.hit)
        with m.If(wakes):
            m.d.sync += [clock.eq(settled), row_due.eq(0)]

    def _shift_rows(self, m, in_release, in_settle, off, ends):
        """A pattern is shifted once it is chosen. That of idle rows is shifted anew at the beginning of each slot, so
        that registers that were disturbed get it back."""
        driver, seek = self._driver, self._seek
        begun = Signal()  # the first slot has
        with m.If(ends):
            m.d.sync += begun.eq(1)
        m.d.comb += driver.shift.eq(Mux(begun & ~off, in_settle & seek.idle, in_release))

    def _offer_rows(self, m):
        """Rows that are known, in order; at most one that was driven alone waits."""
        seek, rows = self._seek, self.rows
        place = Signal(self.skin.rows, init=1)  # of the next row to go, one-hot
        alone = Signal(self.skin.rows)  # of the row that waits
        cells = Signal(self.skin.columns)
        goes = rows.valid & rows.ready
        m.d.comb += [
            rows.valid.eq((seek.known & place).any()),
            self.alone.eq((alone & place).any()),
            rows.payload.cells.eq(Mux(self.alone, cells, 0)),
            rows.payload.last.eq(place[-1]),
            seek.clear.eq(goes & place[-1]),
        ]
        with m.If(goes):
            m.d.sync += [place.eq(place.rotate_left(1)), alone.eq(alone & ~place)]
        slot = Signal.like(self.sampled)
        with m.If(seek.strobe):
            m.d.sync += slot.eq(slot + 1)
        with m.If(seek.strobe & seek.alone):
            m.d.sync += [alone.eq(seek.pattern), cells.eq(self._pressed), self.sampled.eq(slot)]

    def _keep_listed(self, m):
        """A row stays on the list if it was pressed, or a switch in it counted so, behind its sample before."""
        seek = self._seek
        if self.skin.debounce != "none":
            m.d.comb += seek.busy.eq((self.busy & seek.pattern).any())
            return
        before = Signal(self.skin.rows)
        m.d.comb += seek.busy.eq((before & seek.pattern).any())
        with m.If(seek.strobe & seek.alone):
            m.d.sync += before.eq(before & ~seek.pattern | Mux(seek.hit, seek.pattern, 0))

    def _watch_contact(self, m):
        """In a probe a column counts if none of its switches is masked."""
        seek = self._seek
        clean = sum(1 << column for column in range(self.skin.columns) if all(column != c for _, c in self.skin.mask))
        row, seen = Signal(), Signal()
        looks = seek.strobe & ~seek.alone | self._watches
        m.d.comb += row.eq(seek.strobe & seek.alone & self._pressed.any())
        m.d.sync += seen.eq((seen | row) & ~seek.ends)
        with m.If(row | looks & (self._columns & clean).any()):
            m.d.sync += self.contact.eq(1)
        with m.Elif(seek.ends & ~seen):
            m.d.sync += self.contact.eq(0)

    def _watch_stuck(self, m):
        m.submodules.stuck = stuck = Stuck(self.skin)
        m.d.comb += [
            stuck.columns.eq(self._columns),
            stuck.released.eq(self._released),
            stuck.take.eq(self._seek.ends),
            self.tag.stuck.eq(stuck.count),
        ]

    def _tag_frame(self, m):
        """Time and request at the first strobe, and how many slots there were up to the last."""
        per_us, seek = self.derived.clocks_per_us, self._seek
        prescaler = Signal(range(max(2, per_us)))
        time, begun = Signal(TIME_BITS), Signal(TIME_BITS)
        waiting, requested, heard = Signal(), Signal(), Signal(HEARD_BITS)
        slots = Signal.like(self.tag.slots)
        m.d.sync += prescaler.eq(prescaler + 1)
        with m.If(prescaler == per_us - 1):
            m.d.sync += [prescaler.eq(0), time.eq(time + 1)]
        watch_epoch(m, time, self.epoch)
        with m.If(seek.strobe):
            m.d.sync += slots.eq(slots + 1)
        with m.If(seek.strobe & seek.first):
            m.d.sync += [begun.eq(time), requested.eq(waiting), waiting.eq(self.request), heard.eq(self.heard)]
        with m.Elif(self.request):
            m.d.sync += waiting.eq(1)
        with m.If(seek.ends):
            m.d.sync += [
                self.tag.time.eq(begun),
                self.tag.requested.eq(requested),
                self.tag.heard.eq(heard),
                self.tag.slots.eq(slots),
                slots.eq(0),
            ]
