"""Several samples of a row."""

from amaranth.hdl import Mux, Signal

from contactfpga.skin import Skin
from contactfpga_hdl.scan.pins import released_levels
from contactfpga_hdl.scan.raster import Scanner
from contactfpga_hdl.util.bits import popcount
from contactfpga_sim.verify.proofs.case import Bug, ProofCase
from contactfpga_sim.verify.proofs.inside import Inside
from contactfpga_sim.verify.proofs.precharge import level_lemmas
from contactfpga_sim.verify.proofs.proof import Proof

_SKIN = Skin(
    rows=1, columns=1, report="cells", guard=True, ruler=64, harder=(16, 4), clock_hz=1_000_000, baud=500_000,
    settle_us=16, precharge_us=1, release_us=2,
)  # fmt: skip


def levels(proof: Proof) -> None:
    """Free: the columns, commands, and when rows are taken.

    Claimed: each sample of a row is at its own clock, from the second to the last in which the row is driven, which
    changes only between the guard row and row 0. A row is offered two clocks after its last one, and a cell's level in
    it is the number of samples in which the column was pressed in that row: none is left out, taken twice, or of
    another row.
    """
    m = proof.m
    dut = Scanner(_SKIN)
    inside = proof.put(dut)
    columns = proof.free(_SKIN.column_lines, "columns")
    m.d.comb += [
        dut.pins.columns.eq(columns),
        dut.rows.ready.eq(proof.free(1, "ready")),
        dut.moves.eq(proof.free(1, "moves")),
        dut.clocks.eq(proof.free(len(dut.clocks), "clocks")),
    ]
    released = released_levels(_SKIN, _SKIN.column_lines)
    at_pins = proof.before(proof.before(columns, init=released), init=released)
    settle, slot_clocks = dut.derived.settle_clocks, dut.derived.row_clocks
    slot, row = Signal(range(slot_clocks)), Signal()  # counted independently of the scanner; the guard row comes first
    ends, strobe = slot == slot_clocks - 1, slot == settle + 1
    m.d.sync += [slot.eq(Mux(ends, 0, slot + 1)), row.eq(row ^ ends)]
    clocks = [inside[f"sample_clock{level or ''}"] for level in range(_SKIN.levels)]
    read = []
    for level, clock in enumerate(clocks):
        now, kept = Signal(name=f"now_{level}"), Signal(name=f"kept_{level}")
        m.d.comb += now.eq(Mux(slot == clock + 1, ~at_pins[0], kept))
        m.d.sync += kept.eq(now)
        read.append((now, kept))
        proof.claim((clock >= 2) & (clock <= settle))
        proof.lemma((clock >= 2) & (clock <= settle))
        proof.claim((clock == proof.before(clock, init=settle)) | row & (slot == 1))
    with m.If(proof.before(strobe & row)):
        proof.claim(dut.rows.valid)
        proof.claim(dut.rows.payload.cells == proof.before(popcount(now for now, _ in read)))
    _lemmas(proof, inside, dut, slot, row, clocks)
    level_lemmas(proof, inside, columns, released)
    for level, (_, kept) in enumerate(read):
        held = inside[f"level_kept_{level}"] if level else ~inside["kept"][0]
        with m.If(row & (slot > clocks[level] + 1)):
            proof.lemma(held == kept)


def _lemmas(proof: Proof, inside: Inside, dut: Scanner, slot: Signal, row: Signal, clocks: list) -> None:
    settle, at, begun = dut.derived.settle_clocks, Signal(range(dut.derived.row_clocks)), Signal()
    m = proof.m
    m.d.comb += at.eq(Mux(row, clocks[0], settle))
    with m.If(slot == dut.derived.row_clocks - 1):
        m.d.sync += begun.eq(1)
    proof.lemma((inside["clock"] == slot) & (slot < dut.derived.row_clocks) & inside["scans"] & (begun | ~row))
    proof.lemma(inside["following"] == Mux(row, 0b10, 0b01))
    proof.lemma(inside["row"] == (row ^ (slot <= settle + 1)))
    proof.lemma(inside["reader.begun"] == ((slot == at) | begun & (slot == 0)))
    proof.lemma(inside["reader.done"] == ((slot == at + 1) | begun & (slot == 1)))
    proof.lemma(inside["done_is_row"] == ~((slot > at + 1) | begun & (slot <= 1)))
    proof.lemma(inside["is_last"] == Mux(slot >= at, row, begun & ~row))
    proof.lemma(inside["sample_due"] == ((slot >= at) & (slot <= settle + 1)))
    for number in range(_SKIN.levels):
        late, sum_ = inside[f"ruler_late{number or ''}"], inside[f"ruler_sum{number or ''}"]
        proof.lemma(late | (sum_ < settle << 4))


_BUGS = (
    Bug("a sample is a clock late", Scanner, "level_now_1", lambda now, inside: inside["level_kept_1"]),
    Bug("the hardest level is not counted", Scanner, "level_now_2", lambda *_: 0),
    Bug("the lightest level counts twice", Scanner, "pressed", lambda pressed, inside: pressed + inside["read"][0]),
    Bug("a level is that of the row before", Scanner, "level_kept_2",
        lambda kept, inside: Mux(inside["clock"] == 0, inside["level_now_2"], inside["level_kept_2"])),
    Bug("a sample's clock moves within the row", Scanner, "sample_clock1",
        lambda clock, inside: clock ^ inside["moves"]),
)  # fmt: skip
CASES = (ProofCase("a row's samples are its levels", "1x1, three levels", levels, 2, _BUGS, 60),)
