"""Drives all columns and reads the rows; then drives only the rows that are touched, one by one."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import TIME_BITS, Derived
from contactfpga_hdl.payloads import row_bits
from contactfpga_hdl.scan.pins import DirectColumns
from contactfpga_hdl.scan.ports import scan_ports
from contactfpga_hdl.scan.precharge import RETRY_BIT, Precharge
from contactfpga_hdl.scan.raster import watch_epoch
from contactfpga_hdl.scan.stuck import count_columns, present

SYNCHRONIZED = 3
"""Clocks that a touch has been there when its row reads touched in a synchronizer's output, that clock included."""


class _Sheet:
    """What the sheet shows, and what the board does to it."""

    def __init__(self, skin: Skin):
        self.pressed = Signal(skin.columns)  # columns that read pressed
        self.touched = Signal(skin.rows)  # rows to drive: they read touched, or have a debounce time running
        self.clean = Signal()  # a row without a masked switch reads touched
        self.charges = Signal()  # columns are driven in the next clock
        self.listens = Signal()  # rows are let go in the next clock
        self.selected = Signal(skin.rows)  # rows that are driven to the selecting level


class _Turn:
    """Where the scan is in a frame."""

    def __init__(self, derived: Derived):
        rows = derived.skin.rows
        self.begins = Signal()  # high for a clock: rows were sampled, and the frame is what they showed
        self.rests = Signal()  # they showed nothing, and are watched since
        self.settled = Signal()  # rows have been let go for long enough
        self.wanted = Signal()  # a frame is, though nothing is touched
        self.underway = Signal()  # a frame has begun and is not packed
        self.todo = Signal(rows)  # rows still to be driven in this frame
        self.y = Signal(row_bits(derived))  # of the row that is driven, or was last
        self.following = Signal(row_bits(derived))  # of the next one
        self.strobe = Signal()  # high for a clock: the columns of that row are there
        self.waits = Signal()  # a row is on its way, or on offer


class ReversalScanner(wiring.Component):
    """Line reversal: the board *listens*, columns driven and rows let go, and then drives the rows that read touched.

    Untouched rows are looked at in each clock, and no level changes. A row's columns are sampled in the last clock in
    which it is driven; the row is offered three clocks later. The next row is not driven before this one is taken, and
    the next frame does not begin before this one is packed.

    rows (out): the rows that were driven, in ascending order, and an empty row after one whose neighbor was not; an
    untouched sheet has one empty row. With ``report = "cells"`` all rows.
    tag (out): of the frame that is under way.
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
            | {
                "packed": In(1),
                "time": Out(TIME_BITS),
                "due": In(1),
                "alone": Out(1),
                "sampled": Out(self.derived.tick_bits),
                "busy": In(skin.rows),
            }
        )

    def elaborate(self, platform):
        m = Module()
        sheet, turn = _Sheet(self.skin), _Turn(self.derived)
        self._read_sheet(m, sheet)
        self._drive_sheet(m, sheet, turn)
        self._take_turns(m, sheet, turn)
        pressed = self._mask(m, sheet, turn)
        if self.derived.skips:
            self._offer_driven_rows(m, sheet, turn, pressed)
        else:
            self._offer_all_rows(m, sheet, turn, pressed)
        self._watch_contact(m, sheet, turn, pressed)
        self._tag_frame(m, turn)
        return m

    def _read_sheet(self, m: Module, sheet: _Sheet) -> None:
        skin = self.skin
        counts = sum(1 << row for row in range(skin.rows) if present(skin, row))
        clean = sum(1 << row for row in range(skin.rows) if present(skin, row) == (1 << skin.columns) - 1)
        rows = Signal(skin.rows)
        m.submodules.rows = FFSynchronizer(self.pins.rows_read, rows, init=0 if skin.selects_low else -1)
        m.submodules.reader = reader = DirectColumns(skin)
        touched = rows if skin.selects_low else ~rows
        m.d.comb += [
            reader.pins.columns.eq(self.pins.columns),
            sheet.pressed.eq(~reader.levels if skin.selects_low else reader.levels),
            sheet.touched.eq(touched & counts | (self.busy if self.derived.debounced else 0)),
            sheet.clean.eq((touched & clean).any()),
        ]

    def _drive_sheet(self, m: Module, sheet: _Sheet, turn: _Turn) -> None:
        """All pins come from registers; at power-up none is driven."""
        m.submodules.precharge = precharge = Precharge(self.skin)
        driven, begun = Signal(), Signal()
        m.d.sync += [driven.eq(~sheet.listens), begun.eq(turn.begins)]
        m.d.comb += [
            self.pins.rows.eq(~sheet.selected if self.skin.selects_low else sheet.selected),
            self.pins.rows_drive.eq(driven.replicate(self.skin.rows)),
            self.pins.columns_drive.eq(precharge.pins),
            precharge.drive.eq(sheet.charges),
            precharge.columns.eq(sheet.pressed),
            precharge.stuck.eq(turn.begins | turn.rests & turn.settled),
            precharge.turn.eq(self.time[RETRY_BIT]),
        ]
        count_columns(m, precharge.held, begun, self.tag.stuck)
        m.d.comb += self.tag.fault.eq(self.tag.stuck.any())

    def _take_turns(self, m: Module, sheet: _Sheet, turn: _Turn) -> None:
        """What a state does to the sheet is seen at the pins a clock later."""
        derived = self.derived
        project, settle, charge = derived.project_clocks, derived.settle_clocks, derived.release_clocks - 2
        listened = project + SYNCHRONIZED  # clocks for which columns are driven as a frame begins, and one more
        charged = min(charge - 1, charge - derived.precharge_clocks + listened)
        clock = Signal(range(max(listened, settle + 1, charge)))
        due = Signal(2)  # a sample on its way through the synchronizer
        touched = sheet.touched.any()
        m.d.comb += [
            turn.following.eq(_lowest(turn.todo)[: len(turn.y)]),
            turn.strobe.eq(due[-1]),
            turn.waits.eq(due.any() | self.rows.valid),
        ]
        m.d.sync += [
            clock.eq(clock + 1),
            due.eq(due << 1),
            turn.underway.eq((turn.underway | turn.begins) & ~self.packed),
            turn.todo.eq(Mux(turn.begins, sheet.touched, turn.todo & ~sheet.selected)),
            sheet.selected.eq(0),
        ]
        with m.FSM(name="turn"):
            with m.State("LISTEN"):
                m.d.comb += [
                    sheet.charges.eq(1),
                    sheet.listens.eq(1),
                    turn.settled.eq(clock == listened - 1),
                ]
                with m.If(turn.settled):
                    m.d.sync += clock.eq(clock)
                    with m.If(turn.rests & touched):  # others may be about to be
                        m.d.sync += [turn.rests.eq(0), clock.eq(SYNCHRONIZED)]
                    with m.Elif(~turn.underway & (~turn.rests | turn.wanted)):
                        m.d.comb += turn.begins.eq(1)
                        m.d.sync += turn.rests.eq(~touched)
                        with m.If(touched):
                            m.d.sync += clock.eq(charged)
                            m.next = "CHARGE"
            with m.State("CHARGE"):
                m.d.comb += sheet.charges.eq(1)
                with m.If(clock == charge - 1):
                    m.d.sync += clock.eq(clock)
                    with m.If(~turn.waits):
                        m.next = "GAP"
            with m.State("GAP"):
                m.d.sync += [clock.eq(0), turn.y.eq(turn.following)]
                m.next = "SELECT"
            with m.State("SELECT"):
                m.d.sync += sheet.selected.eq(Const(1, self.skin.rows) << turn.y)
                with m.If(clock == settle):
                    m.d.sync += [sheet.selected.eq(0), due.eq(1), clock.eq(0)]
                    with m.If(turn.todo.any()):
                        m.next = "CHARGE"
                    with m.Else():
                        m.next = "LISTEN"

    def _mask(self, m: Module, sheet: _Sheet, turn: _Turn) -> Value:
        """Columns that read pressed and are not masked in the row."""
        pressed = Signal(self.skin.columns)
        m.d.comb += pressed.eq(sheet.pressed)
        with m.Switch(turn.y):
            for row in sorted({row for row, _ in self.skin.mask}):
                with m.Case(row):
                    m.d.comb += pressed.eq(sheet.pressed & present(self.skin, row))
        return pressed

    def _offer_driven_rows(self, m: Module, sheet: _Sheet, turn: _Turn, pressed: Value) -> None:
        rows, row = self.rows, self.rows.payload
        below, follows = Signal(), Signal()  # an empty row is on offer, or comes next
        m.d.comb += [row.y.eq(turn.y + below), self.alone.eq(~below)]
        with m.If(rows.valid & rows.ready):
            m.d.sync += [rows.valid.eq(follows), below.eq(follows), follows.eq(0), row.cells.eq(0)]
        with m.If(turn.strobe):
            apart = turn.following != turn.y + 1
            m.d.sync += [rows.valid.eq(1), row.cells.eq(pressed), row.last.eq(~turn.todo.any())]
            m.d.sync += follows.eq(apart & turn.todo.any())
        with m.If(turn.begins & ~sheet.touched.any()):
            m.d.sync += [rows.valid.eq(1), below.eq(1), row.last.eq(1)]

    def _offer_all_rows(self, m: Module, sheet: _Sheet, turn: _Turn, pressed: Value) -> None:
        rows, row = self.rows, self.rows.payload
        place = Signal(range(max(2, self.skin.rows)))  # of the row on offer
        driven = Signal()  # rows up to the one that was driven are known
        rest = Signal()  # all others are
        cells = Signal(self.skin.columns)
        m.d.comb += [
            rows.valid.eq(driven | rest),
            self.alone.eq(driven & (place == turn.y)),
            row.cells.eq(Mux(self.alone, cells, 0)),
            row.last.eq(place == self.skin.rows - 1),
        ]
        with m.If(rows.valid & rows.ready):
            m.d.sync += place.eq(Mux(row.last, 0, place + 1))
            with m.If(self.alone):
                m.d.sync += driven.eq(0)
            with m.If(row.last):
                m.d.sync += rest.eq(0)
        with m.If(turn.strobe):
            m.d.sync += [driven.eq(1), rest.eq(~turn.todo.any()), cells.eq(pressed)]
        with m.If(turn.begins & ~sheet.touched.any()):
            m.d.sync += rest.eq(1)

    def _watch_contact(self, m: Module, sheet: _Sheet, turn: _Turn, pressed: Value) -> None:
        seen = Signal()  # in this frame's rows so far
        with m.If(turn.begins):
            m.d.sync += seen.eq(0)
            with m.If(~sheet.touched.any()):
                m.d.sync += self.contact.eq(0)
        with m.If(turn.rests & turn.settled & sheet.clean):
            m.d.sync += self.contact.eq(1)
        with m.If(turn.strobe):
            m.d.sync += seen.eq(seen | pressed.any())
            with m.If(pressed.any()):
                m.d.sync += self.contact.eq(1)
            with m.Elif(~turn.todo.any() & ~seen):
                m.d.sync += self.contact.eq(0)

    def _tag_frame(self, m: Module, turn: _Turn) -> None:
        """A frame's tag is what there is when it begins."""
        per_us = self.derived.clocks_per_us
        prescaler, waiting = Signal(range(max(2, per_us))), Signal()
        m.d.sync += prescaler.eq(prescaler + 1)
        with m.If(prescaler == per_us - 1):
            m.d.sync += [prescaler.eq(0), self.time.eq(self.time + 1)]
        watch_epoch(m, self.time, self.epoch)
        with m.If(turn.begins):
            m.d.sync += [
                self.tag.time.eq(self.time),
                self.tag.requested.eq(waiting),
                self.tag.heard.eq(self.heard),
                waiting.eq(self.request),
            ]
        with m.Elif(self.request):
            m.d.sync += waiting.eq(1)
        m.d.comb += turn.wanted.eq(waiting | self.due if self.skin.send == "on_change" else 1)
        with m.If(turn.strobe):
            m.d.sync += self.sampled.eq(self.time)


def _lowest(bits: Value) -> Value:
    """Number of the lowest bit that is set; by halves."""
    if len(bits) <= 2:
        return ~bits[0]
    half = 1 << (len(bits) - 1).bit_length() - 1
    low, high = bits[:half], bits[half:]
    any_low = low.any()
    return Cat(Mux(any_low, _lowest(low), _lowest(high))[: (half - 1).bit_length()], ~any_low)
