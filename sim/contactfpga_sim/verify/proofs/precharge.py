"""Driven columns."""

from functools import partial
from typing import Literal

from amaranth.hdl import Cat, Mux, Signal, Value

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.scan.frame_clock import RETRY_BIT
from contactfpga_hdl.scan.pins import moves_sample, released_levels
from contactfpga_hdl.scan.precharge import LOOKS, Precharge
from contactfpga_hdl.scan.raster import Scanner
from contactfpga_hdl.scan.reversal import ReversalScanner
from contactfpga_sim.verify.proofs.case import Bug, ProofCase
from contactfpga_sim.verify.proofs.inside import Inside
from contactfpga_sim.verify.proofs.proof import Proof


def at_settle_time(proof: Proof, inside: Inside, derived: Derived, slot: Value | None = None) -> None:
    """Lemmas: samples are at the end of the settle time; ``slot``: the clock within a slot of a raster scan."""
    if not moves_sample(derived):
        return
    settle = derived.settle_clocks
    part = "cycle." if derived.skin.reads_rows else ""
    clock, following = inside[f"{part}sample_clock"], inside[f"{part}next_sample_clock"]
    proof.lemma((clock == settle) & (following == settle) & ~inside[f"{part}early"])
    if slot is not None:
        proof.lemma(inside["sample_due"] == ((slot == settle) | (slot == settle + 1)))


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
    """Claimed: no column is driven while a row is selected, and a clock without either is between the two."""
    any_column, any_row = Signal(), Signal()
    proof.m.d.comb += [any_column.eq(columns.any()), any_row.eq(selected.any())]
    proof.claim(~(any_column & any_row))
    proof.claim(~(any_column & proof.before(any_row)))
    proof.claim(~(any_row & proof.before(any_column)))


def raster(proof: Proof, diodes: Diodes) -> None:
    """Free: the columns. Claimed: columns and rows are never driven in the same or adjacent clocks."""
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
    """Free: when columns are driven, their readings, when these are samples, and when they are retried.

    Claimed: columns are driven a clock after the request, except those masked in every row, and stuck ones, which read
    pressed in each sample of a window, of four that are two clocks apart and all between them. A stuck column is driven
    throughout the first window after a toggle, and stays stuck if it read pressed throughout. A guard column that reads
    pressed in a check is not driven until a toggle.
    """
    m = proof.m
    skin = reversal_of("col2row").replace(columns=3, guard=True)
    dut = Precharge(skin)
    dut.apart_bits = 1  # in place of 4 or more, so that bugs show soon
    inside = proof.put(dut)
    drive, retry = proof.free(1, "drive"), proof.free(1, "retry")
    columns, looks = proof.free(3, "columns"), proof.free(1, "looks")
    pressed, guard = proof.free(1, "guard_pressed"), Signal()
    m.d.comb += [dut.drive.eq(drive), dut.retry.eq(retry), dut.columns.eq(columns), dut.looks.eq(looks)]
    m.d.comb += dut.guard_pressed.eq(pressed)
    apart, parts = Signal(), Signal(range(LOOKS))  # a clock without a look, or a look, was; parts that are over
    released = Signal(3)  # columns that read so in this window
    stuck = Signal(3)
    asked = Signal()
    tries = Signal()
    ends = Signal()
    m.d.comb += ends.eq(looks & apart & (parts == LOOKS - 1))
    toggles = retry != proof.before(retry)
    now = (released | Mux(looks, ~columns, 0))[:3]
    m.d.sync += [
        apart.eq(~(looks & apart)),
        parts.eq(parts + (looks & apart)),
        released.eq(Mux(ends, 0, now)),
        asked.eq(toggles | asked & ~ends),
        guard.eq(~toggles & (guard | pressed)),
    ]
    with m.If(ends):
        m.d.sync += [tries.eq(asked), stuck.eq(~now | Mux(tries, 0, stuck))]
    proof.claim(dut.held == Cat(stuck & 0b101, guard))
    let_go = Cat(stuck & ~tries.replicate(3), guard)
    proof.claim(dut.pins == Mux(proof.before(drive), ~proof.before(let_go) & 0b1101, 0))
    proof.lemma(inside["before"] == proof.before(retry))
    proof.lemma(inside["count"] == Cat(apart, parts))
    proof.lemma((inside["low"] == ~released) & (inside["stuck"] == stuck & 0b101))
    proof.lemma(inside["guard_stuck"] == guard)
    proof.lemma((inside["asked"] == asked) & (inside["tries"] == tries))


MISREAD = 8
"""Clocks for which a column may misread."""


def kept(proof: Proof) -> None:
    """Free: as in :func:`let_go`. Assumed: column 0 reads pressed for at most 8 clocks on end, and not again in a
    window.

    Claimed: column 0 is driven whenever the others are.
    """
    m = proof.m
    dut = Precharge(Skin(rows=2, columns=3, precharge_us=1, settle_us=20))
    inside = proof.put(dut)
    drive, retry = proof.free(1, "drive"), proof.free(1, "retry")
    columns, looks = proof.free(3, "columns"), proof.free(1, "looks")
    m.d.comb += [dut.drive.eq(drive), dut.retry.eq(retry), dut.columns.eq(columns), dut.looks.eq(looks)]
    count, ends = inside["count"], inside["ends"]
    lasted, over = Signal(range(MISREAD + 1)), Signal()  # clocks that it has read pressed; no more in this window
    m.d.sync += [lasted.eq(Mux(columns[0], lasted + 1, 0)), over.eq((over | (lasted != 0) & ~columns[0]) & ~ends)]
    proof.given(~columns[0] | (lasted < MISREAD) & ((lasted != 0) | ~over))
    proof.claim(~proof.before(drive) | dut.pins[0])
    part = 1 << dut.apart_bits
    proof.lemma(~inside["stuck"][0] & (lasted <= MISREAD) & ~(over & (lasted != 0)))
    proof.lemma(~inside["low"][0] | (count < 2 * part) & ((count < part) | over | (lasted > count - part)))


def column_let_go(proof: Proof, dut: Scanner | ReversalScanner) -> None:
    """Free: the sheet, and when rows are taken. Column 1 is masked in every row.

    Claimed: driven columns follow :func:`let_go`; a sample is their reading two clocks before, in the last clock of a
    release, as a frame begins, or while the sheet rests; the clock's bit 16 toggles at least every 2^16 us. Column 1 is
    never driven.
    """
    m, skin = proof.m, dut.skin
    inside = proof.put(dut)
    columns = proof.free(skin.columns, "columns")
    m.d.comb += [dut.pins.columns.eq(columns), dut.rows.ready.eq(proof.free(1, "ready"))]
    if isinstance(dut, ReversalScanner):
        m.d.comb += [dut.pins.rows_read.eq(proof.free(skin.rows, "rows_read")), dut.packed.eq(proof.free(1, "packed"))]
        m.d.comb += dut.due.eq(proof.free(1, "due"))
        sampled, time, runs = inside["cycle.begins"] | inside["cycle.rests"] & inside["cycle.settled"], dut.time, 1
    else:
        sampled, time, runs = inside["of_released"], inside["frame_clock.time"], inside["started"]
        late = proof.before(proof.before((inside["clock"] == dut.derived.row_clocks - 1) & inside["scans"]))
        proof.claim(sampled == late)
        _raster_lemmas(proof, inside, dut, late)
    released = released_levels(skin, skin.columns)
    at_pins = proof.before(proof.before(columns, init=released), init=released)
    toggles = proof.before(time[RETRY_BIT]) != time[RETRY_BIT]
    part = inside.part("precharge")
    proof.claim(part.looks == sampled)
    proof.claim(~sampled | (part.columns == at_pins ^ released))
    proof.claim((dut.pins.columns_drive == part.pins) & (part.retry == time[RETRY_BIT]))
    proof.claim(~dut.pins.columns_drive[1])
    age = Signal(RETRY_BIT + 1)  # us since the last toggle
    with m.If(toggles):
        m.d.sync += age.eq(0)
    with m.Elif(runs):
        m.d.sync += age.eq(age + 1)
    proof.claim(age <= _RETRY)
    since = Signal(RETRY_BIT + 1)  # us since bit 16 toggled
    m.d.comb += since.eq(Mux(toggles & (time[:RETRY_BIT] == 0), _RETRY, time[:RETRY_BIT]))
    proof.lemma(age <= since)
    proof.lemma(~toggles | (time[:RETRY_BIT] == 0))
    proof.lemma(inside["precharge.before"] == proof.before(time[RETRY_BIT]))
    level_lemmas(proof, inside, columns, released)


def level_lemmas(proof: Proof, inside: Inside, columns, released: int) -> None:
    first = proof.before(columns, init=released)
    proof.lemma(inside["reader.sync.stage0"] == first)
    proof.lemma(inside["reader.sync.stage1"] == proof.before(first, init=released))


def _raster_lemmas(proof: Proof, inside: Inside, dut: Scanner, late) -> None:
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
    Bug("a stuck column is driven", Precharge, "free", lambda free, inside: free | inside["stuck"]),
    Bug("never tried", Precharge, "tries", lambda *_: 0),
    Bug("tried at once, for what is left of a window", Precharge, "tries",
        lambda tries, inside: tries | inside["toggles"]),
    Bug("well after a try", Precharge, "stuck",
        lambda stuck, inside: Mux(inside["ends"] & inside["tries"], 0, stuck)),
    Bug("stuck for good", Precharge, "stuck", lambda stuck, inside: stuck | inside["stuck"]),
    Bug("a masked column is driven", Precharge, "pins",
        lambda pins, inside: Mux(inside.component.drive, pins | 0b010, pins)),
    Bug("one lets the others go", Precharge, "stuck", lambda stuck, _: stuck.any().replicate(3)),
    Bug("samples are together", Precharge, "count",
        lambda count, inside: Mux(inside.component.looks, count + 1, count)),
    Bug("only the last sample counts", Precharge, "low", lambda *_: -1),
    Bug("a guard column for good", Precharge, "guard_stuck", lambda stuck, inside: stuck | inside["guard_stuck"]),
    Bug("a guard column that is found as it is retried", Precharge, "guard_stuck",
        lambda stuck, inside: stuck | inside.component.guard_pressed),
)  # fmt: skip
_KEPT_BUGS = (
    Bug("only the last sample counts", Precharge, "low", lambda *_: -1),
    Bug("samples are together", Precharge, "count",
        lambda count, inside: Mux(inside.component.looks, count + 15, count)),
)  # fmt: skip
_STUCK_BUGS = (
    Bug("at the wrong sample", Scanner, "of_released", lambda _, inside: inside["of_row"]),
    Bug("those that read released", Scanner, "read", lambda read, _: ~read),
    Bug("driven on", Scanner, "pins__columns_drive", lambda columns, inside: _also_in(columns, inside, 0)),
)  # fmt: skip
_REVERSAL_BUGS = (
    Bug("never looked at", ReversalScanner, "looks", lambda *_: 0),
    Bug("looked at a clock late", ReversalScanner, "looks", lambda _, inside: inside["begun"]),
    Bug("driven on", ReversalScanner, "pins__columns_drive", lambda columns, inside: columns | inside["cycle.due"][0]),
)  # fmt: skip
CASES = (
    ProofCase("columns and rows apart", "raster, 3 rows, col2row", partial(raster, diodes="col2row"), 2,
              _RASTER_BUGS, 24),
    ProofCase("columns and rows apart", "raster, 3 rows, row2col", partial(raster, diodes="row2col"), 2),
    ProofCase("a stuck column is let go", "3 columns", let_go, 2, _LET_GO_BUGS, 30),
    ProofCase("a column that reads pressed for 8 clocks is driven on", "3 columns", kept, 2, _KEPT_BUGS, 80),
    ProofCase("a stuck column is let go", "raster, 3x2",
              lambda proof: column_let_go(proof, Scanner(raster_of("col2row"))), 2, _STUCK_BUGS, 40),
    ProofCase("a stuck column is let go", "reversal, 2x2",
              lambda proof: column_let_go(proof, ReversalScanner(reversal_of("row2col"))), 2, _REVERSAL_BUGS),
)  # fmt: skip
