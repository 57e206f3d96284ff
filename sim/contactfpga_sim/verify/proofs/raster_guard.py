"""Guard lines in a raster scan."""

from functools import partial
from typing import Literal

from amaranth.hdl import Mux, Signal, Value

from contactfpga.skin import Skin
from contactfpga_hdl.scan.guard import LineFaults
from contactfpga_hdl.scan.pins import released_levels
from contactfpga_hdl.scan.raster import Scanner
from contactfpga_sim.verify.proofs.case import Bug, ProofCase
from contactfpga_sim.verify.proofs.inside import Inside
from contactfpga_sim.verify.proofs.precharge import at_settle_time, level_lemmas
from contactfpga_sim.verify.proofs.proof import Proof

Diodes = Literal["col2row", "row2col"]
ROWS, COLUMNS = 3, 2


def skin_of(diodes: Diodes) -> Skin:
    """A Skin whose row 2 is fully masked."""
    return Skin(
        rows=ROWS, columns=COLUMNS, guard=True, diodes=diodes, clock_hz=1_000_000, baud=500_000, settle_us=8,
        release_us=2, zone_capacity=1, report="cells", mask=((2, 0), (2, 1)),
    )  # fmt: skip


def silent_lines(proof: Proof, diodes: Diodes) -> None:
    """Free: the columns, and when rows are taken.

    Claimed: a row that did not read the guard column in its slot is reported one clock after its strobe, likewise a
    column that the guard row did not read; the frame's tag has it two clocks after its last strobe, so a frame in
    which the guard column was not read with some row, or a column was not read by the guard row, has the flag. A line
    stays reported until it answers in a round that renews. A line that answered in all of its slots is never reported,
    nor is a fully masked row.
    """
    m, skin = proof.m, skin_of(diodes)
    dut = Scanner(skin)
    inside = proof.put(dut)
    columns = proof.free(skin.column_lines, "columns")
    m.d.comb += [dut.pins.columns.eq(columns), dut.rows.ready.eq(proof.free(1, "ready"))]
    released = released_levels(skin, skin.column_lines)
    at_pins = proof.before(proof.before(columns, init=released), init=released)
    silent = Signal(skin.column_lines)
    m.d.comb += silent.eq(at_pins if skin.selects_low else ~at_pins)
    slot, line = _slots(m, dut)
    strobe = slot == dut.derived.settle_clocks + 1
    for row in range(ROWS - 1):
        _report(proof, inside, strobe & (line == row), silent[COLUMNS], dut.faults.rows[row])
    proof.claim(~dut.faults.rows[ROWS - 1])
    for column in range(COLUMNS):
        _report(proof, inside, strobe & (line == ROWS), silent[column], dut.faults.columns[column])
    with m.If(proof.before(proof.before(strobe & (line == ROWS - 1)))):
        proof.claim(dut.tag.fault | ~proof.before((dut.faults.rows | dut.faults.columns).any()))
    _lost_cells_are_flagged(proof, dut, strobe, line, silent)
    _lemmas(proof, inside, dut, slot, line)
    level_lemmas(proof, inside, columns, released)


def _report(proof: Proof, inside: Inside, checked: Value, silent: Value, reported: Value) -> None:
    ever = Signal(name="ever_silent")
    with proof.m.If(checked & silent):
        proof.m.d.sync += ever.eq(1)
    proof.claim(reported | ~proof.before(checked & silent))
    proof.claim(reported | ~proof.before(reported) | proof.before(checked & inside["line_faults.renewing"]))
    proof.claim(ever | ~reported)


def _lost_cells_are_flagged(proof: Proof, dut: Scanner, strobe: Value, line: Signal, silent: Signal) -> None:
    rows, columns = Signal(ROWS - 1, name="lost_rows"), Signal(COLUMNS, name="lost_columns")  # in this frame
    with proof.m.If(strobe & (line == ROWS)):
        proof.m.d.sync += [rows.eq(0), columns.eq(silent)]
    for row in range(ROWS - 1):
        with proof.m.If(strobe & (line == row)):
            proof.m.d.sync += rows[row].eq(silent[COLUMNS])
    with proof.m.If(proof.before(proof.before(strobe & (line == ROWS - 1)))):
        proof.claim(dut.tag.fault | ~(rows.any() | columns.any()))
    proof.lemma((rows & ~dut.faults.rows) == 0)
    proof.lemma((columns & ~dut.faults.columns) == 0)


def _slots(m, dut: Scanner) -> tuple[Signal, Signal]:
    """Clock within its slot, and the slot's line, counted independently of the scanner."""
    slot = Signal(range(dut.derived.row_clocks))
    line = Signal(range(ROWS + 1), init=ROWS)
    ends = slot == dut.derived.row_clocks - 1
    m.d.sync += [slot.eq(Mux(ends, 0, slot + 1)), line.eq(line + ends)]
    return slot, line


def _lemmas(proof: Proof, inside: Inside, dut: Scanner, slot: Signal, line: Signal) -> None:
    settled = dut.derived.settle_clocks
    proof.lemma((inside["clock"] == slot) & (slot < dut.derived.row_clocks))
    proof.lemma((inside["following"] == 1 << (line + 1)[:2]) & inside["scans"])
    released = Signal()
    with proof.m.If(slot == dut.derived.row_clocks - 1):
        proof.m.d.sync += released.eq(1)
    proof.lemma(inside["row"] == Mux(slot > settled + 1, line + 1, line)[:2])
    proof.lemma(inside["reader.begun"] == ((slot == settled) | released & (slot == 0)))
    proof.lemma(inside["reader.done"] == ((slot == settled + 1) | released & (slot == 1)))
    proof.lemma(inside["done_is_row"] == ~((slot > settled + 1) | released & (slot <= 1)))
    proof.lemma(inside["is_last"] == Mux(slot >= settled, line == ROWS - 1, released & (line == ROWS)))
    at_settle_time(proof, inside, dut.derived, slot)
    proof.lemma(inside["ended"] == proof.before((slot == settled + 1) & (line == ROWS - 1)))


_BUGS = (
    Bug("the next row is reported", LineFaults, "faults.rows", lambda rows, _: rows.rotate_left(1)),
    Bug("a row is reported once", LineFaults, "faults.rows", lambda rows, inside: rows & ~inside["faults.rows"]),
    Bug("columns that answer are reported", LineFaults, "faults.columns",
        lambda columns, inside: columns ^ inside.component.checks_columns.replicate(COLUMNS)),
    Bug("one column is reported for all", LineFaults, "faults.columns",
        lambda columns, _: columns.any().replicate(COLUMNS)),
    Bug("a masked row is reported", LineFaults, "faults.rows",
        lambda rows, inside: rows | inside.component.rows & inside.component.checks_rows),
    Bug("columns are checked in rows' slots", Scanner, "checks_columns", lambda _, inside: inside["of_row"]),
    Bug("the tag does not say so", Scanner, "at_end", lambda *_: 0),
)  # fmt: skip
CASES = (
    ProofCase(
        "silent lines are reported", "3x2, guard lines, col2row", partial(silent_lines, diodes="col2row"), 2, _BUGS, 44
    ),
    ProofCase("silent lines are reported", "3x2, guard lines, row2col", partial(silent_lines, diodes="row2col"), 2),
)
