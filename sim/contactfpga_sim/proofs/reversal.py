"""Line reversal: pins never meet, each touched row is driven and handed on once, and no closed switch is missed."""

from functools import partial
from typing import Any

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value

from contactfpga.skin import Skin
from contactfpga_hdl.scan.pins import released_levels
from contactfpga_hdl.scan.precharge import Precharge
from contactfpga_hdl.scan.reversal import ReversalScanner
from contactfpga_hdl.scan.stuck import present
from contactfpga_hdl.util.popcount import popcount
from contactfpga_sim.proofs.bugs import Bug
from contactfpga_sim.proofs.case import Case
from contactfpga_sim.proofs.inside import Inside
from contactfpga_sim.proofs.precharge import apart, level_lemmas
from contactfpga_sim.proofs.proof import Proof
from contactfpga_sim.proofs.streams import offers_stay

LISTEN, CHARGE, GAP, SELECT = range(4)  # in the order in which the source names them
PACKED = 6
"""In time means: a frame is packed so many clocks after its last row was taken, at most."""


def skin_of(rows: int, columns: int, **changes: Any) -> Skin:
    times = {"settle_us": 3, "release_us": 1, "precharge_us": 2, "project_us": 2}
    return Skin(
        scan="reversal", rows=rows, columns=columns, clock_hz=1_000_000, baud=500_000, zone_capacity=1,
        **(times | {"send": "on_change"} | changes),
    )  # fmt: skip


class Sheet:
    """The scan with a free sheet around it, and what one sees at its pins."""

    def __init__(self, proof: Proof, skin: Skin):
        m = proof.m
        self.proof, self.skin = proof, skin
        self.dut = dut = ReversalScanner(skin)
        self.inside = proof.put(dut)
        self.columns, self.rows = proof.free(skin.columns, "columns"), proof.free(skin.rows, "rows")
        self.packed = proof.free(1, "packed")
        m.d.comb += [
            dut.pins.columns.eq(self.columns),
            dut.pins.rows_read.eq(self.rows),
            dut.packed.eq(self.packed),
            dut.rows.ready.eq(proof.free(1, "ready")),
            dut.due.eq(proof.free(1, "due")),
            dut.request.eq(proof.free(1, "request")),
        ]
        busy = 0
        if dut.derived.debounced:
            m.d.comb += dut.busy.eq(proof.free(skin.rows, "busy"))
            busy = dut.busy
        self.selected = Signal(skin.rows)  # rows that the pins drive to the selecting level
        level = ~dut.pins.rows if skin.selects_low else dut.pins.rows
        m.d.comb += self.selected.eq(level & dut.pins.rows_drive)
        self.undriven_selected = level & ~dut.pins.rows_drive
        self.pressed = ~self.columns if skin.selects_low else self.columns
        self.read = ~self.rows if not skin.selects_low else self.rows  # rows that read touched
        touched = proof.before(proof.before(self.read))
        counts = sum(1 << row for row in range(skin.rows) if present(skin, row))
        self.wanted = Signal(skin.rows)
        m.d.comb += self.wanted.eq(touched & counts | busy)
        self.state, self.clock = self.inside["turn_state"], self.inside["clock"]
        self.begins = self.inside["begins"]


def pins(proof: Proof, **changes: Any) -> None:
    """Free: the sheet, and what the stages after do in each clock.

    Claimed: at most one row is selected, and none while rows are let go; no column is driven then nor in the clock
    before or after; rows are let go together. In the first clock nothing is driven.
    """
    sheet = Sheet(proof, skin_of(**changes))
    drive, columns = sheet.dut.pins.rows_drive, sheet.dut.pins.columns_drive
    apart(proof, columns, sheet.selected)
    proof.claim(sheet.selected & (sheet.selected - 1) == 0)
    proof.claim((drive == 0) | (drive == (1 << sheet.skin.rows) - 1))
    proof.claim(sheet.undriven_selected == 0)
    started = proof.before(1)
    with proof.m.If(~started):
        proof.claim((drive == 0) & (columns == 0))
    _pin_lemmas(sheet)


def _pin_lemmas(sheet: Sheet) -> None:
    """What a state does to the sheet is seen a clock later."""
    proof, state, clock, inside = sheet.proof, sheet.state, sheet.clock, sheet.inside
    derived = sheet.dut.derived
    before = proof.before(state, init=LISTEN)
    selects = (state == SELECT) & (clock != 0)
    started = proof.before(1)
    proof.lemma(inside["selected"] == Mux(selects, (Const(1, sheet.skin.rows) << inside["y"])[: sheet.skin.rows], 0))
    proof.lemma((sheet.dut.pins.columns_drive == 0) | (before == LISTEN) | (before == CHARGE))
    proof.lemma(sheet.dut.pins.rows_drive == Mux(before == LISTEN, 0, (1 << sheet.skin.rows) - 1))
    proof.lemma((state != SELECT) | (before == Mux(clock == 0, GAP, SELECT)))
    proof.lemma((state != GAP) | (before == CHARGE))
    proof.lemma((state != SELECT) | (clock <= derived.settle_clocks))
    with proof.m.If((state == LISTEN) & (clock != 0)):
        proof.lemma((before == LISTEN) & started)
    _clock_lemmas(sheet)


def _clock_lemmas(sheet: Sheet) -> None:
    """How far a state is, and what is on its way through the synchronizer then."""
    proof, state, clock, inside = sheet.proof, sheet.state, sheet.clock, sheet.inside
    derived, due = sheet.dut.derived, inside["due"]
    charge, settled = derived.release_clocks - 2, derived.project_clocks + 2
    proof.lemma((state != LISTEN) | (clock <= settled))
    proof.lemma((state != CHARGE) | (clock < charge))
    proof.lemma(due != 3)
    proof.lemma((due == 0) | (state == LISTEN) | (state == CHARGE))
    proof.lemma((due != 1) | (clock == 0))
    proof.lemma((due != 2) | (clock == min(1, charge - 1)) & (state == CHARGE) | (clock == 1) & (state == LISTEN))
    proof.lemma(~inside["rests"] | (state == LISTEN) & (clock == settled))


class Frames:
    """What the rows that are offered should be, counted apart."""

    def __init__(self, sheet: Sheet):
        proof, dut, skin = sheet.proof, sheet.dut, sheet.skin
        m = proof.m
        self.left = Signal(skin.rows)  # rows of the frame that were not taken yet
        self.underway, self.packing = Signal(), Signal()  # its last row is to be taken; it is to be packed
        self.place = Signal(range(skin.rows + 1))  # of the row after the one that was taken last
        self.gap = Signal()  # an empty row comes next
        before = proof.before(sheet.selected)
        self.ended = Signal()  # a row was selected in the clock before, and is no more
        m.d.comb += self.ended.eq((before != 0) & (sheet.selected == 0))
        released = released_levels(skin, skin.columns)
        at_pins = proof.before(sheet.columns, init=released)
        self.sample, self.sampled = Signal(skin.columns), Signal(skin.rows)
        with m.If(self.ended):
            m.d.sync += [self.sample.eq(~at_pins if skin.selects_low else at_pins), self.sampled.eq(before)]
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
        proof.given(~sheet.packed | self.packing)

    def masked(self, sheet: Sheet) -> Value:
        cells = Signal(sheet.skin.columns)
        m = sheet.proof.m
        for row in range(sheet.skin.rows):
            with m.If(self.sampled[row]):
                m.d.comb += cells.eq(self.sample & present(sheet.skin, row))
        return cells


def frames(proof: Proof, **changes: Any) -> None:
    """Free: the sheet, and when rows are taken. Assumed: no frame is packed before its last row is taken.

    Claimed: a frame begins when the one before is packed, not earlier. Its rows are those that read touched then, or
    are busy. They are selected in ascending order, none while a row is offered. Each is offered once, as its columns
    were in the last clock in which it was selected, without masked ones; an offer stays until it is taken. The last row
    says so, and no other.
    """
    sheet = Sheet(proof, skin_of(**changes))
    spec = Frames(sheet)
    _claim_frames(sheet, spec)
    if sheet.dut.derived.skips:
        _claim_driven_rows(sheet, spec)
    else:
        _claim_all_rows(sheet, spec)
    _pin_lemmas(sheet)
    _frame_lemmas(sheet, spec)


def _claim_frames(sheet: Sheet, spec: Frames) -> None:
    proof, dut = sheet.proof, sheet.dut
    offers_stay(proof, dut.rows)
    proof.claim(~sheet.begins | ~(spec.underway | spec.packing))
    proof.claim(~(dut.rows.valid & (sheet.selected != 0)))
    proof.claim((sheet.selected == 0) | (sheet.selected == spec.lowest))
    with proof.m.If(dut.rows.valid):
        proof.claim(spec.underway)
        with proof.m.If(dut.alone):
            proof.claim((spec.left != 0) & (spec.sampled == spec.lowest))
            proof.claim(dut.rows.payload.cells == spec.masked(sheet))
        with proof.m.Else():
            proof.claim(dut.rows.payload.cells == 0)


def _claim_driven_rows(sheet: Sheet, spec: Frames) -> None:
    """Those that were selected, with an empty one after each whose neighbor was not; an empty one for none."""
    proof, row = sheet.proof, sheet.dut.rows.payload
    here = (Const(1, sheet.skin.rows + 1) << row.y)[: sheet.skin.rows + 1]
    with proof.m.If(spec.taken & sheet.dut.alone):
        others = spec.left & ~spec.lowest
        follows = (others != 0) & ((others & (spec.lowest << 1)) == 0)
        proof.m.d.sync += [spec.gap.eq(follows), spec.place.eq(row.y + 1)]
    with proof.m.Elif(spec.taken):
        proof.m.d.sync += spec.gap.eq(0)
    with proof.m.If(sheet.dut.rows.valid & sheet.dut.alone):
        proof.claim(~spec.gap & (here == spec.lowest) & (row.last == (spec.left == spec.lowest)))
    with proof.m.Elif(sheet.dut.rows.valid):
        proof.claim(spec.gap == (spec.left != 0))
        proof.claim((row.last == ~spec.gap) & (~spec.gap | (row.y == spec.place)))


def _claim_all_rows(sheet: Sheet, spec: Frames) -> None:
    """Each row of the sheet, and those that were not selected are empty."""
    proof, row = sheet.proof, sheet.dut.rows.payload
    with proof.m.If(spec.taken):
        proof.m.d.sync += spec.place.eq(Mux(row.last, 0, spec.place + 1))
    with proof.m.If(sheet.dut.rows.valid):
        proof.claim(row.last == (spec.place == sheet.skin.rows - 1))
        proof.claim(sheet.dut.alone == (spec.left & (Const(1, sheet.skin.rows) << spec.place) != 0))


def _frame_lemmas(sheet: Sheet, spec: Frames) -> None:
    proof, dut, inside, skin = sheet.proof, sheet.dut, sheet.inside, sheet.skin
    state, clock, due, todo, y = sheet.state, sheet.clock, inside["due"], inside["todo"], inside["y"]
    valid = dut.rows.valid
    row = Signal(skin.rows)  # that of the last slot
    proof.m.d.comb += row.eq((Const(1, skin.rows) << y)[: skin.rows])
    above = ~(row | row - 1)[: skin.rows]
    selects = state == SELECT
    fresh = selects & (clock <= 1)  # the row is still to be struck off
    unread = inside["driven"] if not dut.derived.skips else valid & dut.alone
    open_row = selects & ~fresh | (due != 0) | unread
    level_lemmas(proof, inside, sheet.columns, released_levels(skin, skin.columns))
    touched = [sheet.read, proof.before(sheet.read)]
    stages = [inside["rows.stage0"], inside["rows.stage1"]]
    for stage, seen in zip(stages, [proof.before(touched[0]), proof.before(touched[1])]):
        proof.lemma((stage if skin.selects_low else ~stage) == seen)
    proof.lemma(y < skin.rows)
    proof.lemma(spec.left == todo | Mux(open_row, row, 0))
    proof.lemma(spec.underway == ((state != LISTEN) | (due != 0) | valid))
    proof.lemma(inside["underway"] == (spec.underway | spec.packing))
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
    with proof.m.If(due == 2):
        second = proof.before(proof.before(sheet.pressed))
        proof.lemma(spec.sample == second)
    proof.lemma((due == 0) | ~valid)
    if dut.derived.skips:
        _driven_rows_lemmas(sheet, spec, row, above)
    else:
        _all_rows_lemmas(sheet, spec, row, above)


def _driven_rows_lemmas(sheet: Sheet, spec: Frames, row: Value, above: Value) -> None:
    proof, dut, inside = sheet.proof, sheet.dut, sheet.inside
    valid, alone, last, cells = dut.rows.valid, dut.alone, dut.rows.payload.last, dut.rows.payload.cells
    todo, follows, y = inside["todo"], inside["follows"], inside["y"]
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
    driven, rest, todo = inside["driven"], inside["rest"], inside["todo"]
    first = (Const(1, skin.rows) << spec.place)[: skin.rows]
    proof.lemma((spec.place == inside["place"]) & (spec.place < skin.rows))
    proof.lemma(spec.left & (first - 1) == 0)
    proof.lemma(spec.underway | (spec.place == 0))
    proof.lemma(~rest | (todo == 0))
    with proof.m.If(driven):
        proof.lemma(inside["cells"] == spec.masked(sheet))
        proof.lemma(rest == (todo == 0))
    with proof.m.Elif((sheet.state == LISTEN) & (inside["due"] == 0)):
        proof.lemma(spec.underway == rest)


_PIN_BUGS = (
    Bug("driven while a row is selected", Precharge, "pins", lambda _, inside: inside["free"]),
    Bug("no gap before a row", ReversalScanner, "charges",
        lambda charges, inside: charges | (inside["turn_state"] == GAP)),
    Bug("no gap after a row", ReversalScanner, "charges",
        lambda charges, inside: charges | (inside["turn_state"] == SELECT)
        & (inside["clock"] == inside.component.derived.settle_clocks)),
    Bug("two rows at once", ReversalScanner, "selected", lambda rows, _: rows | rows << 1),
    Bug("let go while selected", ReversalScanner, "listens", lambda listens, inside: inside["todo"] == 0),
)  # fmt: skip
_FRAME_BUGS = (
    Bug("the next row although one waits", ReversalScanner, "waits", lambda *_: 0),
    Bug("a row is left out", ReversalScanner, "todo",
        lambda rows, inside: Mux(inside["begins"], rows & (rows - 1), rows)),
    Bug("a row twice", ReversalScanner, "todo", lambda rows, inside: rows | inside["todo"] & inside["selected"]),
    Bug("the empty row is forgotten", ReversalScanner, "follows", lambda *_: 0),
    Bug("an empty row everywhere", ReversalScanner, "follows",
        lambda follows, inside: follows | inside["strobe"] & (inside["todo"] != 0)),
    Bug("rows after the first are forgotten", ReversalScanner, "todo",
        lambda rows, inside: Mux(inside["due"][0], 0, rows)),
    Bug("out of order", ReversalScanner, "following", lambda row, _: row ^ 1),
    Bug("sampled a clock late", ReversalScanner, "selected",
        lambda rows, inside: Mux(inside["clock"] == inside.component.derived.settle_clocks - 1, 0, rows)),
    Bug("offered a clock early", ReversalScanner, "strobe", lambda _, inside: inside["due"][0]),
    Bug("offered for one clock", ReversalScanner, "rows__valid", lambda valid, inside: inside["strobe"]),
    Bug("a frame before the last is packed", ReversalScanner, "underway", lambda *_: 0),
)  # fmt: skip
CASES = (
    Case("pins never meet", "3x2, col2row", partial(pins, rows=3, columns=2, diodes="col2row"), 2, _PIN_BUGS, 16),
    Case("frames of a line reversal", "3x2, col2row",
         partial(frames, rows=3, columns=2, diodes="col2row", mask=((1, 0),)), 2, _FRAME_BUGS, 30),
    Case("frames of a line reversal", "3x2, cells",
         partial(frames, rows=3, columns=2, diodes="row2col", report="cells"), 2),
)  # fmt: skip
