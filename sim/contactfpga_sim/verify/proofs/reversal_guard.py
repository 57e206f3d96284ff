"""Line reversal with guard lines."""

from functools import partial
from typing import Any

from amaranth.hdl import Const, Mux, Signal, Value

from contactfpga_hdl.scan.guard import LineFaults
from contactfpga_hdl.scan.reversal import ReversalScanner
from contactfpga_hdl.scan.reversal_cycle import ReversalCycle
from contactfpga_hdl.scan.reversal_guard import Checks
from contactfpga_sim.verify.proofs.case import Bug, ProofCase
from contactfpga_sim.verify.proofs.precharge import apart
from contactfpga_sim.verify.proofs.proof import Proof
from contactfpga_sim.verify.proofs.reversal import SHORT, Sheet, skin_of, synchronizer_lemmas

LISTEN, ANSWER, GAP, CHARGE, SELECT = range(5)  # in the order in which the source names them with guard lines


def _inverted(sheet: Sheet) -> Value:
    return sheet.dut.pins.columns_level != int(sheet.skin.selects_low)


def pins(proof: Proof, **changes: Any) -> None:
    """Free and claimed: as in :func:`contactfpga_sim.verify.proofs.reversal.pins`, the guard row included; but this row
    is held at the released level while the others are released together. Columns are driven to the selecting level only
    while rows are released."""
    sheet = Sheet(proof, skin_of(guard=True, **changes))
    drive, columns, every = sheet.dut.pins.rows_drive, sheet.dut.pins.columns_drive, (1 << sheet.skin.rows) - 1
    rows = drive[: sheet.skin.rows]
    apart(proof, columns, sheet.selected)
    proof.claim(sheet.selected & (sheet.selected - 1) == 0)
    proof.claim((rows == 0) | (rows == every))
    proof.claim((rows != 0) | (sheet.selected == 0))
    proof.claim(sheet.undriven_selected == 0)
    proof.claim((rows == 0) | ~_inverted(sheet))
    started = proof.before(1)
    proof.claim(drive[-1] == started)
    with proof.m.If(~started):
        proof.claim((drive == 0) & (columns == 0))
    pin_lemmas(sheet)


def pin_lemmas(sheet: Sheet) -> None:
    proof, state, clock, inside = sheet.proof, sheet.state, sheet.clock, sheet.inside
    derived, rows = sheet.dut.derived, sheet.skin.rows
    before, started = proof.before(state, init=LISTEN), proof.before(1)
    lets_go = (before == LISTEN) | (before == ANSWER)
    selects, of_guard = (state == SELECT) & (clock != 0), inside["cycle.selects"]
    row = (Const(1, rows) << inside["cycle.y"])[:rows]
    proof.lemma(state <= SELECT)
    proof.lemma(inside["cycle.selected"] == Mux(selects & ~of_guard, row, 0))
    proof.lemma(inside["cycle.guard"] == (selects & of_guard))
    proof.lemma((sheet.dut.pins.columns_drive == 0) | lets_go | (before == CHARGE))
    proof.lemma(sheet.dut.pins.rows_drive[:rows] == Mux(lets_go, 0, (1 << rows) - 1))
    proof.lemma(inside["inverted"] == (before == ANSWER))
    proof.lemma(inside["holds"] == started)
    proof.lemma((state != SELECT) | (before == Mux(clock == 0, GAP, SELECT)) & (clock <= derived.settle_clocks))
    proof.lemma((state != GAP) | (before == CHARGE) | (before == LISTEN) & of_guard & started)
    proof.lemma((state != ANSWER) | (before == LISTEN) | (before == SELECT) & (clock == 0) | (before == ANSWER))
    proof.lemma((state == LISTEN) | (state == ANSWER) | started)
    proof.lemma((state != ANSWER) | started)
    with proof.m.If((state == LISTEN) & (clock != 0)):
        proof.lemma((before == LISTEN) & started)


class Lines:
    """A whole row and a whole column, chosen by the solver: within the settle time they answer the guard lines. The
    guard column may be stuck, and then feeds no row."""

    def __init__(self, sheet: Sheet):
        proof, skin, settle = sheet.proof, sheet.skin, sheet.dut.derived.settle_clocks
        y, x = proof.chosen(range(skin.rows), "y"), proof.chosen(range(skin.columns), "x")
        proof.given((y < skin.rows) & (x < skin.columns))
        self.of_row = lambda rows: rows.bit_select(y, 1)
        self.of_column = lambda columns: columns.bit_select(x, 1)
        pins = sheet.dut.pins
        feeds = _inverted(sheet) & pins.columns_drive[-1] & (pins.rows_drive[: skin.rows] == 0)
        self.fed, self.pulled = Signal(range(settle + 1)), Signal(range(settle + 1))  # clocks before this one
        for count, now in ((self.fed, feeds), (self.pulled, sheet.selected[-1])):
            proof.m.d.sync += count.eq(Mux(now, Mux(count == settle, settle, count + 1), 0))
        proof.given(~(feeds & (self.fed >= settle - 1) & ~sheet.pressed[-1]) | self.of_row(sheet.read))
        proof.given(~(sheet.selected[-1] & (self.pulled >= settle - 1)) | self.of_column(sheet.pressed))


def whole(proof: Proof, **changes: Any) -> None:
    """Free: the later stages, and the sheet except one whole row and column, see ``Lines``.

    Claimed: these two are never reported as open. After a frame's last row there is a check before the next frame
    begins; checks of columns and rows alternate.
    """
    sheet = Sheet(proof, skin_of(guard=True, **changes))
    lines, inside, m = Lines(sheet), sheet.inside, proof.m
    faults = sheet.dut.faults
    proof.claim(~lines.of_row(faults.rows) & ~lines.of_column(faults.columns))
    owed, last = Signal(), Signal(init=1)  # a check, since a frame with a row began; the last one was of the rows
    checked, of_rows = inside["cycle.checks_due"], inside["checks.of_rows"]
    with m.If(sheet.begins & sheet.wanted.any()):
        m.d.sync += owed.eq(1)
    with m.If(checked[1]):
        m.d.sync += [owed.eq(0), last.eq(~of_rows)]
    proof.claim(~(sheet.begins & owed))
    proof.claim(~checked[1] | (last == of_rows))
    pin_lemmas(sheet)
    synchronizer_lemmas(sheet)
    _check_lemmas(sheet, lines, owed, last)


def silent(proof: Proof, **changes: Any) -> None:
    """Free: the sheet and the later stages.

    Claimed: a column that does not read pressed in the last clock in which the guard row is selected is reported three
    clocks later. So is a row that reads untouched in the last clock but one in which the guard column alone has the
    released level, unless the guard column reads pressed then or is reported. Each stays reported until a later check
    that renews. Three clocks after a frame began its flag is set if a line was reported a clock before.
    """
    sheet = Sheet(proof, skin_of(guard=True, **changes))
    faults, skin, begun = sheet.dut.faults, sheet.skin, proof.before(proof.before(sheet.begins))
    y, x = proof.chosen(range(skin.rows), "y"), proof.chosen(range(skin.columns), "x")
    proof.given((y < skin.rows) & (x < skin.columns))
    of_columns = proof.before(proof.before(sheet.selected[-1]) & ~sheet.selected[-1])  # and their sample is known
    of_rows = proof.before(_inverted(sheet)) & ~_inverted(sheet)
    guard = sheet.pressed_2[-1] | faults.stuck[-1]
    pressed, read = sheet.pressed_2.bit_select(x, 1), sheet.read_2.bit_select(y, 1)
    renews = sheet.inside["checks.line_faults.renewing"]
    for line, checked, answers in (
        (faults.columns.bit_select(x, 1), of_columns, pressed),
        (faults.rows.bit_select(y, 1), of_rows, read | guard),
    ):
        proof.claim(line | ~proof.before(checked & ~answers))
        proof.claim(line | ~proof.before(line) | proof.before(checked & renews))
    proof.claim(~proof.before(begun) | sheet.dut.tag.fault | ~proof.before(faults.as_value().any()))
    pin_lemmas(sheet)
    synchronizer_lemmas(sheet)
    _turn_lemmas(sheet)
    checked, alternate = sheet.inside["cycle.checks_due"], sheet.inside["checks.of_rows"]
    proof.lemma(of_columns == ((checked == 2) & alternate))
    proof.lemma(of_rows == ((checked == 2) & ~alternate))


def _turn_lemmas(sheet: Sheet) -> None:
    proof, state, clock, inside = sheet.proof, sheet.state, sheet.clock, sheet.inside
    settle, before = sheet.dut.derived.settle_clocks, proof.before(state, init=LISTEN)
    checks = max(settle, sheet.dut.derived.project_clocks)
    checked, of_rows, selects = inside["cycle.checks_due"], inside["checks.of_rows"], inside["cycle.selects"]
    proof.lemma((checked != 3) & ((checked == 0) | (state == LISTEN) & (clock == checked - 1)))
    proof.lemma((state != ANSWER) | ~of_rows & (clock <= checks) & ((clock <= checks - settle) | (before == ANSWER)))
    proof.lemma(~selects | of_rows & ((state == CHARGE) | (state == GAP) | (state == SELECT)))
    proof.lemma(~((state == LISTEN) | (state == ANSWER) | selects) | (inside["cycle.todo"] == 0))


def _check_lemmas(sheet: Sheet, lines: Lines, owed: Signal, last: Signal) -> None:
    proof, state, clock, inside, faults = sheet.proof, sheet.state, sheet.clock, sheet.inside, sheet.dut.faults
    derived, before = sheet.dut.derived, proof.before(state, init=LISTEN)
    settle, checks = derived.settle_clocks, max(derived.settle_clocks, derived.project_clocks)
    spared = checks - settle
    checked, of_rows, selects, blind = (
        inside["cycle.checks_due"],
        inside["checks.of_rows"],
        inside["cycle.selects"],
        faults.stuck[-1],
    )
    _turn_lemmas(sheet)
    proof.lemma(~inside["precharge.guard_stuck"] | blind)
    proof.lemma(~owed | (state != LISTEN) | (checked != 0))
    pending = (state == ANSWER) | selects | (checked != 0)
    proof.lemma(last == (of_rows ^ ~pending))
    proof.lemma((before != ANSWER) | blind | sheet.dut.pins.columns_drive[-1])
    with proof.m.If((state == ANSWER) & ~blind & (clock > spared)):
        proof.lemma(lines.fed >= clock - spared - 1)
    with proof.m.If((state == SELECT) & selects & (clock != 0)):
        proof.lemma(lines.pulled == clock - 1)
    for number, read, pressed in ((1, sheet.read_1, sheet.pressed_1), (2, sheet.read_2, sheet.pressed_2)):
        with proof.m.If(checked == number):
            proof.lemma(Mux(of_rows, lines.of_column(pressed), blind | pressed[-1] | lines.of_row(read)))


_PIN_BUGS = (
    Bug("the guard row with another one", ReversalCycle, "guard",
        lambda guard, inside: guard | (inside["cycle_state"] == SELECT)),
    Bug("the guard row while rows are let go", ReversalCycle, "guard",
        lambda guard, inside: guard | (inside["cycle_state"] == ANSWER)),
    Bug("the guard row is let go", ReversalScanner, "holds", lambda holds, inside: ~inside["listens"]),
    Bug("no gap before the guard row", ReversalCycle, "charges",
        lambda charges, inside: charges | (inside["cycle_state"] == GAP) & inside["selects"]),
    Bug("no gap after a row", ReversalCycle, "inverts",
        lambda inverts, inside: inverts | (inside["cycle_state"] == SELECT)),
    Bug("rows are held against the guard column", ReversalCycle, "listens",
        lambda listens, inside: listens & ~inside["inverts"]),
)  # fmt: skip
_WHOLE_BUGS = (
    Bug("the next frame without a check", ReversalCycle, "checks_due",
        lambda checked, inside: Mux(inside["cycle_state"] == SELECT, 0, checked)),
    Bug("rows are read too early", ReversalCycle, "clock",
        lambda clock, inside: clock + (inside["check_starts"] & inside["of_rows"])),
    Bug("reported by a stuck guard column", Checks, "checks_rows",
        lambda _, inside: inside["of_guard"].replicate(len(inside["checks_rows"]))),
    Bug("columns are reported by the rows' check", Checks, "checks_columns",
        lambda _, inside: inside["checked"]),
    Bug("rows only", Checks, "of_rows", lambda of_rows, inside: of_rows | inside["of_rows"]),
)  # fmt: skip
_SILENT_BUGS = (
    Bug("no row is reported", LineFaults, "faults.rows", lambda *_: 0),
    Bug("no column is reported", LineFaults, "faults.columns", lambda *_: 0),
    Bug("a row is reported once", LineFaults, "faults.rows", lambda rows, inside: rows & ~inside["faults.rows"]),
    Bug("columns are never checked", Checks, "checks_columns", lambda *_: 0),
    Bug("the flag does not say so", ReversalScanner, "at_begin", lambda *_: 0),
)  # fmt: skip
CASES = (
    ProofCase("pins never meet", "3x2, guard lines, col2row", partial(pins, rows=3, columns=2), 2, _PIN_BUGS, 40),
    ProofCase("pins never meet", "2x1, guard lines, row2col, shortest times",
              partial(pins, rows=2, columns=1, diodes="row2col", **SHORT), 2),
    ProofCase("whole lines are not reported", "3x2", partial(whole, rows=3, columns=2, project_us=5), 2),
    ProofCase("whole lines are not reported", "2x1, row2col, shortest times, debounced",
         partial(whole, rows=2, columns=1, diodes="row2col", debounce="sym_defer_pk", **SHORT), 2, _WHOLE_BUGS, 40),
    ProofCase("silent lines are reported", "3x2, reversal", partial(silent, rows=3, columns=2, project_us=5), 4,
              _SILENT_BUGS, 60),
    ProofCase("silent lines are reported", "2x1, reversal, row2col, shortest times",
              partial(silent, rows=2, columns=1, diodes="row2col", **SHORT), 4),
)  # fmt: skip
