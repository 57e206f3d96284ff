"""Line reversal misses no switch that stays closed: it is in its frame, and the next frame comes in time."""

from functools import partial
from typing import Any

from amaranth.hdl import Array, Const, Mux, Signal, Value

from contactfpga_hdl.scan.reversal import ReversalScanner
from contactfpga_hdl.util.popcount import popcount
from contactfpga_sim.proofs.bugs import Bug
from contactfpga_sim.proofs.case import Case
from contactfpga_sim.proofs.proof import Proof
from contactfpga_sim.proofs.reversal import CHARGE, GAP, LISTEN, SELECT, Sheet, pin_lemmas, skin_of
from contactfpga_sim.proofs.reversal_frames import Frames, keep_frames

PACKED = 6
"""In time means: a frame is packed so many clocks after its last row was taken, at most."""


def closed(proof: Proof, **changes: Any) -> None:
    """Free: one switch that is not masked, in which clocks it is closed, all else that the pins read, and when rows are
    taken.

    Assumed: where it is closed, a driven column is read by its row while rows are let go, and a selected row by its
    column; a driven column reads released. No frame is packed before its last row is taken.

    Claimed: its row is in a frame if it is closed two clocks before the frame begins; and its cell is, if it stays
    closed until its row is sampled.
    """
    m = proof.m
    sheet = Sheet(proof, skin_of(**changes))
    spec, skin, columns = Frames(sheet), sheet.skin, sheet.dut.pins.columns_drive
    y, x, shut = proof.chosen(range(skin.rows), "y"), proof.chosen(range(skin.columns), "x"), proof.free(1, "shut")
    proof.given((y < skin.rows) & (x < skin.columns))
    for row, column in skin.mask:
        proof.given((y != row) | (x != column))
    row = Signal(skin.rows)
    m.d.comb += row.eq(Const(1, skin.rows) << y)
    pressed = sheet.pressed.bit_select(x, 1)
    let_go = ~sheet.dut.pins.rows_drive.any()
    proof.given(~(shut & columns.bit_select(x, 1) & let_go) | sheet.read.bit_select(y, 1))
    proof.given(~(shut & (sheet.selected & row).any()) | pressed)
    proof.given(~(columns.bit_select(x, 1) & pressed))
    was = proof.before(shut)
    then = proof.before(was)  # two clocks ago
    unread, kept, reported = Signal(skin.rows), Signal(), Signal()
    left = unread & ~Mux(spec.ended, proof.before(sheet.selected), 0)
    with m.If(sheet.begins):
        m.d.sync += [unread.eq(sheet.wanted), kept.eq(then & was & shut), reported.eq(0)]
        proof.claim(~then | (sheet.wanted & row).any())
    with m.Else():
        m.d.sync += [unread.eq(left), kept.eq(kept & (shut | (left & row == 0)))]
    here = sheet.dut.rows.valid & sheet.dut.alone & (spec.lowest == row)
    cell = here & sheet.dut.rows.payload.cells.bit_select(x, 1)
    with m.If(spec.taken):
        m.d.sync += reported.eq(reported | cell)
    proof.claim(~(here & kept) | cell)
    proof.claim(~(spec.taken & sheet.dut.rows.payload.last & kept) | reported | cell)
    keep_frames(sheet, spec)
    _closed_lemmas(sheet, spec, x, row, unread, kept, reported)


def _closed_lemmas(sheet: Sheet, spec: Frames, x, row, unread, kept, reported) -> None:
    proof, inside, state, due = sheet.proof, sheet.inside, sheet.state, sheet.inside["due"]
    before = proof.before(state, init=LISTEN)
    driven = sheet.dut.pins.columns_drive.bit_select(x, 1)
    y_row = (Const(1, sheet.skin.rows) << inside["y"])[: sheet.skin.rows]
    proof.lemma(inside["precharge.free"].bit_select(x, 1))
    proof.lemma(driven == (proof.before(1) & ((before == LISTEN) | (before == CHARGE))))
    proof.lemma(unread == inside["todo"] | Mux((state == SELECT) | (due == 1), y_row, 0))
    _seen_lemmas(sheet, row)
    pressed = proof.before(sheet.pressed).bit_select(x, 1)
    proof.lemma(~(spec.underway & kept) | reported | (spec.left & row).any())
    with proof.m.If(kept & (y_row == row)):
        proof.lemma((due != 1) | pressed)
        proof.lemma((due != 2) | spec.sample.bit_select(x, 1))
        offered = sheet.dut.rows.valid & sheet.dut.alone
        proof.lemma(~offered | spec.sample.bit_select(x, 1))


def _seen_lemmas(sheet: Sheet, row) -> None:
    """A closed switch has been read by its row since the second clock of listening."""
    proof, state, clock = sheet.proof, sheet.state, sheet.clock
    read = proof.before(sheet.read)
    shut = _named(sheet, "shut")
