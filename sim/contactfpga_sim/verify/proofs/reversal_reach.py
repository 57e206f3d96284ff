"""Line reversal misses no switch that stays closed."""

from functools import partial
from typing import Any

from amaranth.hdl import Const, Mux, Signal

from contactfpga_hdl.scan.reversal import ReversalScanner
from contactfpga_hdl.scan.reversal_cycle import ReversalCycle
from contactfpga_sim.verify.proofs.case import Bug, ProofCase
from contactfpga_sim.verify.proofs.proof import Proof
from contactfpga_sim.verify.proofs.reversal import CHARGE, LISTEN, SELECT, Sheet, skin_of
from contactfpga_sim.verify.proofs.reversal_frames import Frames, keep_frames, waits_to_be_taken


class Switch:
    """One unmasked switch, chosen by the solver, which closes and opens freely.

    While closed, a driven column, which reads released, is read by its row if rows are released; a selected row by its
    column.
    """

    def __init__(self, sheet: Sheet):
        proof, skin = sheet.proof, sheet.skin
        y, self.x = proof.chosen(range(skin.rows), "y"), proof.chosen(range(skin.columns), "x")
        proof.given((y < skin.rows) & (self.x < skin.columns))
        for row, column in skin.mask:
            proof.given((y != row) | (self.x != column))
        self.row = Signal(skin.rows)
        proof.m.d.comb += self.row.eq(Const(1, skin.rows) << y)
        self.closed = proof.free(1, "closed")
        self.closed_1 = proof.before(self.closed)
        self.closed_2 = proof.before(self.closed_1)
        driven, pressed = self.of_column(sheet.dut.pins.columns_drive), self.of_column(sheet.pressed)
        let_go = ~sheet.dut.pins.rows_drive.any()
        proof.given(~(self.closed & driven & let_go) | (sheet.read & self.row).any())
        proof.given(~(self.closed & (sheet.selected & self.row).any()) | pressed)
        proof.given(~(driven & pressed))

    def of_column(self, columns):
        return columns.bit_select(self.x, 1)


class Report:
    """Whether the switch should be in the frame, and whether it was."""

    def __init__(self, sheet: Sheet, spec: Frames, switch: Switch):
        m, rows = sheet.proof.m, sheet.skin.rows
        self.unread = Signal(rows)  # rows of the frame that were not sampled yet
        self.due = Signal()  # the switch was closed from two clocks before the frame until now, or its row's sample
        self.reported = Signal()
        left = self.unread & ~Mux(spec.ended, sheet.proof.before(sheet.selected), 0)
        with m.If(sheet.begins):
            since = switch.closed & switch.closed_1 & switch.closed_2
            m.d.sync += [self.unread.eq(sheet.wanted), self.due.eq(since), self.reported.eq(0)]
        with m.Else():
            stays = switch.closed | (left & switch.row == 0)
            m.d.sync += [self.unread.eq(left), self.due.eq(self.due & stays)]
        self.row_offered = sheet.dut.rows.valid & sheet.dut.alone & (spec.lowest == switch.row)
        self.offered = self.row_offered & switch.of_column(sheet.dut.rows.payload.cells)
        with m.If(spec.taken & self.offered):
            m.d.sync += self.reported.eq(1)


def closed(proof: Proof, **changes: Any) -> None:
    """Free: one switch, and all other pin readings; when rows are taken. Assumed: no frame is packed before its last
    row is taken.

    Claimed: its row is in a frame if it is closed two clocks before the frame begins; and so is its cell, if it stays
    closed until its row is sampled.
    """
    sheet = Sheet(proof, skin_of(**changes))
    spec, switch = Frames(sheet), Switch(sheet)
    report = Report(sheet, spec, switch)
    proof.claim(~(sheet.begins & switch.closed_2) | (sheet.wanted & switch.row).any())
    proof.claim(~(report.row_offered & report.due) | report.offered)
    proof.claim(~(spec.taken & sheet.dut.rows.payload.last & report.due) | report.reported | report.offered)
    keep_frames(sheet, spec)
    closed_lemmas(sheet, spec, switch, report)


def closed_lemmas(sheet: Sheet, spec: Frames, switch: Switch, report: Report) -> None:
    proof, inside, state, due = sheet.proof, sheet.inside, sheet.state, sheet.inside["cycle.due"]
    before, row = proof.before(state, init=LISTEN), switch.row
    driven = switch.of_column(sheet.dut.pins.columns_drive)
    now = (Const(1, sheet.skin.rows) << inside["cycle.y"])[: sheet.skin.rows]  # row of this slot, or of the last one
    proof.lemma(~switch.of_column(inside["precharge.stuck"]))
    proof.lemma(driven == (proof.before(1) & ((before == LISTEN) | (before == CHARGE))))
    proof.lemma(report.unread == inside["cycle.todo"] | Mux((state == SELECT) | (due == 1), now, 0))
    pressed_1, pressed_2 = switch.of_column(sheet.pressed_1), switch.of_column(sheet.pressed_2)
    with proof.m.If(state == LISTEN):
        proof.lemma((sheet.clock < 2) | (~switch.closed_1 | (sheet.read_1 & row).any()) & ~pressed_1)
        proof.lemma((sheet.clock < 3) | (~switch.closed_2 | (sheet.read_2 & row).any()) & ~pressed_2)
    proof.lemma(~(spec.underway & report.due) | report.reported | (spec.left & row).any())
    with proof.m.If(report.due & (now == row)):
        proof.lemma((due != 1) | pressed_1)
        proof.lemma(~((due == 2) | waits_to_be_taken(sheet)) | switch.of_column(spec.sample))


_CLOSED_BUGS = (
    Bug("rows are read too early", ReversalCycle, "settled", lambda settled, inside: inside["clock"] >= 2),
    Bug("a row is left out", ReversalCycle, "todo",
        lambda rows, inside: Mux(inside["begins"], rows & (rows - 1), rows)),
    Bug("a touch is overlooked", ReversalScanner, "touched",
        lambda rows, inside: Mux(inside["rests"], rows, rows & (rows - 1))),
    Bug("columns are driven less", ReversalCycle, "charges", lambda charges, inside: charges & (inside["clock"] > 2)),
    Bug("selected for a clock less", ReversalCycle, "selected",
        lambda rows, inside: Mux(inside["clock"] == inside.component.derived.settle_clocks - 1, 0, rows)),
)  # fmt: skip
CASES = (
    ProofCase("a closed switch is reported", "3x2, col2row",
              partial(closed, rows=3, columns=2, diodes="col2row", mask=((1, 0),), project_us=1), 2, _CLOSED_BUGS, 24),
    ProofCase("a closed switch is reported", "3x2, row2col, debounced",
              partial(closed, rows=3, columns=2, diodes="row2col", debounce="sym_defer_pk"), 2),
    ProofCase("a closed switch is reported", "2x3, cells", partial(closed, rows=2, columns=3, report="cells"), 2),
    ProofCase("a closed switch is reported", "8x4", partial(closed, rows=8, columns=4), 2),
)  # fmt: skip
