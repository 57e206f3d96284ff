"""Faulty lines, from checks of guard lines and released columns.

Guard switches are always closed, so a whole row reaches the guard column, and a whole column the guard row.
"""

from amaranth.hdl import Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga_hdl.payloads import faults_layout
from contactfpga_hdl.scan.stuck import anywhere, present, watched


def checked_rows(skin: Skin) -> int:
    """Rows, as bits, that are not fully masked."""
    return sum(1 << row for row in range(skin.rows) if present(skin, row))


class LineFaults(wiring.Component):
    """Holds reported lines. A faulty line is reported from the next clock until a check in the first whole round after
    ``retry`` toggles finds it good, so an intermittent fault changes the report at most twice per toggle. Fully masked
    lines are not reported.

    rows, columns, stuck (in): lines that a check finds faulty in this clock.
    checks_rows, checks_columns, checks_stuck (in): lines checked in this clock; columns all or none.
    round (in): pulse as a round of checks ends, with its last check or later.
    retry (in): bit ``RETRY_BIT`` of a clock in us.
    faults (out): reported lines.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self._layout = faults_layout(skin.derived)
        super().__init__(
            {
                "rows": In(skin.rows),
                "columns": In(skin.columns),
                "stuck": In(skin.column_lines),
                "checks_rows": In(skin.rows),
                "checks_columns": In(1),
                "checks_stuck": In(1),
                "round": In(1),
                "retry": In(1),
                "faults": Out(self._layout),
            }
        )

    def elaborate(self, platform):
        m = Module()
        skin, faults = self.skin, self.faults
        # Rounds that renew
        before, toggled, renewing = Signal(), Signal(), Signal()
        toggles = self.retry ^ before
        m.d.sync += before.eq(self.retry)
        with m.If(self.round):
            m.d.sync += [renewing.eq(toggled | toggles), toggled.eq(0)]
        with m.Elif(toggles):
            m.d.sync += toggled.eq(1)
        # Reported lines
        kept = ~Mux(renewing, self.checks_rows, 0)
        found = self.rows & self.checks_rows & checked_rows(skin)
        m.d.sync += faults.rows.eq(faults.rows & kept | found)
        with m.If(self.checks_columns):
            m.d.sync += faults.columns.eq(self.columns & anywhere(skin) | Mux(renewing, 0, faults.columns))
        with m.If(self.checks_stuck):
            m.d.sync += faults.stuck.eq(self.stuck & watched(skin) | Mux(renewing, 0, faults.stuck))
        return m
