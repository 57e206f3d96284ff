"""The scan by line reversal, at its pins."""

from functools import partial
from typing import Any

from amaranth.hdl import Const, Mux, Signal

from contactfpga.skin import Skin
from contactfpga_hdl.scan.pins import released_levels
from contactfpga_hdl.scan.precharge import Precharge
from contactfpga_hdl.scan.reversal import ReversalScanner
from contactfpga_hdl.scan.reversal_cycle import ReversalCycle
from contactfpga_hdl.scan.stuck import present
from contactfpga_sim.verify.proofs.case import Bug, ProofCase
from contactfpga_sim.verify.proofs.precharge import apart, at_settle_time
from contactfpga_sim.verify.proofs.proof import Proof

LISTEN, CHARGE, GAP, SELECT = range(4)  # in the order in which the source names them
SHORT: dict[str, Any] = {"settle_us": 1, "release_us": 1, "precharge_us": 1, "project_us": 1}
LONG: dict[str, Any] = {"settle_us": 6, "precharge_us": 9, "project_us": 12}


def skin_of(rows: int, columns: int, **changes: Any) -> Skin:
    times = {"settle_us": 3, "release_us": 1, "precharge_us": 2, "project_us": 2}
    return Skin(
        scan="reversal", rows=rows, columns=columns, clock_hz=1_000_000, baud=500_000, zone_capacity=1,
        **(times | {"send": "on_change"} | changes),
    )  # fmt: skip


class Sheet:
    """The scan with a free sheet, and observations at its pins."""

    def __init__(self, proof: Proof, skin: Skin):
        m = proof.m
        self.proof, self.skin = proof, skin
        self.dut = dut = ReversalScanner(skin)
        self.inside = proof.put(dut)
        self.columns, self.rows = proof.free(skin.column_lines, "columns"), proof.free(skin.row_lines, "rows")
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
        self.selected = Signal(skin.row_lines)  # rows that the pins drive to the selecting level
        level = ~dut.pins.rows if skin.selects_low else dut.pins.rows
        m.d.comb += self.selected.eq(level & dut.pins.rows_drive)
        self.undriven_selected = level & ~dut.pins.rows_drive
        self.pressed = ~self.columns if skin.selects_low else self.columns
        self.read = ~self.rows if not skin.selects_low else self.rows  # rows that read touched
        self.read_1 = proof.before(self.read)
        self.read_2 = proof.before(self.read_1)
        released = released_levels(skin, skin.column_lines)
        columns_1 = proof.before(self.columns, init=released)
        columns_2 = proof.before(columns_1, init=released)
        self.columns_before = columns_1, columns_2
        self.pressed_1 = ~columns_1 if skin.selects_low else columns_1
        self.pressed_2 = ~columns_2 if skin.selects_low else columns_2
        counts = sum(1 << row for row in range(skin.rows) if present(skin, row))
        self.wanted = Signal(skin.rows)
        m.d.comb += self.wanted.eq(self.read_2 & counts | busy)
        self.state, self.clock = self.inside["cycle.cycle_state"], self.inside["cycle.clock"]
        self.begins = self.inside["cycle.begins"]


def pins(proof: Proof, **changes: Any) -> None:
    """Free: the sheet and the later stages.

    Claimed: at most one row is selected, and none while rows are released; no column is driven then nor in the clock
    before or after; rows are released together. In the first clock nothing is driven.
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
    pin_lemmas(sheet)


def pin_lemmas(sheet: Sheet) -> None:
    """Lemmas: a state affects the sheet a clock later."""
    proof, state, clock, inside = sheet.proof, sheet.state, sheet.clock, sheet.inside
    derived = sheet.dut.derived
    before = proof.before(state, init=LISTEN)
    selects = (state == SELECT) & (clock != 0)
    started = proof.before(1)
    proof.lemma(
        inside["cycle.selected"] == Mux(selects, (Const(1, sheet.skin.rows) << inside["cycle.y"])[: sheet.skin.rows], 0)
    )
    proof.lemma((sheet.dut.pins.columns_drive == 0) | (before == LISTEN) | (before == CHARGE))
    proof.lemma(sheet.dut.pins.rows_drive == Mux(before == LISTEN, 0, (1 << sheet.skin.rows) - 1))
    proof.lemma((state != SELECT) | (before == Mux(clock == 0, GAP, SELECT)))
    proof.lemma((state != GAP) | (before == CHARGE))
    proof.lemma((state != SELECT) | (clock <= derived.settle_clocks))
    with proof.m.If((state == LISTEN) & (clock != 0)):
        proof.lemma((before == LISTEN) & started)
    _clock_lemmas(sheet)


def _clock_lemmas(sheet: Sheet) -> None:
    proof, state, clock, inside = sheet.proof, sheet.state, sheet.clock, sheet.inside
    derived, due = sheet.dut.derived, inside["cycle.due"]
    charge, settled = derived.release_clocks - 2, derived.project_clocks + 2
    proof.lemma((state != LISTEN) | (clock <= settled))
    proof.lemma((state != CHARGE) | (clock < charge))
    at_settle_time(proof, inside, derived)
    proof.lemma(due != 3)
    proof.lemma((due == 0) | (state == LISTEN) | (state == CHARGE))
    proof.lemma((due != 1) | (clock == 0))
    proof.lemma((due != 2) | (clock == min(1, charge - 1)) & (state == CHARGE) | (clock == 1) & (state == LISTEN))
    proof.lemma(~inside["cycle.rests"] | (state == LISTEN) & (clock == settled))


def synchronizer_lemmas(sheet: Sheet) -> None:
    inside, flip = sheet.inside, 0 if sheet.skin.selects_low else -1
    for stage, seen in enumerate((sheet.read_1, sheet.read_2)):
        sheet.proof.lemma(inside[f"rows.stage{stage}"] == (seen ^ flip)[: sheet.skin.rows])
        sheet.proof.lemma(inside[f"reader.sync.stage{stage}"] == sheet.columns_before[stage])


def lasts(proof: Proof, **changes: Any) -> None:
    """Free: the sheet and the later stages. Assumed: column 0 reads released where it is driven.

    Claimed: a row is selected for the settle time, after column 0 was driven for the precharge time; where rows count,
    it had been driven, with rows released, for the projection time.
    """
    m, sheet = proof.m, Sheet(proof, skin_of(**changes))
    derived, driven = sheet.dut.derived, sheet.dut.pins.columns_drive[0]
    proof.given(~(driven & sheet.pressed[0]))
    selects, let_go = sheet.selected.any(), sheet.dut.pins.rows_drive == 0
    selected = Signal(range(derived.settle_clocks + 2))
    m.d.sync += selected.eq(Mux(selects, selected + 1, 0))
    charged, projected = Signal(range(derived.precharge_clocks + 1)), Signal(range(derived.project_clocks + 1))
    m.d.sync += charged.eq(Mux(selects, 0, _more(charged, driven, derived.precharge_clocks)))
    m.d.sync += projected.eq(Mux(driven & let_go, _more(projected, 1, derived.project_clocks), 0))
    proof.claim((selected == 0) | (selects == (selected != derived.settle_clocks)))
    proof.claim(~selects | (selected != 0) | (charged == derived.precharge_clocks))
    projected_1 = proof.before(projected)
    proof.claim(~sheet.begins | (projected_1 == derived.project_clocks))
    pin_lemmas(sheet)
    synchronizer_lemmas(sheet)
    _lasts_lemmas(sheet, selected, charged, projected, projected_1)


def _more(count: Signal, one, most: int):
    return Mux((count != most) & one, count + 1, count)


def _reached(count, most: int, least):
    return (count == most) | (count >= least)


def _lasts_lemmas(sheet: Sheet, selected, charged, projected, projected_1) -> None:
    proof, state, clock, derived = sheet.proof, sheet.state, sheet.clock, sheet.dut.derived
    before, precharge, project = proof.before(state, init=LISTEN), derived.precharge_clocks, derived.project_clocks
    spare = derived.release_clocks - 2 - precharge  # clocks of a release that a precharge does not need
    proof.lemma(~sheet.inside["precharge.stuck"][0])
    proof.lemma(sheet.dut.pins.columns_drive[0] == (proof.before(1) & ((before == LISTEN) | (before == CHARGE))))
    proof.lemma((charged <= precharge) & (projected <= project))
    proof.lemma(
        (sheet.inside["cycle.y"] < sheet.skin.rows)
        & ((state == LISTEN) | (state == SELECT) | sheet.inside["cycle.todo"].any())
    )
    now = Mux(
        state == SELECT, Mux(clock == 0, 0, clock - 1), Mux(sheet.inside["cycle.due"] == 1, derived.settle_clocks, 0)
    )
    proof.lemma(selected == now)
    with proof.m.If(state == LISTEN):
        proof.lemma((clock < 2) | ~sheet.pressed_1[0])
        proof.lemma((clock < 3) | ~sheet.pressed_2[0])
        proof.lemma((clock == 0) | _reached(charged, precharge, clock - 1))
        proof.lemma((clock == 0) | _reached(projected, project, clock - 1))
        proof.lemma((clock < 2) | _reached(projected_1, project, clock - 2))
    with proof.m.If(state == CHARGE):
        proof.lemma(_reached(charged, precharge, clock - spare - 1))
    with proof.m.If(state == GAP):
        proof.lemma(charged >= precharge - 1)
    with proof.m.If((state == SELECT) & (clock <= 1)):
        proof.lemma(charged == precharge)


_PIN_BUGS = (
    Bug("driven while a row is selected", Precharge, "pins", lambda _, inside: inside["free"]),
    Bug("no gap before a row", ReversalCycle, "charges",
        lambda charges, inside: charges | (inside["cycle_state"] == GAP)),
    Bug("no gap after a row", ReversalCycle, "charges",
        lambda charges, inside: charges | (inside["cycle_state"] == SELECT)
        & (inside["clock"] == inside.component.derived.settle_clocks)),
    Bug("two rows at once", ReversalCycle, "selected", lambda rows, _: rows | rows << 1),
    Bug("let go while selected", ReversalCycle, "listens", lambda listens, inside: inside["todo"] == 0),
)  # fmt: skip
_LASTS_BUGS = (
    Bug("driven for a clock more", ReversalCycle, "clock",
        lambda clock, inside: clock
        - ((inside["cycle_state"] == SELECT) & (inside["todo"] & inside["selected"]).any())),
    Bug("a short precharge", ReversalCycle, "clock",
        lambda clock, inside: Mux(inside["due"][0], inside.component.derived.release_clocks - 3, clock)),
    Bug("rows are read too early", ReversalCycle, "settled",
        lambda _, inside: inside["clock"] == inside.component.derived.project_clocks + 1),
    Bug("rows are let go too late", ReversalCycle, "listens",
        lambda listens, inside: listens & (inside["clock"] != 0)),
)  # fmt: skip
CASES = (
    ProofCase("pins never meet", "3x2, col2row", partial(pins, rows=3, columns=2, diodes="col2row"), 2, _PIN_BUGS, 16),
    ProofCase("pins never meet", "3x2, row2col", partial(pins, rows=3, columns=2, diodes="row2col"), 2),
    ProofCase("pins never meet", "2x1, shortest times",
              partial(pins, rows=2, columns=1, **SHORT), 2),
    ProofCase("times of a line reversal", "3x2", partial(lasts, rows=3, columns=2, precharge_us=5), 2, _LASTS_BUGS, 24),
    ProofCase("times of a line reversal", "3x2, shortest times, row2col",
              partial(lasts, rows=3, columns=2, diodes="row2col", **SHORT), 2),
    ProofCase("times of a line reversal", "3x2, long precharge",
              partial(lasts, rows=3, columns=2, precharge_us=12), 2),
    ProofCase("times of a line reversal", "3x2, long release",
              partial(lasts, rows=3, columns=2, **(LONG | {"release_us": 20})), 2),
)  # fmt: skip
