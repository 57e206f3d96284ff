"""Self-test of a scan by line reversal: one line at a time is driven, and the lines that follow are found.

A slot begins with all lines at the selecting level. Then all are released, and at most one is driven to the released
level; pins oppose each other no longer. Current may flow from a column through pressed switches to rows, in the
direction of the diodes; no other line may follow.
"""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.payloads import slots_layout
from contactfpga_hdl.scan.guard import checked_rows
from contactfpga_hdl.scan.stuck import anywhere

SEEN = 2


class SelfTest(wiring.Component):
    """One slot without a driven line, one per row, and one per column, after power-up and after each command.

    A column that rises in slot 0 is ignored in other slots; a row that rises without a column is joined with the
    supply. Fully masked lines are not driven.

    command (in): pulse from which slots are sent; a test under way starts again after its slot.
    asks (out): a slot is wanted.
    begin (in): pulse when a slot begins; the scan drives nothing from the second clock after.
    ends (out): pulse in the last clock of a slot.
    rows, columns (in): lines that read released, from synchronizers; fully masked rows never do.
    discharges (out): in the next clock all lines are driven to the selecting level; from the third clock after
        ``begin`` for the projection time.
    alone (out): rows, then columns: the line driven to the released level in the next clock, after a gap of a clock,
        for the settle time.
    slots (out): readings of each slot after a command.
    joined (out): high from a slot in which a line follows another until a whole test finds none.
    """

    def __init__(self, skin: Skin):
        self.skin = skin
        self.derived = skin.derived
        super().__init__(
            {
                "command": In(1),
                "asks": Out(1, init=1),
                "begin": In(1),
                "ends": Out(1),
                "rows": In(skin.rows),
                "columns": In(skin.columns),
                "discharges": Out(1),
                "alone": Out(skin.rows + skin.columns),
                "slots": Out(stream.Signature(slots_layout(self.derived))),
                "joined": Out(1),
            }
        )

    def elaborate(self, platform):
        m = Module()
        lines = self.skin.rows + self.skin.columns
        number = Signal(range(lines + 2))  # of the slot; beyond the last there is none
        line = Signal(lines)  # that it drives
        m.d.comb += [line.eq((Const(1, 1) << number)[1 : lines + 1]), self.slots.payload.number.eq(number)]
        # Levels of a slot
        judges = self._drive(m, line)
        # Slots: one after another, and for a command also sent
        waits = self.slots.valid
        wanted = Signal()
        tells = Signal()  # slots go out
        over = Signal()
        starts = Signal()
        m.d.comb += [
            over.eq(Mux(tells, waits & self.slots.ready, judges)),
            starts.eq(wanted & (over | ~self.asks & ~waits)),
        ]
        with m.If(over):
            m.d.sync += [waits.eq(0), self.asks.eq(number != lines), number.eq(number + 1)]
        with m.If(judges & tells):
            m.d.sync += [waits.eq(1), self.asks.eq(0)]
        with m.If(starts):
            m.d.sync += [wanted.eq(0), tells.eq(1), self.asks.eq(1), number.eq(0)]
        with m.If(self.command):
            m.d.sync += wanted.eq(1)
        # Verdict: no other line may follow the driven one
        rows, columns = self.rows, self.columns & anywhere(self.skin)
        rises = Signal(len(line))  # in slot 0
        first, found, follows, bad = Signal(), Signal(), Signal(len(line)), Signal()
        of_row = line[: self.skin.rows].any()
        m.d.comb += [
            first.eq(number == 0),
            follows.eq(Cat(Mux(of_row, rows, 0), columns) & ~line & ~rises),
            bad.eq(Mux(first, rows.any() & ~columns.any(), follows.any())),
        ]
        with m.If(judges):
            m.d.sync += [
                self.slots.payload.rows.eq(rows),
                self.slots.payload.columns.eq(columns),
                found.eq(bad | found & ~first),
                self.joined.eq(bad | Mux(number == len(line), found, self.joined)),
            ]
            with m.If(first):
                m.d.sync += rises.eq(Cat(rows, columns))
        return m

    def _drive(self, m: Module, line: Value) -> Value:
        """Drive a line; returns a level that is high when the levels of a slot are available."""
        project, settle = self.derived.project_clocks, self.derived.settle_clocks
        clock = Signal(range(max(project, settle, SEEN + 1)))
        drives = Signal()
        judges = Signal()
        driven = checked_rows(self.skin) | anywhere(self.skin) << self.skin.rows
        m.d.sync += clock.eq(0)
        m.d.comb += [self.ends.eq(judges), self.alone.eq(Mux(drives, line & driven, 0))]
        with m.FSM(name="slot"):
            with m.State("REST"):
                with m.If(self.begin):
                    m.next = "GAP"
            with m.State("GAP"):
                m.next = "DISCHARGE"
            with m.State("DISCHARGE"):
                m.d.comb += self.discharges.eq(1)
                m.d.sync += clock.eq(clock + 1)
                with m.If(clock == project - 1):
                    m.d.sync += clock.eq(0)
                    m.next = "LET GO"
            with m.State("LET GO"):
                m.next = "DRIVE"
            with m.State("DRIVE"):
                m.d.comb += drives.eq(1)
                m.d.sync += clock.eq(clock + 1)
                with m.If(clock == settle - 1):
                    m.d.sync += clock.eq(0)
                    m.next = "SEE"
            with m.State("SEE"):
                m.d.sync += clock.eq(clock + 1)
                with m.If(clock == SEEN):
                    m.d.comb += judges.eq(1)
                    m.next = "REST"
        return judges

    def drives(self) -> tuple[Value, Value]:
        """Rows and columns driven in the next clock; a guard column is discharged by its switches."""
        rows, columns = self.skin.rows, self.skin.columns
        guard = 1 << rows if self.skin.guard else 0
        discharged = self.discharges.replicate(rows + 1) & (checked_rows(self.skin) | guard)
        return (
            (discharged | self.alone[:rows])[: self.skin.row_lines],
            self.discharges.replicate(columns) & anywhere(self.skin) | self.alone[rows:],
        )


def test_ports(derived: Derived) -> dict[str, wiring.Member]:
    """Ports of a scan with a self-test, as in :class:`SelfTest`."""
    return {"command": In(1), "slots": Out(stream.Signature(slots_layout(derived)))}
