"""Line reversal: who has the sheet when. What a state does to the sheet is seen at the pins a clock later."""

from amaranth.hdl import Const, Module, Mux, Signal
from amaranth.lib import wiring

from contactfpga_hdl.scan.pins import moves_sample
from contactfpga_hdl.scan.reversal_guard import Checks
from contactfpga_hdl.scan.reversal_state import Sheet, Turn
from contactfpga_hdl.scan.sample_at import SampleAt
from contactfpga_hdl.util.bits import lowest

SYNCHRONIZED = 3
"""Clocks that a touch has been there when its row reads touched in a synchronizer's output, that clock included."""


class _Time:
    """How long a state has lasted, and how long each does."""

    def __init__(self, scan: wiring.Component):
        derived = scan.derived
        self.settle = settle = derived.settle_clocks
        self.charge = charge = derived.release_clocks - 2
        self.listened = derived.project_clocks + SYNCHRONIZED  # columns are driven as a frame begins, and a clock more
        self.charged = min(charge - 1, charge - derived.precharge_clocks + self.listened)  # of a charge, by then
        self.clock = Signal(range(max(self.listened, settle + 1, charge)))
        self.due = Signal(2)  # a sample on its way through the synchronizer


def take_turns(m: Module, scan: wiring.Component, sheet: Sheet, turn: Turn, checks: Checks) -> None:
    """Listen; then charge, gap and select per row; with ``guard`` also answer, with ``self_test`` test."""
    time = _Time(scan)
    m.d.comb += [
        turn.following.eq(lowest(turn.todo)[: len(turn.y)]),
        turn.strobe.eq(time.due[-1]),
        turn.waits.eq(time.due.any() | scan.rows.valid),
    ]
    m.d.sync += [
        time.clock.eq(time.clock + 1),
        time.due.eq(time.due << 1),
        checks.checked.eq(checks.checked << 1),
        turn.underway.eq((turn.underway | turn.begins) & ~scan.packed),
        turn.todo.eq(Mux(turn.begins, sheet.touched, turn.todo & ~sheet.selected)),
        sheet.selected.eq(0),
        sheet.guard.eq(0),
    ]
    moves = moves_sample(scan.derived)
    moved = SampleAt(m, scan.derived, scan.moves, scan.clocks, turn.begins) if moves else None
    with m.FSM(name="turn"):
        with m.State("LISTEN"):
            _listen(m, scan, sheet, turn, checks, time)
        with m.State("CHARGE"):
            m.d.comb += sheet.charges.eq(1)
            with m.If(time.clock == time.charge - 1):
                m.d.sync += time.clock.eq(time.clock)
                with m.If(~turn.waits | checks.selects):
                    m.next = "GAP"
        with m.State("GAP"):
            m.d.sync += time.clock.eq(0)
            with m.If(~checks.selects):
                m.d.sync += turn.y.eq(turn.following)
            m.next = "SELECT"
        with m.State("SELECT"):
            _select(m, scan, sheet, turn, checks, time, moved)
        if scan.skin.guard:
            with m.State("ANSWER"):
                m.d.comb += [sheet.charges.eq(1), sheet.listens.eq(1), sheet.inverts.eq(1)]
                with m.If(time.clock == checks.clocks):
                    m.d.sync += [time.clock.eq(0), checks.checked[0].eq(1)]
                    m.next = "LISTEN"
        if scan.skin.self_test:
            with m.State("TEST"):
                m.d.comb += [sheet.listens.eq(1), turn.tests.eq(1)]
                with m.If(turn.tested):
                    m.d.sync += time.clock.eq(0)
                    m.next = "LISTEN"


def _listen(m: Module, scan: wiring.Component, sheet: Sheet, turn: Turn, checks: Checks, time: _Time) -> None:
    touched = sheet.touched.any()
    m.d.comb += [
        sheet.charges.eq(1),
        sheet.listens.eq(1),
        turn.settled.eq(time.clock == time.listened - 1),
    ]
    with m.If(turn.settled):
        m.d.sync += time.clock.eq(time.clock)
        with m.If(turn.rests & touched):  # others may be about to be
            m.d.sync += [turn.rests.eq(0), time.clock.eq(SYNCHRONIZED)]
        if scan.skin.self_test:
            with m.Elif(turn.asked & ~turn.underway):
                m.d.comb += turn.lets_go.eq(1)
                m.next = "TEST"
        if scan.skin.guard:
            with m.Elif(turn.rests & checks.asked):
                m.d.sync += time.clock.eq(checks.spared)
                _check(m, checks, columns_from="GAP")
        with m.Elif(~turn.underway & (~turn.rests | turn.wanted)):
            m.d.comb += turn.begins.eq(1)
            m.d.sync += turn.rests.eq(~touched)
            with m.If(touched):
                m.d.sync += time.clock.eq(time.charged)
                m.next = "CHARGE"


def _select(
    m: Module,
    scan: wiring.Component,
    sheet: Sheet,
    turn: Turn,
    checks: Checks,
    time: _Time,
    moved: SampleAt | None,
) -> None:
    m.d.sync += [
        sheet.selected.eq(Mux(checks.selects, 0, Const(1, scan.skin.rows) << turn.y)),
        sheet.guard.eq(checks.selects),
    ]
    with m.If(time.clock == (time.settle if moved is None else moved.clock)):
        m.d.sync += time.due[0].eq(~checks.selects)
    with m.If(time.clock == time.settle):
        m.d.sync += [sheet.selected.eq(0), sheet.guard.eq(0), time.clock.eq(0)]
        m.d.sync += checks.checked[0].eq(checks.selects)
        with m.If(turn.todo.any()):
            m.next = "CHARGE"
        with m.Else():
            m.next = "LISTEN"
            if scan.skin.guard:
                m.d.sync += checks.selects.eq(0)
                with m.If(~checks.selects):
                    _check(m, checks, columns_from="CHARGE")


def _check(m: Module, checks: Checks, columns_from: str) -> None:
    """The next check begins; one of columns in a state of its choice."""
    checks.begin(m)
    with m.If(checks.of_rows):
        m.next = "ANSWER"
    with m.Else():
        m.next = columns_from
