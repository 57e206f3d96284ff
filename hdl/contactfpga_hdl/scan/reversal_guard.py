"""Line reversal with guard lines: the checks of rows and columns, one per frame and at rest one every 256 us.

Rows: the guard column alone is driven to the released level, all others to the selecting one, and each row that is
whole reads touched. Columns: the guard row alone is selected, and each column that is whole reads pressed.
"""

from amaranth.hdl import Cat, Const, Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga_hdl.payloads import faults_layout
from contactfpga_hdl.scan.guard import LineFaults

CHECK_BIT = 8
"""Bit of the clock in us: each time it toggles, a sheet at rest is checked."""


class Checks(wiring.Component):
    """Which check is made next, and what checks tell. A guard column that is stuck says nothing about rows.

    due (in): high for a clock: a sheet at rest is to be checked. asked (out): it is, until a check starts.
    starts, checked (in): high for a clock when a check does, and when its sample is there.
    of_rows (out): the next check is one of the rows.
    of_guard (out): high for a clock: the sample of the rows is there, and of the guard column.
    rows, columns (in): rows that read touched, columns that read pressed; held (in): columns that are stuck.
    retry (in): bit ``RETRY_BIT`` of the clock in us.
    faults (out): see :class:`~contactfpga_hdl.scan.guard.LineFaults`.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        super().__init__(
            {
                **dict.fromkeys(("due", "starts", "checked", "retry"), In(1)),
                "rows": In(skin.rows),
                "columns": In(skin.column_lines),
                "held": In(skin.column_lines),
                **dict.fromkeys(("asked", "of_rows", "of_guard"), Out(1)),
                "faults": Out(faults_layout(skin.derived)),
            }
        )

    def elaborate(self, platform):
        m = Module()
        skin, guard_reads = self.skin, self.columns[-1]
        m.submodules.told = told = LineFaults(skin)
        m.d.sync += [
            self.of_rows.eq(self.of_rows ^ self.starts),
            self.asked.eq((self.asked | self.due) & ~self.starts),
        ]
        m.d.comb += [
            self.of_guard.eq(self.checked & ~self.of_rows),
            told.rows.eq(~self.rows),
            told.checks_rows.eq((self.of_guard & ~guard_reads & ~told.faults.stuck[-1]).replicate(skin.rows)),
            told.columns.eq(~self.columns),
            told.checks_columns.eq(self.checked & self.of_rows),
            told.stuck.eq(self.held | Cat(Const(0, skin.columns), guard_reads)),
            told.checks_stuck.eq(self.of_guard),
            told.round.eq(self.of_guard),
            told.retry.eq(self.retry),
            self.faults.eq(told.faults),
        ]
        return m
