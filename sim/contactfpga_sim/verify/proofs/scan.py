"""The raster scanner's rows and samples."""

from functools import partial
from typing import Literal

from amaranth.hdl import Cat, Mux, Signal

from contactfpga.skin import Skin
from contactfpga_hdl.scan.pins import DirectColumns, DirectRows
from contactfpga_hdl.scan.raster import Scanner
from contactfpga_sim.verify.proofs.case import Bug, ProofCase
from contactfpga_sim.verify.proofs.inside import Inside
from contactfpga_sim.verify.proofs.proof import Proof


def skin_of(diodes: Literal["col2row", "row2col"]) -> Skin:
    return Skin(rows=4, columns=2, diodes=diodes, settle_us=1, mask=((1, 0),), zone_capacity=1)


def one_row_at_a_time(proof: Proof, diodes: Literal["col2row", "row2col"]) -> None:
    """Claimed: in each clock only the slot's row is driven, or in the release none."""
    skin = skin_of(diodes)
    dut = Scanner(skin)
    inside = proof.put(dut)
    slot, row = _slots(proof, dut.derived)
    driven = Signal(skin.rows)
    proof.m.d.comb += driven.eq(~dut.pins.rows if diodes == "col2row" else dut.pins.rows)
    proof.claim(driven & (driven - 1) == 0)
    proof.claim(driven == Mux(slot < dut.derived.settle_clocks, 1 << row, 0))
    proof.lemma(inside["driver.selected"] == Mux(slot < dut.derived.settle_clocks, 1 << row, 0))
    _slot_lemmas(proof, inside, dut, slot, row)


def each_sample_once(proof: Proof, diodes: Literal["col2row", "row2col"]) -> None:
    """Free: the columns. Assumed: a row is taken before the next one, by the Skin's limits.

    Claimed: a row is offered unchanged from the clock after its strobe until it is taken, as the pins were two clocks
    before the strobe.
    """
    m, skin = proof.m, skin_of(diodes)
    dut = Scanner(skin)
    inside = proof.put(dut)
    columns, ready = proof.free(skin.columns, "columns"), proof.free(1, "ready")
    m.d.comb += [dut.pins.columns.eq(columns), dut.rows.ready.eq(ready)]
    settled = dut.derived.settle_clocks
    slot, row = _slots(proof, dut.derived)
    inactive = (1 << skin.columns) - 1 if diodes == "col2row" else 0
    at_pins = proof.before(proof.before(columns, init=inactive), init=inactive)
    strobe = slot == settled + 1
    waits, sample = Signal(), Signal(skin.columns + 1)
    with m.If(strobe):
        present = Mux(row == 1, 0b10, 0b11)
        pressed = (~at_pins if diodes == "col2row" else at_pins) & present
        m.d.sync += [waits.eq(1), sample.eq(Cat(pressed[: skin.columns], row == skin.rows - 1))]
    with m.Elif(ready):
        m.d.sync += waits.eq(0)
    proof.given(~(strobe & waits & ~ready))
    proof.claim(dut.rows.valid == waits)
    with m.If(waits):
        proof.claim(dut.rows.payload.as_value() == sample)
    next_row = Mux(slot > settled + 1, row + 1, row)[:2]
    _slot_lemmas(proof, inside, dut, slot, row)
    released = Signal()  # a slot is over: its released sample is on its way at the beginning of the next one
    with m.If(slot == dut.derived.row_clocks - 1):
        m.d.sync += released.eq(1)
    proof.lemma(inside["row"] == next_row)
    proof.lemma(inside["is_last"] == Mux(slot >= settled, row == skin.rows - 1, released & (row == 0)))
    proof.lemma(inside["reader.begun"] == ((slot == settled) | released & (slot == 0)))
    proof.lemma(inside["reader.done"] == (strobe | released & (slot == 1)))
    proof.lemma(inside["done_is_row"] == ~((slot > settled + 1) | released & (slot <= 1)))


def _slot_lemmas(proof: Proof, inside: Inside, dut: Scanner, slot, row) -> None:
    following = 1 << (row + 1)[:2]
    proof.lemma((inside["clock"] == slot) & (slot < dut.derived.row_clocks))
    proof.lemma((inside["following"] == following) & inside["scans"])


def _slots(proof: Proof, derived):
    slot = Signal(range(derived.row_clocks))
    row = Signal(range(derived.skin.rows))
    ends = slot == derived.row_clocks - 1
    proof.m.d.sync += [slot.eq(Mux(ends, 0, slot + 1)), row.eq(row + ends)]
    return slot, row


_DRIVE_BUGS = (
    Bug("no release", DirectRows, "selected",
        lambda rows, inside: Mux(inside.component.release, inside["selected"], rows)),
    Bug("the next row early", DirectRows, "selected",
        lambda rows, inside: Mux(inside.component.release, inside.component.pattern, rows)),
    Bug("two rows at once", DirectRows, "selected", lambda rows, _: rows | rows << 1),
    Bug("row 1 again and again", Scanner, "following",
        lambda following, inside: Mux(inside["following"][1], inside["following"], following)),
)  # fmt: skip
_OFFER_BUGS = (
    Bug("offered for one clock", Scanner, "rows__valid", lambda _, inside: inside["of_row"]),
    Bug("never taken back", Scanner, "rows__valid", lambda valid, inside: valid | inside["rows__valid"]),
    Bug("a strobe early", DirectColumns, "done", lambda _, inside: inside.component.begin),
    Bug("the released sample is a row", Scanner, "of_row", lambda _, inside: inside["reader.done"]),
    Bug("unmasked", Scanner, "pressed", lambda _, inside: inside["read"]),
)
CASES = (
    ProofCase("one row at a time", "4 rows, col2row", partial(one_row_at_a_time, diodes="col2row"), 2, _DRIVE_BUGS, 80),
    ProofCase("one row at a time", "4 rows, row2col", partial(one_row_at_a_time, diodes="row2col"), 2),
    ProofCase("each sample once", "4x2, col2row", partial(each_sample_once, diodes="col2row"), 2, _OFFER_BUGS, 160),
    ProofCase("each sample once", "4x2, row2col", partial(each_sample_once, diodes="row2col"), 2),
)
