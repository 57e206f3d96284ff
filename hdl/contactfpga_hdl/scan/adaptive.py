"""Adaptive scan: drives untouched rows together."""

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.scan.frame_clock import FrameClock
from contactfpga_hdl.scan.pins import DirectColumns, DirectRows, connect_pins, scan_ports
from contactfpga_hdl.scan.seek import Seek
from contactfpga_hdl.scan.shift import RowChain
from contactfpga_hdl.scan.stuck import Stuck, anywhere, present


class _Reading:
    def __init__(self, derived: Derived):
        self.read = Signal(derived.skin.columns)  # columns that read pressed
        self.pressed = Signal(derived.skin.columns)  # and are not masked in the row that is driven alone
        self.of_released = Signal()  # no row was driven
        self.watches = Signal()  # idle rows were driven for the settle time and still are


class AdaptiveScanner(wiring.Component):
    """Adaptive scan: with a diode at each switch the columns are the OR of the driven rows.

    Rows are offered in ascending order, each when all up to it are known: a row driven alone three clocks after its
    sample, rows that a probe found empty in the clocks after that, one per clock. Untouched, all rows are driven and
    the columns read in each clock; the slots after a touch find its rows.

    The ports are those of :func:`~contactfpga_hdl.scan.pins.scan_ports`, and:

    tag (out): complete from three clocks after a frame's last strobe to the next frame's.
    contact (out): rises three clocks after a touch, and falls two clocks after the last strobe of an empty frame.
    alone (out): the offered row was driven alone.
    sampled (out): slot of the offered row, counted from power-up.
    busy (in): with debounce, a bit per row that must stay on the list.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = skin.derived
        super().__init__(
            {
                **scan_ports(self.derived),
                "alone": Out(1),
                "sampled": Out(self.derived.tick_bits),
                "busy": In(skin.rows),
            }
        )

    def elaborate(self, platform):
        m = Module()
        skin = self.skin
        m.submodules.seek = seek = Seek(skin)
        m.submodules.driver = driver = DirectRows(skin) if skin.row_drive == "direct" else RowChain(skin)
        m.submodules.reader = reader = DirectColumns(skin)
        m.submodules.stuck = stuck = Stuck(skin)
        connect_pins(m, driver.pins, self.pins)
        connect_pins(m, reader.pins, self.pins)
        sample = _Reading(self.derived)
        self._read_columns(m, reader.levels, seek, sample)
        self._time_slots(m, driver, seek, sample)
        self._offer_rows(m, seek, sample)
        self._keep_listed(m, seek)
        self._watch_contact(m, seek, sample)
        self._tag_frame(m, seek, driver)
        m.d.comb += [
            stuck.columns.eq(sample.read),
            stuck.released.eq(sample.of_released),
            stuck.take.eq(seek.ends),
            self.tag.stuck.eq(stuck.count),
            self.tag.fault.eq(stuck.count.any()),
        ]
        return m

    def _read_columns(self, m: Module, levels: Value, seek: Seek, sample: _Reading) -> None:
        m.d.comb += [
            sample.read.eq(~levels if self.skin.selects_low else levels),
            sample.pressed.eq(sample.read),
            # A masked switch that is closed keeps its row on the list, so that it hides no other row's.
            seek.hit.eq((sample.read & anywhere(self.skin)).any()),
        ]
        for row in sorted({row for row, _ in self.skin.mask}):
            with m.If(seek.pattern[row]):
                m.d.comb += sample.pressed.eq(sample.read & present(self.skin, row))

    def _time_slots(self, m: Module, driver: DirectRows | RowChain, seek: Seek, sample: _Reading) -> None:
        """Time slots as in a raster scan, but idle rows stay driven. A column that reads pressed ends that wait with
        the slot's strobe; the release begins after it."""
        derived = self.derived
        slot, settled, shifting = derived.row_clocks, derived.settle_clocks, derived.row_shift_clocks
        clock = Signal(range(slot), init=(slot - shifting) % slot)
        ends = clock == slot - 1
        off = Signal()  # no row is driven
        row_due = Signal(2)  # a sample on its way through the synchronizer
        released_due = Signal(2)
        wakes = seek.strobe & seek.idle & seek.hit
        m.d.comb += [
            seek.strobe.eq(row_due[-1] | sample.watches & seek.idle & seek.hit),
            sample.of_released.eq(released_due[-1]),
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
            begun = Signal()  # the first slot has
            with m.If(ends):
                m.d.sync += begun.eq(1)
            # A pattern is shifted once it is chosen. That of idle rows is shifted again at the beginning of each slot,
            # so that registers that were disturbed get it back.
            again = (clock == 0) & seek.idle
            m.d.comb += driver.shift.eq(Mux(begun & ~off, again, clock == slot - shifting))
        with m.If(driver.release):
            m.d.sync += off.eq(1)
        with m.Elif(driver.drive):
            m.d.sync += off.eq(0)
        with m.If(seek.strobe):
            m.d.sync += sample.watches.eq(seek.idle & ~seek.hit)
        with m.If(wakes):
            m.d.sync += [clock.eq(settled), row_due.eq(0)]

    def _offer_rows(self, m: Module, seek: Seek, sample: _Reading) -> None:
        """Offer known rows in order; at most one row that was driven alone waits."""
        rows = self.rows
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
            m.d.sync += [alone.eq(seek.pattern), cells.eq(sample.pressed), self.sampled.eq(slot)]

    def _keep_listed(self, m: Module, seek: Seek) -> None:
        if self.skin.debounce != "none":
            m.d.comb += seek.busy.eq((self.busy & seek.pattern).any())
            return
        before = Signal(self.skin.rows)
        m.d.comb += seek.busy.eq((before & seek.pattern).any())
        with m.If(seek.strobe & seek.alone):
            m.d.sync += before.eq(before & ~seek.pattern | Mux(seek.hit, seek.pattern, 0))

    def _watch_contact(self, m: Module, seek: Seek, sample: _Reading) -> None:
        """Drive the contact pin; in a probe a column counts if none of its switches is masked."""
        clean = sum(1 << column for column in range(self.skin.columns) if all(column != c for _, c in self.skin.mask))
        row, seen = Signal(), Signal()
        looks = seek.strobe & ~seek.alone | sample.watches
        m.d.comb += row.eq(seek.strobe & seek.alone & sample.pressed.any())
        m.d.sync += seen.eq((seen | row) & ~seek.ends)
        with m.If(row | looks & (sample.read & clean).any()):
            m.d.sync += self.contact.eq(1)
        with m.Elif(seek.ends & ~seen):
            m.d.sync += self.contact.eq(0)

    def _tag_frame(self, m: Module, seek: Seek, driver: wiring.Component) -> None:
        m.submodules.frame_clock = clock = FrameClock(self.skin)
        slots = Signal.like(self.tag.slots)
        m.d.comb += [
            clock.frame_begins.eq(seek.strobe & seek.first),
            clock.request.eq(self.request),
            clock.heard.eq(self.heard),
            self.epoch.eq(clock.epoch),
        ]
        if not self.skin.dual:
            m.d.comb += self.upset.eq(driver.upset | clock.upset)
        with m.If(seek.strobe):
            m.d.sync += slots.eq(slots + 1)
        with m.If(seek.ends):
            m.d.sync += [
                self.tag.time.eq(clock.begun),
                self.tag.requested.eq(clock.requested),
                self.tag.heard.eq(clock.known),
                self.tag.slots.eq(slots),
                slots.eq(0),
            ]
