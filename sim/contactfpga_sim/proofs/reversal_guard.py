"""Line reversal with guard lines: pins never meet, no line that is whole is told, and checks are made."""

from functools import partial
from typing import Any

from amaranth.hdl import Const, Mux, Signal, Value

from contactfpga_hdl.scan.reversal import ReversalScanner
from contactfpga_sim.proofs.bugs import Bug
from contactfpga_sim.proofs.case import Case
from contactfpga_sim.proofs.precharge import apart
from contactfpga_sim.proofs.proof import Proof
from contactfpga_sim.proofs.reversal import SHORT, Sheet, skin_of

LISTEN, ANSWER, GAP, CHARGE, SELECT = range(5)  # in the order in which the source names them where there are guard lines


def _inverted(sheet: Sheet) -> Value:
    """The pins drive columns to the selecting level, and the guard column to the released one."""
    return sheet.dut.pins.columns_level != int(sheet.skin.selects_low)


def pins(proof: Proof, **changes: Any) -> None:
    """Free: the sheet, and what the stages after do in each clock.

    Claimed: at most one row is selected, the guard row counted, and none while rows are let go; no column is driven then
    nor in the clock before or after; rows are let go together, but for the guard row, which is held at the released
    level. Columns are driven to the selecting level while rows are let go, only. In the first clock nothing is driven.
    """
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
    """What a state does to the sheet is seen a clock later."""
    proof, state, clock, inside, skin = sheet.proof, sheet.state, sheet.clock, sheet.inside, sheet.skin
    derived, rows = sheet.dut.derived, sheet.skin.rows
    before, started = proof.before(state, init=LISTEN), proof.before(1)
    lets_go = (before == LISTEN) | (before == ANSWER)
    selects, of_guard = (state == SELECT) & (clock != 0), inside["selects"]
    row = (Const(1, rows) << inside["y"])[:rows]
    proof.lemma(state <= SELECT)
    proof.lemma(inside["selected"] == Mux(selects & ~of_guard, row, 0))
    proof.lemma(inside["guard"] == (selects & of_guard))
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


_PIN_BUGS = (
    Bug("the guard row with another one", ReversalScanner, "guard",
        lambda guard, inside: guard | (inside["turn_state"] == SELECT)),
    Bug("the guard row while rows are let go", ReversalScanner, "guard",
        lambda guard, inside: guard | (inside["turn_state"] == ANSWER)),
    Bug("the guard row is let go", ReversalScanner, "holds", lambda holds, inside: ~inside["listens"]),
    Bug("no gap before the guard row", ReversalScanner, "charges",
        lambda charges, inside: charges | (inside["turn_state"] == GAP) & inside["selects"]),
    Bug("no gap after a row", ReversalScanner, "inverts",
        lambda inverts, inside: inverts | (inside["turn_state"] == SELECT)),
    Bug("rows are held against the guard column", ReversalScanner, "listens",
        lambda listens, inside: listens & ~inside["inverts"]),
)  # fmt: skip
CASES = (
    Case("pins never meet", "3x2, guard lines, col2row", partial(pins, rows=3, columns=2), 2, _PIN_BUGS, 40),
    Case("pins never meet", "2x1, guard lines, row2col, shortest times",
         partial(pins, rows=2, columns=1, diodes="row2col", **SHORT), 2),
)  # fmt: skip
