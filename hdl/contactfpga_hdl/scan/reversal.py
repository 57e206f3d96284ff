"""Scan by line reversal."""

from amaranth.hdl import Cat, Const, Module, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import TIME_BITS
from contactfpga_hdl.scan.frame_clock import RETRY_BIT, FrameClock
from contactfpga_hdl.scan.pins import DirectColumns, drives_columns_both_ways, moves_sample, scan_ports
from contactfpga_hdl.scan.precharge import Precharge
from contactfpga_hdl.scan.reversal_cycle import ReversalCycle
from contactfpga_hdl.scan.reversal_guard import CHECK_BIT, Checks
from contactfpga_hdl.scan.reversal_rows import AllRows, Contact, DrivenRows, Motion, clean_rows
from contactfpga_hdl.scan.self_test import SelfTest, test_ports
from contactfpga_hdl.scan.stuck import count_columns, present


class ReversalScanner(wiring.Component):
    """Line reversal: the board *listens*, with columns driven and rows released, and then drives the rows that read
    touched.

    Untouched rows are read in each clock, and no level changes. A row's columns are sampled in the last clock in which
    the row is driven, or earlier by the command "sample at"; the row is offered three clocks later. The next row is
    driven when this row is taken; the next frame begins when this frame is packed. With ``guard`` a frame with a driven
    row ends with a check of guard lines, and a resting sheet is checked now and then; otherwise the guard column is
    driven to the selecting level, the guard row to the released level.

    The ports are those of :func:`~contactfpga_hdl.scan.pins.scan_ports`, and:

    rows (out): driven rows in ascending order, and an empty row after a row whose neighbor was not driven; an untouched
        sheet has one empty row. With ``report = "cells"`` all rows.
    tag (out): of the current frame; ``fault`` and stuck columns from three clocks after the frame began.
    faults (out): with ``guard``, from the clock after a check's sample is available.
    watched (out): pulse when a resting sheet was watched for another 256 us; with ``guard`` when it was checked.
    packed (in): pulse when the frame is packed.
    time (out): device time in us.
    due (in): a frame is wanted without a touch. One is also wanted when what is known of faults differs from the last
        frame's flag.
    stuck (out): high while a column is stuck, the guard column excepted.
    contact (out): rises three clocks after a touch of an untouched sheet; falls with a frame without a pressed switch.
    alone (out): the offered row was driven.
    sampled (out): time of its sample.
    busy (in): with debounce, a bit per row that is driven in the next frame, touched or not.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = skin.derived
        super().__init__(
            scan_ports(self.derived)
            | (test_ports(self.derived) if skin.self_test else {})
            | {
                "packed": In(1),
                "time": Out(TIME_BITS),
                "due": In(1),
                "alone": Out(1),
                "sampled": Out(self.derived.tick_bits),
                "busy": In(skin.rows),
                "watched": Out(1),
                "stuck": Out(1),
            }
        )

    def elaborate(self, platform):
        m = Module()
        skin = self.skin
        m.submodules.cycle = cycle = ReversalCycle(skin)
        m.submodules.frame_clock = clock = FrameClock(skin)
        m.submodules.precharge = precharge = Precharge(skin)
        read, pressed = Signal(skin.rows), Signal(skin.column_lines)  # rows that read touched, columns pressed
        # Lines at the pins, through synchronizers
        rows = Signal(skin.rows)
        at_pins = self.pins.rows_read[: skin.rows]
        m.submodules.rows = FFSynchronizer(at_pins, rows, init=0 if skin.selects_low else -1)
        m.submodules.reader = reader = DirectColumns(skin)
        m.d.comb += [
            reader.pins.columns.eq(self.pins.columns),
            pressed.eq(~reader.levels if skin.selects_low else reader.levels),
        ]
        if not skin.selects_low:
            rows = ~rows
        # Cycle
        m.d.comb += [
            read.eq(rows & sum(1 << row for row in range(skin.rows) if present(skin, row))),
            cycle.touched.eq(read | (self.busy if self.derived.debounced else 0)),
            cycle.packed.eq(self.packed),
            cycle.wanted.eq(clock.waiting | self.due | self._fault_changed(m) if skin.send == "on_change" else 1),
            self.stuck.eq(precharge.held[: skin.columns].any()),
        ]
        if moves_sample(self.derived):
            m.d.comb += [cycle.moves.eq(self.moves), cycle.clocks.eq(self.clocks)]
        # Rows and tag
        self._hand_on(m, cycle, (rows & clean_rows(skin)).any(), read, pressed)
        toggles = self._tag_frame(m, cycle, clock)
        test = SelfTest(skin) if skin.self_test else None
        # Pins
        begun = Signal()
        m.d.sync += begun.eq(cycle.begins)
        selected = Cat(cycle.selected, cycle.guard)[: skin.row_lines]
        if drives_columns_both_ways(skin):
            inverted = Signal()
            m.d.sync += inverted.eq(cycle.inverts | (0 if test is None else test.discharges))
            m.d.comb += self.pins.columns_level.eq(inverted ^ skin.selects_low)
        m.d.comb += [
            self.pins.rows.eq(~selected if skin.selects_low else selected),
            self.pins.columns_drive.eq(precharge.pins),
            precharge.drive.eq(cycle.charges),
            precharge.columns.eq(pressed),
            precharge.looks.eq(cycle.begins | cycle.rests & cycle.settled),
            precharge.retry.eq(self.time[RETRY_BIT]),
        ]
        self._let_go(m, cycle, precharge, test)
        count_columns(m, precharge.held[: skin.columns], begun, self.tag.stuck)
        # Checks of lines
        if skin.guard:
            self._check_lines(m, cycle, precharge, toggles, read, pressed)
        else:
            m.d.comb += self.watched.eq(toggles & cycle.rests)
        if test is not None:
            self._test_lines(m, cycle, test, read, pressed)
        return m

    def _fault_changed(self, m: Module) -> Value:
        """Whether any fault is known now, but not in the last frame's flag, or the other way round. It is late by a
        clock, which is less than the least distance of two frames."""
        changed = Signal()
        m.d.sync += changed.eq((self.stuck | self._any_fault) ^ self.tag.fault)
        return changed

    @property
    def _any_fault(self) -> Value:
        return self.faults.as_value().any() if "faults" in self.signature.members else Const(0)

    def _hand_on(self, m: Module, cycle: ReversalCycle, wakes: Value, read: Value, pressed: Value) -> None:
        skin = self.skin
        m.submodules.offer = offer = DrivenRows(skin) if self.derived.skips else AllRows(skin)
        m.submodules.contact = contact = Contact()
        m.submodules.motion = motion = Motion(skin)
        counted, clean, last = self._mask(m, cycle, pressed), Signal(), ~cycle.todo.any()
        untouched = cycle.begins & ~cycle.touched.any()
        wiring.connect(m, offer.rows, wiring.flipped(self.rows))
        m.d.comb += [
            clean.eq(wakes),
            cycle.offers.eq(offer.rows.valid),
            offer.untouched.eq(untouched),
            offer.strobe.eq(cycle.strobe),
            offer.pressed.eq(counted),
            offer.y.eq(cycle.y),
            offer.following.eq(cycle.following),
            offer.last.eq(last),
            self.alone.eq(offer.alone),
            contact.begins.eq(cycle.begins),
            contact.untouched.eq(untouched),
            contact.wakes.eq(cycle.rests & cycle.settled & clean),
            contact.strobe.eq(cycle.strobe),
            contact.pressed.eq(counted.any()),
            contact.last.eq(last),
            self.contact.eq(contact.contact),
            motion.begins.eq(cycle.begins),
            motion.read.eq(read),
            motion.strobe.eq(cycle.strobe),
            motion.pressed.eq(counted.any()),
            motion.y.eq(cycle.y),
            self.tag.motion.eq(motion.motion),
        ]

    def _mask(self, m: Module, cycle: ReversalCycle, pressed: Value) -> Value:
        masked = Signal(self.skin.columns)
        m.d.comb += masked.eq(pressed)
        with m.Switch(cycle.y):
            for row in sorted({row for row, _ in self.skin.mask}):
                with m.Case(row):
                    m.d.comb += masked.eq(pressed & present(self.skin, row))
        return masked

    def _tag_frame(self, m: Module, cycle: ReversalCycle, clock: FrameClock) -> Value:
        """Take a frame's tag as it begins; faults follow when stuck columns are counted. Returns a pulse when bit
        ``CHECK_BIT`` of the time has toggled."""
        before, toggles = Signal(), Signal()
        m.d.sync += before.eq(clock.time[CHECK_BIT])
        m.d.comb += [
            toggles.eq(before ^ clock.time[CHECK_BIT]),
            clock.frame_begins.eq(cycle.begins),
            clock.request.eq(self.request),
            clock.heard.eq(self.heard),
            self.time.eq(clock.time),
            self.epoch.eq(clock.epoch),
            self.upset.eq(clock.upset),
            self.tag.time.eq(clock.begun),
            self.tag.requested.eq(clock.requested),
            self.tag.heard.eq(clock.known),
        ]
        with m.If(cycle.strobe):
            m.d.sync += self.sampled.eq(clock.time)
        at_begin = Signal()
        counted = Signal(2)  # the last bit: the columns are counted in the next clock
        if "faults" in self.signature.members:
            m.d.sync += counted.eq(Cat(cycle.begins, counted))
            with m.If(counted[1]):
                m.d.sync += at_begin.eq(self._any_fault)
        m.d.comb += self.tag.fault.eq(self.tag.stuck.any() | at_begin)
        return toggles

    def _let_go(self, m: Module, cycle: ReversalCycle, precharge: Precharge, test: SelfTest | None) -> None:
        """Drive all rows or none, and the guard row; a self-test drives single lines."""
        skin = self.skin
        if test is None:
            drives_rows = Signal()
            holds = Signal()  # from the first clock on
            m.d.sync += [drives_rows.eq(~cycle.listens), holds.eq(1)]
            m.d.comb += self.pins.rows_drive.eq(Cat(drives_rows.replicate(skin.rows), holds))
            return
        rows, columns = test.drives()
        every = Cat((~cycle.listens).replicate(skin.rows), ~cycle.tests)[: skin.row_lines]
        drives = Signal(skin.row_lines)
        m.d.sync += drives.eq(every | rows)
        m.d.comb += [self.pins.rows_drive.eq(drives), precharge.others.eq(columns)]

    def _check_lines(
        self, m: Module, cycle: ReversalCycle, precharge: Precharge, toggles: Value, read: Value, pressed: Value
    ) -> None:
        m.submodules.checks = checks = Checks(self.skin)
        m.d.comb += [
            checks.due.eq(toggles),
            checks.starts.eq(cycle.check_starts),
            checks.checked.eq(cycle.checked),
            checks.rows.eq(read),
            checks.columns.eq(pressed),
            checks.held.eq(precharge.held),
            checks.retry.eq(self.time[RETRY_BIT]),
            cycle.check_asked.eq(checks.asked),
            cycle.of_rows.eq(checks.of_rows),
            precharge.guard_pressed.eq(checks.of_guard & pressed[-1]),
            self.faults.eq(checks.faults),
            self.watched.eq(cycle.checked & cycle.rests),
        ]

    def _test_lines(self, m: Module, cycle: ReversalCycle, test: SelfTest, read: Value, pressed: Value) -> None:
        m.submodules.test = test
        wiring.connect(m, test.slots, wiring.flipped(self.slots))
        m.d.comb += [
            test.command.eq(self.command),
            test.begin.eq(cycle.lets_go),
            test.rows.eq(read),
            test.columns.eq(~pressed),
            cycle.test_asked.eq(test.asks),
            cycle.tested.eq(test.ends),
            cycle.discharges.eq(test.discharges),
            self.faults.joined.eq(test.joined),
        ]
