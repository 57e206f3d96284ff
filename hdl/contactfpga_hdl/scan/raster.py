"""Drives one row after the other and samples all columns of it at once."""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import EPOCH_BITS, HEARD_BITS, TIME_BITS, Derived
from contactfpga_hdl.payloads import row_layout, tag_layout
from contactfpga_hdl.scan.pins import DirectColumns, DirectRows, column_pins, connect_pins, row_pins
from contactfpga_hdl.scan.shift import ColumnChain, RowChain
from contactfpga_hdl.scan.stuck import Stuck, present


class Scanner(wiring.Component):
    """Raster scan: a row a settle time, then a release time with no row driven.

    A row's columns are sampled in the last clock it is driven. The row is offered three clocks later (two synchroniser
    stages and the row register), and later by what its columns take on shift registers. ``contact`` rises with the
    offer of the first row that holds a pressed switch and falls with the last row of a scan without one. ``tag``
    belongs to the frame whose last row was offered; it is complete one clock after that and holds until the next
    frame's last row. A ``request`` is answered by ``requested`` in the tag of the next frame to start, which takes
    ``heard`` over. ``epoch`` is high for a clock when a further 2^22 us are over. ``pins`` are those of the row driver
    and of the column reader.
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
            }
        )

    def elaborate(self, platform):
        m = Module()
        self._connect_pins(m)
        self._drive_rows(m)
        self._sample_columns(m)
        self._mask_row(m)
        self._offer_row(m)
        self._watch_contact(m)
        self._watch_stuck(m)
        self._tag_frame(m)
        return m

    def _connect_pins(self, m):
        skin = self.skin
        self._driver = DirectRows(skin) if skin.row_drive == "direct" else RowChain(skin)
        self._reader = DirectColumns(skin) if skin.column_read == "direct" else ColumnChain(skin)
        m.submodules.driver, m.submodules.reader = self._driver, self._reader
        connect_pins(m, self._driver.pins, self.pins)
        connect_pins(m, self._reader.pins, self.pins)

    def _drive_rows(self, m):
        """Slots follow each other; before the first one there is the time to shift its row."""
        derived, driver = self.derived, self._driver
        slot, shifting = derived.row_clocks, derived.row_shift_clocks
        begun = int(not shifting)
        self._clock = Signal(range(slot), init=(slot - shifting) % slot)
        self._scans = Signal(init=begun)  # in the first slot and after it
        following = Signal(self.skin.rows, init=1 << begun % self.skin.rows)  # the row of the next slot, one-hot
        self._in_last_slot = following[0] & self._scans
        ends = self._clock == slot - 1
        m.d.sync += self._clock.eq(self._clock + 1)
        with m.If(ends):
            m.d.sync += [self._clock.eq(0), self._scans.eq(1), following.eq(following.rotate_left(1))]
        m.d.comb += [
            driver.pattern.eq(following),
            driver.shift.eq(self._clock == slot - shifting),
            driver.drive.eq(ends),
            driver.release.eq(self._clock == derived.settle_clocks - 1),
        ]

    def _sample_columns(self, m):
        """A slot has two samples: in the last clock its row is driven, and in the last one that no row is."""
        derived, reader = self.derived, self._reader
        lead = derived.column_load_clocks + 1
        self._begins_row = Signal()
        begins_released = Signal()
        done_is_row = Signal(init=1)  # the two come in turn
        self._sampled = Signal()
        self._released = Signal()
        m.d.comb += [
            self._begins_row.eq(self._scans & (self._clock == derived.settle_clocks - lead)),
            begins_released.eq(self._scans & (self._clock == derived.row_clocks - lead)),
            reader.begin.eq(self._begins_row | begins_released),
            self._sampled.eq(reader.done & done_is_row),
            self._released.eq(reader.done & ~done_is_row),
        ]
        m.d.sync += done_is_row.eq(done_is_row ^ reader.done)
        self._row = Signal(range(max(2, self.skin.rows)))  # the next to be sampled
        self._first = self._row == 0
        self._last = self._row == self.skin.rows - 1
        with m.If(self._sampled):
            m.d.sync += self._row.eq(Mux(self._last, 0, self._row + 1))

    def _mask_row(self, m):
        levels = self._reader.levels
        self._columns = Signal(self.skin.columns)
        self._pressed = Signal(self.skin.columns)
        m.d.comb += [
            self._columns.eq(~levels if self.skin.selects_low else levels),
            self._pressed.eq(self._columns),
        ]
        with m.Switch(self._row):
            for row in sorted({row for row, _ in self.skin.mask}):
                with m.Case(row):
                    m.d.comb += self._pressed.eq(self._columns & present(self.skin, row))

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
        m.submodules.stuck = stuck = Stuck(self.skin)
        m.d.comb += [
            stuck.columns.eq(self._columns),
            stuck.released.eq(self._released),
            stuck.take.eq(self._sampled & self._last),
            self.tag.stuck.eq(stuck.count),
        ]

    def _tag_frame(self, m):
        """Time and request at the first row's sample; the tag takes them over with the last row's strobe."""
        per_us, late = self.derived.clocks_per_us, self.derived.column_shift_clocks
        # The clock starts with the first slot of the last row, to tell at its strobe what it was at the first row's
        # sample: so no register has to keep that.
        ahead = self.derived.row_shift_clocks - late
        prescaler = Signal(range(max(2, per_us)), init=ahead % per_us)
        time = Signal(TIME_BITS, init=ahead // per_us % (1 << TIME_BITS))
        runs = Signal()
        with m.If(self._in_last_slot):
            m.d.sync += runs.eq(1)
        with m.If(runs | self._in_last_slot):
            m.d.sync += prescaler.eq(prescaler + 1)
            with m.If(prescaler == per_us - 1):
                m.d.sync += [prescaler.eq(0), time.eq(time + 1)]
        watch_epoch(m, time, self.epoch, late=ahead < 0)
        waiting, requested, heard = Signal(), Signal(), Signal(HEARD_BITS)
        # What comes while columns are shifted in came after their sample: it asks for the next frame.
        begins = (self._begins_row if late else self._sampled) & self._first
        asked, heard_now = requested, heard
        if not late:
            asked, heard_now = Mux(begins, waiting, requested), Mux(begins, self.heard, heard)
        with m.If(begins):
            m.d.sync += [requested.eq(waiting), waiting.eq(self.request), heard.eq(self.heard)]
        with m.Elif(self.request):
            m.d.sync += waiting.eq(1)
        with m.If(self._sampled & self._last):
            m.d.sync += [self.tag.time.eq(time), self.tag.requested.eq(asked), self.tag.heard.eq(heard_now)]


def watch_epoch(m: Module, time: Signal, epoch: Signal, late: bool = False) -> None:
    """``epoch`` is high in the first clock of each further 2^``EPOCH_BITS`` us; ``late``: the time begins below 0."""
    highest = time[EPOCH_BITS - 1]
    counts = Signal(init=not late)  # not when 0 is first reached
    before = Signal(name="before_epoch")
    m.d.sync += [counts.eq(counts | ~highest), before.eq(highest & counts)]
    m.d.comb += epoch.eq(before & ~highest)
