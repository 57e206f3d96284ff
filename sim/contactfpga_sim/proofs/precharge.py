"""Columns that are driven: never while a row is selected, and none that something else holds."""

from functools import partial
from typing import Literal

from amaranth.hdl import Mux, Signal, Value

from contactfpga.skin import Skin
from contactfpga_hdl.scan.pins import released_levels
from contactfpga_hdl.scan.precharge import RETRY_BIT, Precharge
from contactfpga_hdl.scan.raster import Scanner
from contactfpga_hdl.scan.reversal import ReversalScanner
from contactfpga_sim.proofs.bugs import Bug
from contactfpga_sim.proofs.case import Case
from contactfpga_sim.proofs.inside import Inside
from contactfpga_sim.proofs.proof import Proof
from contactfpga_sim.proofs.settled import at_settle_time

Diodes = Literal["col2row", "row2col"]
_RETRY = 1 << RETRY_BIT


def raster_of(diodes: Diodes) -> Skin:
    return Skin(
        rows=3, columns=2, diodes=diodes, clock_hz=1_000_000, baud=500_000, settle_us=8, release_us=2, precharge_us=3,
        zone_capacity=1, report="cells", mask=((0, 1), (1, 1), (2, 1)),
    )  # fmt: skip


def reversal_of(diodes: Diodes) -> Skin:
    return Skin(
        scan="reversal", rows=2, columns=2, diodes=diodes, clock_hz=1_000_000, baud=500_000, settle_us=2, release_us=1,
        precharge_us=1, project_us=1, zone_capacity=1, mask=((0, 1), (1, 1)),
    )  # fmt: skip


def apart(proof: Proof, columns: Value, selected: Value) -> None:
    """Claimed: no column is driven while a row is selected, and a clock without either lies between the two."""
    any_column, any_row = Signal(), Signal()
    proof.m.d.comb += [any_column.eq(columns.any()), any_row.eq(selected.any())]
    proof.claim(~(any_column & any_row))
    proof.claim(~(any_column & proof.before(any_row)))
    proof.claim(~(any_row & proof.before(any_column)))


def raster(proof: Proof, diodes: Diodes) -> None:
    """Free: the columns. Claimed: columns and rows are never driven in the same clock nor in clocks next to each
    other."""
    dut = Scanner(raster_of(diodes))
    inside = proof.put(dut)
    proof.m.d.comb += [
        dut.pins.columns.eq(proof.free(2, "columns")),
        dut.rows.ready.eq(proof.free(1, "ready")),
    ]
    selected, clock = Signal(dut.skin.rows), inside["clock"]
    proof.m.d.comb += selected.eq(~dut.pins.rows if dut.skin.selects_low else dut.pins.rows)
    apart(proof, dut.pins.columns_drive, selected)
    settled, slot = dut.derived.settle_clocks, dut.derived.row_clocks
    proof.claim(selected & (selected - 1) == 0)
    proof.lemma((clock < slot) & inside["scans"])
    with proof.m.If((clock <= settled) | (clock == slot - 1)):
        proof.lemma(dut.pins.columns_drive == 0)
    proof.lemma((clock != 0) | (proof.before(dut.pins.columns_drive) == 0))
    proof.lemma((selected == 0) == (clock >= settled))
    following = inside["following"]
    proof.lemma((following & (following - 1) == 0) & (following != 0) & (selected & (selected - 1) == 0))


def let_go(proof: Proof) -> None:
    """Free: when columns are driven, what they read, when it counts, and when they are retried.

    Claimed: columns are driven a clock after they shall be, but for those that read stuck two clocks before that or
    earlier and were not retried since, and those that are masked in every row.
    """
    m = proof.m
    skin = Skin(rows=2, columns=3, precharge_us=1, settle_us=20, mask=((0, 1), (1, 1)))
    dut = Precharge(skin)
    inside = proof.put(dut)
    drive, turn = proof.free(1, "drive"), proof.free(1, "turn")
    columns, stuck = proof.free(3, "columns"), proof.free(1, "stuck")
    m.d.comb += [dut.drive.eq(drive), dut.turn.eq(turn), dut.columns.eq(columns), dut.stuck.eq(stuck)]
    held = Signal(3)
    retried = turn != proof.before(turn)
    m.d.sync += held.eq(Mux(retried, 0, held) | Mux(stuck, columns, 0))
    proof.claim(dut.held == held & 0b101)
    proof.claim(dut.pins == Mux(proof.before(drive), ~proof.before(held) & 0b101, 0))
    proof.lemma(inside["free"] == ~held & 0b101)
    proof.lemma(inside["before"] == proof.before(turn))


def column_let_go(proof: Proof, dut: Scanner | ReversalScanner) -> None:
    """Free: the sheet, and when rows are taken. Column 1 is masked in every row.

    Claimed: from four clocks after column 0 read pressed when it should not, in the last clock of a release, as a frame
    begins or while the sheet rests, it is not driven, until the clock's bit 16 turns; this happens within 2^16 us.
    Column 1 never is.
    """
    m, skin = proof.m, dut.skin
    inside = proof.put(dut)
    columns = proof.free(skin.columns, "columns")
    m.d.comb += [dut.pins.columns.eq(columns), dut.rows.ready.eq(proof.free(1, "ready"))]
    if isinstance(dut, ReversalScanner):
        m.d.comb += [dut.pins.rows_read.eq(proof.free(skin.rows, "rows_read")), dut.packed.eq(proof.free(1, "packed"))]
        m.d.comb += dut.due.eq(proof.free(1, "due"))
        sampled, time, runs = inside["begins"] | inside["rests"] & inside["settled"], dut.time, 1
    else:
        sampled, time, runs = inside["of_released"], inside["time"], inside["runs"]
        late = proof.before(proof.before((inside["clock"] == dut.derived.row_clocks - 1) & inside["scans"]))
        proof.claim(sampled == late)
        _raster_lemmas(proof, inside, dut, late)
    released = released_levels(skin, skin.columns)
    at_pins = proof.before(proof.before(columns, init=released), init=released)
    pressed = (at_pins[0] != released & 1) & sampled
    held, age = Signal(), Signal(RETRY_BIT + 1)  # age: us since column 0 read stuck for the first time
    retried = proof.before(time[RETRY_BIT]) != time[RETRY_BIT]
    with m.If(pressed):
        m.d.sync += held.eq(1)
    with m.Elif(retried):
        m.d.sync += held.eq(0)
    with m.If(~held | retried):
        m.d.sync += age.eq(0)
    with m.Elif(runs):
        m.d.sync += age.eq(age + 1)
    proof.claim(~(proof.before(held) & dut.pins.columns_drive[0]))
    proof.claim(~dut.pins.columns_drive[1])
    proof.claim(age <= _RETRY)
    since = Signal(RETRY_BIT + 1)  # us since bit 16 turned
    m.d.comb += since.eq(Mux(retried & (time[:RETRY_BIT] == 0), _RETRY, time[:RETRY_BIT]))
    proof.lemma((age <= since) & (held | (age == 0)))
    proof.lemma(~retried | (time[:RETRY_BIT] == 0))
    proof.lemma(inside["precharge.before"] == proof.before(time[RETRY_BIT]))
    proof.lemma(inside["precharge.free"] == ~held)
    level_lemmas(proof, inside, columns, released)


def level_lemmas(proof: Proof, inside: Inside, columns, released: int) -> None:
    """What is in the columns' synchronizer."""
    first = proof.before(columns, init=released)
    proof.lemma(inside["reader.sync.stage0"] == first)
    proof.lemma(inside["reader.sync.stage1"] == proof.before(first, init=released))


def _raster_lemmas(proof: Proof, inside: Inside, dut: Scanner, late) -> None:
    """When a sample is on its way, and of what."""
    clock, settled, slot = inside["clock"], dut.derived.settle_clocks, dut.derived.row_clocks
    ended = proof.before((clock == slot - 1) & inside["scans"])
    proof.lemma((clock < slot) & inside["scans"])
    proof.lemma(~ended | (clock == 0))
    proof.lemma(~late | (clock == 1))
    proof.lemma(inside["reader.begun"] == ((clock == settled) | ended))
    proof.lemma(inside["reader.done"] == ((clock == settled + 1) | late))
    proof.lemma(inside["done_is_row"] == ~((clock > settled + 1) | ended | late))
    at_settle_time(proof, inside, dut.derived, clock)


def _also_in(columns, inside: Inside, clock: int):
    return columns | (inside["clock"] == clock).replicate(len(columns))


def _in_release(inside: Inside):
    derived = inside.component.derived
    return (inside["clock"] > derived.settle_clocks) & (inside["clock"] < derived.row_clocks - 1)


def _settled(inside: Inside) -> int:
    return inside.component.derived.settle_clocks


_RASTER_BUGS = (
    Bug("no gap after a row", Scanner, "pins__columns_drive",
        lambda columns, inside: _also_in(columns, inside, _settled(inside))),
    Bug("no gap before a row", Scanner, "pins__columns_drive",
        lambda columns, inside: _also_in(columns, inside, inside.component.derived.row_clocks - 1)),
    Bug("driven all the time", Precharge, "pins", lambda _, inside: inside["free"]),
)  # fmt: skip
_LET_GO_BUGS = (
    Bug("a stuck column is driven", Precharge, "free", lambda free, inside: inside["free"] | free),
    Bug("never retried", Precharge, "free", lambda free, inside: free & inside["free"]),
    Bug("a masked column is driven", Precharge, "pins",
        lambda pins, inside: Mux(inside.component.drive, pins | 0b010, pins)),
    Bug("one lets the others go", Precharge, "free",
        lambda free, inside: Mux(inside.component.stuck & inside.component.columns.any(), 0, free)),
)  # fmt: skip
_STUCK_BUGS = (
    Bug("at the wrong sample", Scanner, "of_released", lambda _, inside: inside["of_row"]),
    Bug("those that read released", Scanner, "read", lambda read, _: ~read),
    Bug("driven on", Scanner, "pins__columns_drive", lambda columns, inside: columns | _in_release(inside)),
)  # fmt: skip
_REVERSAL_BUGS = (
    Bug("never counted as stuck", ReversalScanner, "stuck", lambda *_: 0),
    Bug("counted a clock late", ReversalScanner, "stuck", lambda _, inside: inside["begun"]),
    Bug("driven on", ReversalScanner, "pins__columns_drive", lambda columns, inside: columns | inside["settled"]),
)  # fmt: skip
CASES = (
    Case("columns and rows apart", "raster, 3 rows, col2row", partial(raster, diodes="col2row"), 2, _RASTER_BUGS, 24),
    Case("columns and rows apart", "raster, 3 rows, row2col", partial(raster, diodes="row2col"), 2),
    Case("a stuck column is let go", "3 columns", let_go, 2, _LET_GO_BUGS),
    Case("a stuck column is let go", "raster, 3x2",
         lambda proof: column_let_go(proof, Scanner(raster_of("col2row"))), 2, _STUCK_BUGS, 40),
    Case("a stuck column is let go", "reversal, 2x2",
         lambda proof: column_let_go(proof, ReversalScanner(reversal_of("row2col"))), 2, _REVERSAL_BUGS),
)  # fmt: skip
