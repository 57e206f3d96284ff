"""Frames of a line reversal."""

from collections.abc import Callable
from functools import partial
from typing import Any

from amaranth.hdl import Const, Mux, Signal, Value

from contactfpga_hdl.scan.reversal_cycle import ReversalCycle
from contactfpga_hdl.scan.reversal_rows import AllRows, DrivenRows
from contactfpga_hdl.scan.stuck import present
from contactfpga_sim.verify.proofs.case import Bug, ProofCase
from contactfpga_sim.verify.proofs.proof import Proof
from contactfpga_sim.verify.proofs.reversal import GAP, LISTEN, SELECT, Sheet, pin_lemmas, skin_of, synchronizer_lemmas
from contactfpga_sim.verify.proofs.streams import offers_stay

Say = Callable[[Value], None]


class Frames:
    """The expected rows, counted independently."""

    def __init__(self, sheet: Sheet):
        proof, dut, skin = sheet.proof, sheet.dut, sheet.skin
        m = proof.m
        self.left = Signal(skin.rows)  # rows of the frame that were not taken yet
        self.underway, self.packing = Signal(), Signal()  # its last row is to be taken; it is to be packed
        self.place = Signal(range(skin.rows + 1))  # of the row after the one that was taken last
        self.gap = Signal()  # an empty row comes next
        before = proof.before(sheet.selected)
        self.ended = Signal()  # the row that was selected a clock before is released
        m.d.comb += self.ended.eq((before != 0) & (sheet.selected == 0))
        self.sample, self.sampled = Signal(skin.columns), Signal(skin.rows)
        with m.If(self.ended):
            m.d.sync += [self.sample.eq(sheet.pressed_1), self.sampled.eq(before)]
        self.taken = dut.rows.valid & dut.rows.ready
        self.lowest = (self.left & -self.left)[: skin.rows]
        with m.If(self.taken & dut.rows.payload.last):
            m.d.sync += [self.underway.eq(0), self.packing.eq(1)]
        with m.If(sheet.packed):
            m.d.sync += self.packing.eq(0)
        with m.If(sheet.begins):
            m.d.sync += [self.left.eq(sheet.wanted), self.underway.eq(1), self.gap.eq(0)]
        with m.If(self.taken & dut.alone):
            m.d.sync += self.left.eq(self.left & ~self.lowest)
        self._go_on(sheet)
        proof.given(~sheet.packed | self.packing)

    def _go_on(self, sheet: Sheet) -> None:
        m, dut = sheet.proof.m, sheet.dut
        if not dut.derived.skips:
            with m.If(self.taken):
                m.d.sync += self.place.eq(Mux(dut.rows.payload.last, 0, self.place + 1))
            return
        others = self.left & ~self.lowest
        with m.If(self.taken):
            m.d.sync += self.gap.eq(dut.alone & (others != 0) & ((others & (self.lowest << 1)) == 0))
            m.d.sync += self.place.eq(dut.rows.payload.y + 1)

    def masked(self, sheet: Sheet) -> Value:
        cells = Signal(sheet.skin.columns)
        m = sheet.proof.m
        for row in range(sheet.skin.rows):
            with m.If(self.sampled[row]):
                m.d.comb += cells.eq(self.sample & present(sheet.skin, row))
        return cells


def frames(proof: Proof, **changes: Any) -> None:
    """Free: the sheet, and when rows are taken. Assumed: no frame is packed before its last row is taken.

    Claimed: a frame begins when the one before is packed. Its rows are those that read touched then, or are busy. They
    are selected in ascending order, none while a row is offered. Each is offered once, as its columns were in the last
    clock of its selection, without masked ones, until it is taken. Only the last row is marked as such.
    """
    sheet = Sheet(proof, skin_of(**changes))
    spec = Frames(sheet)
    offers_stay(proof, sheet.dut.rows)
    _say(sheet, spec, proof.claim)
    _frame_lemmas(sheet, spec)


def keep_frames(sheet: Sheet, spec: Frames) -> None:
    """The claims of :func:`frames` as lemmas for others."""
    _say(sheet, spec, sheet.proof.lemma)
    _frame_lemmas(sheet, spec)


def waits_to_be_taken(sheet: Sheet) -> Value:
    """Whether a selected row was sampled and is not yet taken."""
    if sheet.dut.derived.skips:
        return sheet.dut.rows.valid & sheet.dut.alone
    return sheet.inside["offer.driven"]


def _say(sheet: Sheet, spec: Frames, say: Say) -> None:
    _say_of_frames(sheet, spec, say)
    if sheet.dut.derived.skips:
        _say_of_driven_rows(sheet, spec, say)
    else:
        _say_of_all_rows(sheet, spec, say)


def _say_of_frames(sheet: Sheet, spec: Frames, say: Say) -> None:
    proof, dut = sheet.proof, sheet.dut
    say(~sheet.begins | ~(spec.underway | spec.packing))
    say(~(dut.rows.valid & (sheet.selected != 0)))
    say((sheet.selected == 0) | (sheet.selected == spec.lowest))
    with proof.m.If(dut.rows.valid):
        say(spec.underway)
        with proof.m.If(dut.alone):
            say((spec.left != 0) & (spec.sampled == spec.lowest))
            say(dut.rows.payload.cells == spec.masked(sheet))
        with proof.m.Else():
            say(dut.rows.payload.cells == 0)


def _say_of_driven_rows(sheet: Sheet, spec: Frames, say: Say) -> None:
    proof, row = sheet.proof, sheet.dut.rows.payload
    here = (Const(1, sheet.skin.rows + 1) << row.y)[: sheet.skin.rows + 1]
    with proof.m.If(sheet.dut.rows.valid & sheet.dut.alone):
        say(~spec.gap & (here == spec.lowest) & (row.last == (spec.left == spec.lowest)))
    with proof.m.Elif(sheet.dut.rows.valid):
        say(spec.gap == (spec.left != 0))
        say((row.last == ~spec.gap) & (~spec.gap | (row.y == spec.place)))


def _say_of_all_rows(sheet: Sheet, spec: Frames, say: Say) -> None:
    proof, row = sheet.proof, sheet.dut.rows.payload
    with proof.m.If(sheet.dut.rows.valid):
        say(row.last == (spec.place == sheet.skin.rows - 1))
        say(sheet.dut.alone == (spec.left & (Const(1, sheet.skin.rows) << spec.place) != 0))


def _frame_lemmas(sheet: Sheet, spec: Frames) -> None:
    proof, dut, inside, skin = sheet.proof, sheet.dut, sheet.inside, sheet.skin
    state, clock, due, todo, y = sheet.state, sheet.clock, inside["cycle.due"], inside["cycle.todo"], inside["cycle.y"]
    valid = dut.rows.valid
    row = Signal(skin.rows)  # that of the last slot
    proof.m.d.comb += row.eq((Const(1, skin.rows) << y)[: skin.rows])
    above = ~(row | row - 1)[: skin.rows]
    pin_lemmas(sheet)
    selects = state == SELECT
    fresh = selects & (clock <= 1)  # the row is still to be struck off
    unread = waits_to_be_taken(sheet)
    open_row = selects & ~fresh | (due != 0) | unread
    synchronizer_lemmas(sheet)
    proof.lemma(y < skin.rows)
    proof.lemma(spec.left == todo | Mux(open_row, row, 0))
    proof.lemma(spec.underway == ((state != LISTEN) | (due != 0) | valid))
    proof.lemma(inside["cycle.underway"] == (spec.underway | spec.packing))
    proof.lemma(~(spec.underway & spec.packing))
    proof.lemma(((state == LISTEN) == (todo == 0)) | selects)
    with proof.m.If(fresh):
        proof.lemma(row == (todo & -todo)[: skin.rows])
    with proof.m.If(open_row):
        proof.lemma((todo & ~above == 0) & (row != 0))
    with proof.m.If((state == GAP) | selects):
        proof.lemma(~valid & (due == 0))
    with proof.m.If(due == 1):
        proof.lemma((proof.before(sheet.selected) == row) & (sheet.selected == 0))
    with proof.m.If(due != 1):
        proof.lemma(~spec.ended)
    with proof.m.If((due == 2) | unread):
        proof.lemma(spec.sampled == row)
    proof.lemma((due != 2) | (spec.sample == sheet.pressed_2))
    proof.lemma((due == 0) | ~valid)
    if dut.derived.skips:
        _driven_rows_lemmas(sheet, spec, row, above)
    else:
        _all_rows_lemmas(sheet, spec, row, above)


def _driven_rows_lemmas(sheet: Sheet, spec: Frames, row: Value, above: Value) -> None:
    proof, dut, inside = sheet.proof, sheet.dut, sheet.inside
    valid, alone, last, cells = dut.rows.valid, dut.alone, dut.rows.payload.last, dut.rows.payload.cells
    todo, follows, y = inside["cycle.todo"], inside["offer.follows"], inside["cycle.y"]
    proof.lemma(alone | valid)
    with proof.m.If(valid & alone):
        proof.lemma(cells == spec.masked(sheet))
        proof.lemma(follows == ((todo != 0) & (todo & (row << 1) == 0)))
        proof.lemma((last == (todo == 0)) & ~spec.gap)
    with proof.m.Else():
        proof.lemma((cells == 0) & ~follows)
        proof.lemma(spec.gap == (valid & (todo != 0)))
        proof.lemma(~valid | (last == (todo == 0)))
        proof.lemma(~spec.gap | (spec.place == y + 1) & (todo & ~above == 0))


def _all_rows_lemmas(sheet: Sheet, spec: Frames, row: Value, above: Value) -> None:
    proof, inside, skin = sheet.proof, sheet.inside, sheet.skin
    driven, rest, todo = inside["offer.driven"], inside["offer.rest"], inside["cycle.todo"]
    first = (Const(1, skin.rows) << spec.place)[: skin.rows]
    proof.lemma((spec.place == inside["offer.place"]) & (spec.place < skin.rows))
    proof.lemma(spec.left & (first - 1) == 0)
    proof.lemma(spec.underway | (spec.place == 0))
    proof.lemma(~rest | (todo == 0))
    with proof.m.If(driven):
        proof.lemma(inside["offer.cells"] == spec.masked(sheet))
        proof.lemma(rest == (todo == 0))
    with proof.m.Elif((sheet.state == LISTEN) & (inside["cycle.due"] == 0)):
        proof.lemma(spec.underway == rest)


_FRAME_BUGS = (
    Bug("the next row although one waits", ReversalCycle, "waits", lambda *_: 0),
    Bug("a row is left out", ReversalCycle, "todo",
        lambda rows, inside: Mux(inside["begins"], rows & (rows - 1), rows)),
    Bug("a row twice", ReversalCycle, "todo", lambda rows, inside: rows | inside["todo"] & inside["selected"]),
    Bug("the empty row is forgotten", DrivenRows, "follows", lambda *_: 0),
    Bug("an empty row everywhere", DrivenRows, "follows",
        lambda follows, inside: follows | inside["strobe"] & ~inside["last"]),
    Bug("rows after the first are forgotten", ReversalCycle, "todo",
        lambda rows, inside: Mux(inside["due"][0], 0, rows)),
    Bug("out of order", ReversalCycle, "following", lambda row, _: row ^ 1),
    Bug("selected for a clock less", ReversalCycle, "selected",
        lambda rows, inside: Mux(inside["clock"] == inside.component.derived.settle_clocks - 1, 0, rows)),
    Bug("offered a clock early", ReversalCycle, "strobe", lambda _, inside: inside["due"][0]),
    Bug("offered for one clock", DrivenRows, "rows__valid", lambda valid, inside: inside["strobe"]),
    Bug("a frame before the last is packed", ReversalCycle, "underway", lambda *_: 0),
)  # fmt: skip
_CELLS_BUGS = (
    Bug("a row is passed over", AllRows, "place", lambda place, inside: place + (inside["place"] == 0)),
    Bug("a driven row is empty", AllRows, "alone", lambda *_: 0),
    Bug("others before it is read", AllRows, "rest", lambda rest, inside: rest | inside["strobe"]),
)  # fmt: skip
CASES = (
    ProofCase("frames of a line reversal", "3x2, col2row",
              partial(frames, rows=3, columns=2, diodes="col2row", mask=((1, 0),)), 2, _FRAME_BUGS, 30),
    ProofCase("frames of a line reversal", "3x2, row2col, debounced",
              partial(frames, rows=3, columns=2, diodes="row2col", debounce="sym_defer_pk"), 2),
    ProofCase("frames of a line reversal", "8x2", partial(frames, rows=8, columns=2), 2),
    ProofCase("frames of a line reversal", "3x2, cells",
              partial(frames, rows=3, columns=2, diodes="row2col", report="cells"), 2, _CELLS_BUGS, 30),
)  # fmt: skip
