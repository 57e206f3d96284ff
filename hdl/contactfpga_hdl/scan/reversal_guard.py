"""Line reversal with guard lines: checks of rows and columns in turn, one per frame, or at rest every 256 us.

Rows: only the guard column is driven to the released level, and each whole row reads touched. Columns: only the guard
row is selected, and each whole column reads pressed.
"""

from amaranth.hdl import Cat, Const, Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga_hdl.payloads import faults_layout
from contactfpga_hdl.scan.guard import LineFaults

CHECK_BIT = 8
"""Bit of the us clock whose toggles start a check of a resting sheet."""


class Checks(wiring.Component):
    """The next check, and the results of checks. A stuck guard column prevents conclusions about rows.

    due (in): pulse when a resting sheet is to be checked.
    asked (out): such a check is wanted, until a check starts.
    starts, checked (in): pulses when a check starts, and when its sample is available.
    of_rows (out): the next check is of the rows.
    of_guard (out): pulse when the sample of the rows, and of the guard column, is available.
    rows, columns (in): rows that read touched, columns that read pressed.
    held (in): stuck columns.
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
        m.submodules.line_faults = line_faults = LineFaults(skin)
        # Turns
        m.d.sync += [
            self.of_rows.eq(self.of_rows ^ self.starts),
            self.asked.eq((self.asked | self.due) & ~self.starts),
        ]
        # Results
        m.d.comb += [
            self.of_guard.eq(self.checked & ~self.of_rows),
            line_faults.rows.eq(~self.rows),
            line_faults.checks_rows.eq(
                (self.of_guard & ~guard_reads & ~line_faults.faults.stuck[-1]).replicate(skin.rows)
            ),
            line_faults.columns.eq(~self.columns),
            line_faults.checks_columns.eq(self.checked & self.of_rows),
            line_faults.stuck.eq(self.held | Cat(Const(0, skin.columns), guard_reads)),
            line_faults.checks_stuck.eq(self.of_guard),
            line_faults.round.eq(self.of_guard),
            line_faults.retry.eq(self.retry),
            self.faults.eq(line_faults.faults),
        ]
        return m
