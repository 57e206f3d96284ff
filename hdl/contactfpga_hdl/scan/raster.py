"""Raster scan."""

from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import wiring

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.scan.frame_clock import RETRY_BIT, FrameClock
from contactfpga_hdl.scan.pins import DirectColumns, DirectRows, connect_pins, first_row, moves_sample, scan_ports
from contactfpga_hdl.scan.stuck import Stuck, present
from contactfpga_hdl.util.upset import upset


class _Slots:
    """The current slot: rows follow each other, a guard row before row 0. The first row, if it is shifted, is so in a
    slot of its own, because a counter that does not begin with 0 would break the carry chain of an iCE40."""

    def __init__(self, derived: Derived):
        slot, lines = derived.row_clocks, derived.skin.row_lines
        begun = int(not derived.start_clocks)
        self.first = first_row(derived.skin)
        self.clock = Signal(range(slot))
        self.scans = Signal(init=begun)  # in the first slot and after it
        self.following = Signal(lines, init=1 << (self.first + begun) % lines)  # row of the next one, one-hot

    @property
    def is_last(self) -> Value:
        return self.following[self.first] & self.scans

    @property
    def begins_guard(self) -> Value:
        """Whether the guard row's slot begins. Its ruler sets the samples of the rows that follow."""
        return self.following[0] & (self.clock == 0)

    @property
    def begins_rows(self) -> Value:
        return self.following[1 % len(self.following)] & (self.clock == 0)


class _Sample:
    def __init__(self, derived: Derived):
        self.begins = Signal()  # the next one, of a row
        self.early: Value = Const(0)  # before the settle time is over
        self.moved: Any = None  # the sample's clock, where a command or the ruler moves it
        self.harder: list[Any] = []  # with levels, the clocks of all but the lightest one's
        skin = derived.skin
        self.of_driven = Signal()  # high for a clock: it is there, and was taken while a row was driven
        self.of_row = Signal()  # and this is one of the sheet's rows
        self.of_released = Signal()  # likewise while no row was driven
        self.row = Signal(range(max(2, skin.row_lines)), init=first_row(skin))  # the next to be sampled
        self.read = Signal(skin.column_lines)  # columns that read pressed
        self.pressed = Signal(skin.columns * derived.level_bits)  # and are not masked in this row, or their levels
        self.is_first = self.row == 0
        self.is_last = Signal()  # as the slot says, so that a row's number that is wrong is so for one scan at most
        self.is_guard = self.row == skin.rows if skin.guard else Const(0)


class Scanner(wiring.Component):
    """Raster scan: each row in turn is driven for the settle time, then no row for the release time.

    A row's columns are sampled in the last clock in which the row is driven. The row is offered three clocks later (two
    synchronizer stages and the row register), plus the shift time of columns on shift registers. With ``guard`` a frame
    begins with the guard row, which is not offered. The command "sample at" moves the samples of all other rows to an
    earlier clock; these then do not check the guard column.

    The ports are those of :func:`~contactfpga_hdl.scan.pins.scan_ports`:

    tag (out): complete from one clock after the offer of a frame's last row to the next frame's.
    faults (out): changes one clock after a row's sample is available, for columns after the guard row's sample, for
        stuck columns after the last row's.
    contact (out): rises with the first row with a pressed switch, and falls with the last row of a scan without one.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = skin.derived
        super().__init__(scan_ports(self.derived))

    def elaborate(self, platform):
        m = Module()
        skin = self.skin
        # Drivers and readers of lines
        m.submodules.driver = driver = self._row_driver()
        m.submodules.reader = reader = self._column_reader()
        m.submodules.stuck = stuck = Stuck(skin)
        connect_pins(m, driver.pins, self.pins)
        connect_pins(m, reader.pins, self.pins)
        slots, sample = _Slots(self.derived), _Sample(self.derived)
        # Slots
        slot, shifting = self.derived.row_clocks, self.derived.row_shift_clocks
        ends = slots.clock == slot - 1
        m.d.sync += slots.clock.eq(slots.clock + 1)
        with m.If(ends):
            # One row only follows, whatever was there.
            before = slots.following[:-1]
            m.d.sync += [slots.clock.eq(0), slots.scans.eq(1), slots.following.eq(Cat(~before.any(), before))]
        m.d.comb += [
            driver.pattern.eq(slots.following),
            driver.shift.eq(slots.clock == slot - shifting),
            driver.drive.eq(ends),
            driver.release.eq(slots.clock == self.derived.settle_clocks - 1),
        ]
        # Sample, without masked switches
        levels = self._sample_columns(m, slots, reader, sample)
        m.d.comb += sample.read.eq(~levels if skin.selects_low else levels)
        cells: Value = sample.read
        if skin.levels > 1:
            from contactfpga_hdl.scan.levels import count_levels

            cells = count_levels(m, self, slots, reader.levels, sample)
        m.d.comb += sample.pressed.eq(cells)
        with m.Switch(sample.row):
            for row in sorted({row for row, _ in skin.mask}):
                with m.Case(row):
                    m.d.comb += sample.pressed.eq(cells & present(skin, row, self.derived.level_bits))
        # Rows
        with m.If(sample.of_row):
            m.d.sync += [
                self.rows.valid.eq(1),
                self.rows.payload.cells.eq(sample.pressed),
                self.rows.payload.last.eq(sample.is_last),
            ]
        with m.Elif(self.rows.ready):
            m.d.sync += self.rows.valid.eq(0)
        # Contact
        seen = Signal()  # in this scan's rows so far
        with m.If(sample.of_row):
            now = sample.pressed.any()
            m.d.sync += [
                seen.eq(~sample.is_last & (seen | now)),
                self.contact.eq(now | Mux(sample.is_last, seen, self.contact)),
            ]
        # Tag
        clock = self._tag_frame(m, slots, sample)
        if skin.precharge_us:
            self._precharge(m, slots, sample, clock.time)
        if not skin.dual:
            found = upset(m, "row", slots.following, driver.drive)
            m.d.comb += self.upset.eq(driver.upset | found | clock.upset)
        if skin.ruler:
            live, clock_of = ~reader.levels if skin.selects_low else reader.levels, slots.clock
            under_way = sample.is_guard & (clock_of >= 2) & (clock_of <= self.derived.settle_clocks + 1)
            for ruler in (sample.moved, *sample.harder):
                ruler.measure(m, slots.begins_guard, under_way, live[: skin.columns], self.faults.columns)
        # Faults
        m.d.comb += [
            stuck.columns.eq(sample.read),
            stuck.released.eq(sample.of_released),
            stuck.take.eq(sample.of_row & sample.is_last),
            self.tag.stuck.eq(stuck.count),
            self.tag.fault.eq(
                stuck.count.any() | (self._check_lines(m, sample, stuck, clock.time) if skin.guard else 0)
            ),
        ]
        return m

    def _row_driver(self) -> wiring.Component:
        if self.skin.row_drive == "direct":
            return DirectRows(self.skin)
        from contactfpga_hdl.scan.shift import RowChain

        return RowChain(self.skin)

    def _column_reader(self) -> wiring.Component:
        if self.skin.column_read == "direct":
            return DirectColumns(self.skin)
        from contactfpga_hdl.scan.shift import ColumnChain

        return ColumnChain(self.skin)

    def _sample_columns(self, m: Module, slots: _Slots, reader: wiring.Component, sample: _Sample) -> Value:
        """Sample in the last clock of a row, and in the last clock without a row; returns the sampled levels."""
        derived = self.derived
        lead = derived.column_load_clocks + 1
        begins_released = Signal()
        done_is_row = Signal(init=1)  # the two come in turn
        # None is under way when a row's begins.
        alone = self.skin.column_read == "direct" and derived.settle_clocks > 2
        m.d.comb += [
            sample.begins.eq(slots.scans & (slots.clock == self._sample_clock(m, slots, sample) - lead)),
            begins_released.eq(slots.scans & (slots.clock == derived.row_clocks - lead)),
            reader.begin.eq(sample.begins | begins_released),
            sample.of_row.eq(sample.of_driven & ~sample.is_guard),
            sample.of_released.eq(reader.done & ~done_is_row),
        ]
        m.d.sync += done_is_row.eq(done_is_row ^ reader.done | sample.begins & alone)
        with m.If(sample.begins):
            m.d.sync += sample.is_last.eq(slots.is_last)
        with m.If(sample.of_driven):
            m.d.sync += sample.row.eq(Mux(sample.is_last, slots.first, Mux(sample.is_guard, 0, sample.row + 1)))
        if moves_sample(derived):
            return self._keep_sample(m, slots, reader, sample)
        m.d.comb += sample.of_driven.eq(reader.done & done_is_row)
        return reader.levels

    def _sample_clock(self, m: Module, slots: _Slots, sample: _Sample) -> Value | int:
        if not moves_sample(self.derived):
            return self.derived.settle_clocks
        if self.skin.ruler:
            from contactfpga_hdl.scan.ruler import Ruler

            sample.moved = Ruler(m, self.derived, self.moves, self.clocks, slots.begins_rows)
        else:
            from contactfpga_hdl.scan.sample_at import SampleAt

            sample.moved = SampleAt(m, self.derived, self.moves, self.clocks, slots.begins_rows)
        sample.early = sample.moved.early
        moved = sample.moved.clock
        return Mux(sample.is_guard, sample.moved.settle, moved) if self.skin.guard else moved

    def _keep_sample(self, m: Module, slots: _Slots, reader: wiring.Component, sample: _Sample) -> Value:
        derived = self.derived
        counts = (derived.settle_clocks + 1 + derived.column_shift_clocks) % derived.row_clocks
        due, kept = Signal(name="sample_due"), Signal.like(reader.levels)
        m.d.comb += sample.of_driven.eq(due & (slots.clock == counts))
        m.d.sync += due.eq(due & ~sample.of_driven | sample.begins)
        with m.If(reader.done):
            m.d.sync += kept.eq(reader.levels)
        return Mux(reader.done, reader.levels, kept)

    def _precharge(self, m: Module, slots: _Slots, sample: _Sample, time: Value) -> None:
        """Drive columns while no row is driven, except for a clock at either end."""
        from contactfpga_hdl.scan.precharge import Precharge

        m.submodules.precharge = precharge = Precharge(self.skin)
        m.d.comb += [
            precharge.drive.eq(
                (slots.clock >= self.derived.settle_clocks) & (slots.clock < self.derived.row_clocks - 2)
            ),
            precharge.columns.eq(sample.read),
            precharge.looks.eq(sample.of_released),
            precharge.retry.eq(time[RETRY_BIT]),
            self.pins.columns_drive.eq(precharge.pins),
        ]

    def _check_lines(self, m: Module, sample: _Sample, stuck: Stuck, time: Value) -> Value:
        """Check lines. Returns whether a fault was reported as the frame ended, valid with the number of stuck
        columns."""
        from contactfpga_hdl.scan.guard import LineFaults

        skin = self.skin
        m.submodules.line_faults = line_faults = LineFaults(skin)
        ended = Signal()
        at_end = Signal()
        m.d.comb += [
            line_faults.rows.eq((~sample.read[-1]).replicate(skin.rows)),
            line_faults.columns.eq(~sample.read),
            line_faults.stuck.eq(stuck.seen),
            line_faults.checks_rows.eq(Mux(sample.of_row & ~sample.early, Const(1, skin.rows) << sample.row, 0)),
            line_faults.checks_columns.eq(sample.of_driven & sample.is_guard),
            line_faults.checks_stuck.eq(stuck.take),
            line_faults.round.eq(stuck.take),
            line_faults.retry.eq(time[RETRY_BIT]),
            self.faults.eq(line_faults.faults),
        ]
        m.d.sync += ended.eq(stuck.take)
        with m.If(ended):
            m.d.sync += at_end.eq(line_faults.faults.as_value().any())
        return at_end

    def _tag_frame(self, m: Module, slots: _Slots, sample: _Sample) -> FrameClock:
        """The frame clock; the tag takes its values with the last row's strobe."""
        late = self.derived.column_shift_clocks
        # The time starts with the first slot of the last row, so that at this row's strobe it gives the time of row
        # 0's sample: no register has to keep that.
        guarded = self.derived.row_clocks if self.skin.guard else 0
        clock = FrameClock(self.skin, ahead=self.derived.start_clocks + guarded - late)
        m.submodules.frame_clock = clock
        started = Signal()
        with m.If(slots.is_last):
            m.d.sync += started.eq(1)
        # A request that comes while columns are shifted in came after their sample, so it asks for the next frame.
        # Where commands move the sample, so does a request that comes once the sample's clock is fixed.
        moves = moves_sample(self.derived)
        if moves:
            begins = slots.begins_guard if self.skin.ruler else slots.begins_rows
        else:
            begins = (sample.begins if late else sample.of_row) & sample.is_first
        m.d.comb += [
            clock.runs.eq(started | slots.is_last),
            clock.frame_begins.eq(begins),
            clock.request.eq(self.request),
            clock.heard.eq(self.heard),
            self.epoch.eq(clock.epoch),
        ]
        requested, heard = clock.requested, clock.known
        if not late and not moves:  # the only row is the last one, too
            requested, heard = Mux(begins, clock.waiting, requested), Mux(begins, self.heard, heard)
        with m.If(sample.of_row & sample.is_last):
            m.d.sync += [self.tag.time.eq(clock.time), self.tag.requested.eq(requested), self.tag.heard.eq(heard)]
        return clock
