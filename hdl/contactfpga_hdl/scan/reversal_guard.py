"""Line reversal with guard lines: the checks of rows and columns, one per frame and at rest one every 256 us.

Rows: the guard column alone is driven to the released level, all others to the selecting one, and each row that is whole
reads touched. Columns: the guard row alone is selected, and each column that is whole reads pressed.
"""

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib import wiring

from contactfpga.skin.derived import Derived
from contactfpga_hdl.scan.precharge import RETRY_BIT
from contactfpga_hdl.scan.reversal_state import Sheet, Turn
from contactfpga_hdl.scan.stuck import anywhere, present

CHECK_BIT = 8
"""Of the clock in us: when this bit turns, a sheet at rest is checked."""


class Checks:
    """Which check is made when."""

    def __init__(self, derived: Derived):
        self.clocks = max(derived.project_clocks, derived.settle_clocks)  # a check of the rows after a frame
        self.spared = self.clocks - derived.settle_clocks  # at rest: rows need not fall first
        self.asked = Signal()  # at rest one is wanted
        self.starts = Signal()  # high for a clock
        self.of_rows = Signal()  # the next one is
        self.selects = Signal()  # the guard row is driven next, or is
        self.checked = Signal(2)  # a sample on its way through the synchronizer
        self.of_guard = Signal()  # high for a clock: the sample of the rows is there

    def begin(self, m: Module) -> None:
        """In this clock; ``of_rows`` says which."""
        m.d.comb += self.starts.eq(1)
        m.d.sync += self.selects.eq(~self.of_rows)


def turned(m: Module, bit: Value) -> Signal:
    """High for a clock when a bit of the clock in us has turned."""
    before, turns = Signal(), Signal()
    m.d.sync += before.eq(bit)
    m.d.comb += turns.eq(before ^ bit)
    return turns


def check_lines(m: Module, scan: wiring.Component, sheet: Sheet, turn: Turn, checks: Checks, held: Value) -> None:
    """When checks are made, and what they tell: a fault is told from the check that finds it until one does not in the
    round after bit ``RETRY_BIT`` of the clock turned."""
    skin = scan.skin
    m.d.sync += [
        checks.checked.eq(checks.checked << 1),
        checks.of_rows.eq(checks.of_rows ^ checks.starts),
        checks.asked.eq((checks.asked | turned(m, scan.time[CHECK_BIT])) & ~checks.starts),
    ]
    there = checks.checked[1]
    read_rows, read_columns = Signal(), Signal()
    blind = scan.faults.stuck[-1] | sheet.pressed[-1]  # the guard column cannot be driven
    m.d.comb += [
        checks.of_guard.eq(there & ~checks.of_rows),
        read_rows.eq(checks.of_guard & ~blind),
        read_columns.eq(there & checks.of_rows),
    ]
    retried, renews_rows, renews_columns = Signal(), Signal(), Signal()
    m.d.sync += [
        retried.eq(turned(m, scan.time[RETRY_BIT]) | retried & ~turn.released),
        renews_rows.eq(renews_rows & ~read_rows | retried & turn.released),
        renews_columns.eq(renews_columns & ~read_columns | retried & turn.released),
    ]
    rows = sum(1 << row for row in range(skin.rows) if present(skin, row))
    told = scan.faults
    columns = sheet.pressed[: skin.columns]
    stuck = held | Cat(columns & 0, checks.of_guard & sheet.pressed[-1])
    _tell(m, told.rows, read_rows, ~sheet.read & rows, renews_rows)
    _tell(m, told.columns, read_columns, ~columns & anywhere(skin), renews_columns)
    m.d.sync += told.stuck.eq(stuck | Mux(checks.of_guard & renews_rows, 0, told.stuck))


def _tell(m: Module, told: Value, read: Value, found: Value, renews: Value) -> None:
    m.d.sync += told.eq(Mux(read, found, 0) | Mux(read & renews, 0, told))
