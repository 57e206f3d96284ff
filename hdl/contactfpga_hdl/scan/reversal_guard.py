"""Line reversal with guard lines: the checks of rows and columns, one per frame and at rest one every 256 us.

Rows: the guard column alone is driven to the released level, all others to the selecting one, and each row that is
whole reads touched. Columns: the guard row alone is selected, and each column that is whole reads pressed.
"""

from amaranth.hdl import Cat, Const, Module, Signal, Value
from amaranth.lib import wiring

from contactfpga.skin.derived import Derived
from contactfpga_hdl.scan.guard import Told
from contactfpga_hdl.scan.precharge import Precharge
from contactfpga_hdl.scan.reversal_state import Sheet, Turn

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


def check_lines(
    m: Module, scan: wiring.Component, sheet: Sheet, turn: Turn, checks: Checks, precharge: Precharge
) -> None:
    """When a sheet at rest is checked, and what checks tell. A guard column that is stuck says nothing about rows."""
    skin = scan.skin
    m.submodules.told = told = Told(skin)
    m.d.sync += [
        checks.of_rows.eq(checks.of_rows ^ checks.starts),
        checks.asked.eq((checks.asked | turned(m, scan.time[CHECK_BIT])) & ~checks.starts),
    ]
    there, guard_reads = checks.checked[1], sheet.pressed[-1]
    m.d.comb += [
        checks.of_guard.eq(there & ~checks.of_rows),
        told.rows.eq(~sheet.read),
        told.checks_rows.eq((checks.of_guard & ~guard_reads & ~told.faults.stuck[-1]).replicate(skin.rows)),
        told.columns.eq(~sheet.pressed),
        told.checks_columns.eq(there & checks.of_rows),
        told.stuck.eq(precharge.held | Cat(Const(0, skin.columns), guard_reads)),
        told.checks_stuck.eq(checks.of_guard),
        told.round.eq(checks.of_guard),
        told.turn.eq(precharge.turn),
        scan.faults.eq(told.faults),
        scan.watched.eq(there & turn.rests),
    ]


def tag_faults(m: Module, scan: wiring.Component, turn: Turn) -> None:
    """What a frame tells of faults is what is told when its count of stuck columns is there."""
    at_begin, counted = Signal(), Signal(2)  # the last bit: that is so in the next clock
    if "faults" in scan.signature.members:
        m.d.sync += counted.eq(Cat(turn.begins, counted))
        with m.If(counted[1]):
            m.d.sync += at_begin.eq(scan.faults.as_value().any())
    m.d.comb += scan.tag.fault.eq(scan.tag.stuck.any() | at_begin)
