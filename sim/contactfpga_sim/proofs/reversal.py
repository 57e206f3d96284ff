"""Line reversal: pins never meet, each touched row is driven and handed on once, and no closed switch is missed."""

from functools import partial
from typing import Any

from amaranth.hdl import Const, Mux, Signal

from contactfpga.skin import Skin
from contactfpga_hdl.scan.pins import released_levels
from contactfpga_hdl.scan.precharge import Precharge
from contactfpga_hdl.scan.reversal import ReversalScanner
from contactfpga_hdl.scan.stuck import present
from contactfpga_sim.proofs.bugs import Bug
from contactfpga_sim.proofs.case import Case
from contactfpga_sim.proofs.precharge import apart
from contactfpga_sim.proofs.proof import Proof

LISTEN, CHARGE, GAP, SELECT = range(4)  # in the order in which the source names them


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
        self.read_1 = proof.before(self.read)
        self.read_2 = proof.before(self.read_1)
        released = released_levels(skin, skin.columns)
        columns_1 = proof.before(self.columns, init=released)
        columns_2 = proof.before(columns_1, init=released)
        self.columns_before = columns_1, columns_2
        self.pressed_1 = ~columns_1 if skin.selects_low else columns_1
        self.pressed_2 = ~columns_2 if skin.selects_low else columns_2
        counts = sum(1 << row for row in range(skin.rows) if present(skin, row))
        self.wanted = Signal(skin.rows)
        m.d.comb += self.wanted.eq(self.read_2 & counts | busy)
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
    pin_lemmas(sheet)


def pin_lemmas(sheet: Sheet) -> None:
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


def synchronizer_lemmas(sheet: Sheet) -> None:
    """What is in the synchronizers of columns and rows."""
    inside, flip = sheet.inside, 0 if sheet.skin.selects_low else -1
    for stage, seen in enumerate((sheet.read_1, sheet.read_2)):
        sheet.proof.lemma(inside[f"rows.stage{stage}"] == (seen ^ flip)[: sheet.skin.rows])
        sheet.proof.lemma(inside[f"reader.sync.stage{stage}"] == sheet.columns_before[stage])


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
CASES = (
    Case("pins never meet", "3x2, col2row", partial(pins, rows=3, columns=2, diodes="col2row"), 2, _PIN_BUGS, 16),
    Case("pins never meet", "3x2, row2col", partial(pins, rows=3, columns=2, diodes="row2col"), 2),
    Case("pins never meet", "2x1, shortest times",
         partial(pins, rows=2, columns=1, settle_us=1, release_us=1, precharge_us=1, project_us=1), 2),
)  # fmt: skip
