"""Drives all columns and reads the rows; then drives only the rows that are touched, one by one."""

from amaranth.hdl import Cat, Module, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import TIME_BITS, Derived
from contactfpga_hdl.scan.frame_clock import RETRY_BIT, FrameClock
from contactfpga_hdl.scan.pins import DirectColumns, drives_columns_both_ways, scan_ports
from contactfpga_hdl.scan.precharge import Precharge
from contactfpga_hdl.scan.reversal_guard import CHECK_BIT, Checks, check_lines, tag_faults, turned
from contactfpga_hdl.scan.reversal_rows import (
    clean_rows,
    offer_all_rows,
    offer_driven_rows,
    watch_contact,
    watch_motion,
)
from contactfpga_hdl.scan.reversal_state import Sheet, Turn
from contactfpga_hdl.scan.reversal_turns import take_turns
from contactfpga_hdl.scan.self_test import SelfTest, test_lines, test_ports
from contactfpga_hdl.scan.stuck import count_columns, present


class ReversalScanner(wiring.Component):
    """Line reversal: the board *listens*, columns driven and rows let go, and then drives the rows that read touched.

    With ``guard`` a frame with a driven row ends with a check of guard lines, and a sheet at rest is checked now and
    then. The guard column is driven to the selecting level in between, the guard row to the released one.

    Untouched rows are looked at in each clock, and no level changes. A row's columns are sampled in the last clock in
    which it is driven, or earlier on the command "sample at"; the row is offered three clocks later. The next row is
    not driven before this one is taken, and the next frame does not begin before this one is packed.

    rows (out): the rows that were driven, in ascending order, and an empty row after one whose neighbor was not; an
    untouched sheet has one empty row. With ``report = "cells"`` all rows.
    tag (out): of the frame that is under way; ``fault`` and the number of stuck columns from three clocks after it
    began.
    faults (out): with ``guard``; a check's from the clock after its sample is there.
    watched (out): high for a clock when the rows of a sheet at rest were watched for another 256 us; with ``guard``
    when it was checked.
    packed (in): high for a clock when it is packed.
    time (out): in us.
    due (in): a frame is wanted, though nothing is touched.
    contact (out): rises three clocks after a touch of an untouched sheet; falls with a frame without a pressed switch.
    alone (out): the row on offer was driven.
    sampled (out): at which time.
    busy (in): with debounce, a bit per row; that row is driven in the next frame, touched or not.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = Derived(skin)
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
            }
        )

    def elaborate(self, platform):
        m = Module()
        sheet, turn, checks = Sheet(self.skin), Turn(self.derived), Checks(self.derived)
        test = SelfTest(self.skin) if self.skin.self_test else None
        self._read_sheet(m, sheet)
        precharge = self._drive_sheet(m, sheet, turn, checks, test)
        take_turns(m, self, sheet, turn, checks)
        pressed = self._mask(m, sheet, turn)
        offer_rows = offer_driven_rows if self.derived.skips else offer_all_rows
        offer_rows(m, self, sheet, turn, pressed)
        watch_contact(m, self, sheet, turn, pressed)
        watch_motion(m, self, sheet, turn, pressed)
        self._tag_frame(m, turn)
        if self.skin.guard:
            check_lines(m, self, sheet, turn, checks, precharge)
        else:
            m.d.comb += self.watched.eq(turned(m, self.time[CHECK_BIT]) & turn.rests)
        if test is not None:
            test_lines(m, self, sheet, turn, test)
        tag_faults(m, self, turn)
        return m

    def _read_sheet(self, m: Module, sheet: Sheet) -> None:
        skin = self.skin
        counts = sum(1 << row for row in range(skin.rows) if present(skin, row))
        rows = Signal(skin.rows)
        at_pins = self.pins.rows_read[: skin.rows]
        m.submodules.rows = FFSynchronizer(at_pins, rows, init=0 if skin.selects_low else -1)
        m.submodules.reader = reader = DirectColumns(skin)
        touched = rows if skin.selects_low else ~rows
        m.d.comb += [
            reader.pins.columns.eq(self.pins.columns),
            sheet.pressed.eq(~reader.levels if skin.selects_low else reader.levels),
            sheet.read.eq(touched & counts),
            sheet.touched.eq(sheet.read | (self.busy if self.derived.debounced else 0)),
            sheet.clean.eq((touched & clean_rows(skin)).any()),
        ]

    def _drive_sheet(self, m: Module, sheet: Sheet, turn: Turn, checks: Checks, test: SelfTest | None) -> Precharge:
        """All pins come from registers; at power-up none is driven."""
        skin = self.skin
        m.submodules.precharge = precharge = Precharge(skin)
        begun = Signal()
        m.d.sync += begun.eq(turn.begins)
        selected, inverts = Cat(sheet.selected, sheet.guard)[: skin.row_lines], sheet.inverts
        if skin.guard:
            m.d.comb += precharge.guard_pressed.eq(checks.of_guard & sheet.pressed[-1])
        if test is not None:
            inverts = inverts | test.discharges
        if drives_columns_both_ways(skin):
            inverted = Signal()
            m.d.sync += inverted.eq(inverts)
            m.d.comb += self.pins.columns_level.eq(inverted ^ skin.selects_low)
        m.d.comb += [
            self.pins.rows.eq(~selected if skin.selects_low else selected),
            self.pins.columns_drive.eq(precharge.pins),
            precharge.drive.eq(sheet.charges),
            precharge.columns.eq(sheet.pressed),
            precharge.looks.eq(turn.begins | turn.rests & turn.settled),
            precharge.turn.eq(self.time[RETRY_BIT]),
        ]
        self._let_go(m, sheet, turn, precharge, test)
        count_columns(m, precharge.held[: skin.columns], begun, self.tag.stuck)
        return precharge

    def _let_go(self, m: Module, sheet: Sheet, turn: Turn, precharge: Precharge, test: SelfTest | None) -> None:
        """Which rows are driven: all or none, and a guard row but in a self-test; this drives single lines."""
        skin = self.skin
        if test is None:
            drives_rows = Signal()
            holds = Signal()  # from the first clock on
            m.d.sync += [drives_rows.eq(~sheet.listens), holds.eq(1)]
            m.d.comb += self.pins.rows_drive.eq(Cat(drives_rows.replicate(skin.rows), holds))
            return
        rows, columns = test.drives()
        every = Cat((~sheet.listens).replicate(skin.rows), ~turn.tests)[: skin.row_lines]
        drives = Signal(skin.row_lines)
        m.d.sync += drives.eq(every | rows)
        m.d.comb += [self.pins.rows_drive.eq(drives), precharge.others.eq(columns)]

    def _mask(self, m: Module, sheet: Sheet, turn: Turn) -> Value:
        """Columns that read pressed and are not masked in the row."""
        pressed = Signal(self.skin.columns)
        m.d.comb += pressed.eq(sheet.pressed)
        with m.Switch(turn.y):
            for row in sorted({row for row, _ in self.skin.mask}):
                with m.Case(row):
                    m.d.comb += pressed.eq(sheet.pressed & present(self.skin, row))
        return pressed

    def _tag_frame(self, m: Module, turn: Turn) -> None:
        """A frame's tag is what there is when it begins."""
        m.submodules.frame_clock = clock = FrameClock(self.skin)
        m.d.comb += [
            clock.frame_begins.eq(turn.begins),
            clock.request.eq(self.request),
            clock.heard.eq(self.heard),
            self.time.eq(clock.time),
            self.epoch.eq(clock.epoch),
            self.upset.eq(clock.upset),
            self.tag.time.eq(clock.begun),
            self.tag.requested.eq(clock.requested),
            self.tag.heard.eq(clock.known),
            turn.wanted.eq(clock.waiting | self.due if self.skin.send == "on_change" else 1),
        ]
        with m.If(turn.strobe):
            m.d.sync += self.sampled.eq(clock.time)
