"""The self-test of line reversal."""

from functools import partial
from typing import Any

from amaranth.hdl import Cat, Const, Mux, Signal, Value

from contactfpga_hdl.scan.reversal_cycle import ReversalCycle
from contactfpga_hdl.scan.self_test import SEEN, SelfTest
from contactfpga_sim.verify.proofs.case import Bug, ProofCase
from contactfpga_sim.verify.proofs.precharge import apart
from contactfpga_sim.verify.proofs.proof import Proof
from contactfpga_sim.verify.proofs.reversal import SHORT, Sheet, skin_of, synchronizer_lemmas

LISTEN, TEST, CHARGE, GAP, SELECT = range(5)  # in the order in which the source names them
REST, IN_GAP, DISCHARGE, LET_GO, DRIVE, SEE = range(6)


class SelfTestScan:
    """The scan with a self-test, and its pins."""

    def __init__(self, proof: Proof, **changes: Any):
        self.proof = proof
        self.sheet = sheet = Sheet(proof, skin_of(self_test=True, **changes))
        pins, skin = sheet.dut.pins, sheet.skin
        proof.m.d.comb += [
            sheet.dut.command.eq(proof.free(1, "command")),
            sheet.dut.slots.ready.eq(proof.free(1, "slot_ready")),
        ]
        selecting = Signal()  # the level of columns that are driven
        proof.m.d.comb += selecting.eq(pins.columns_level != int(skin.selects_low))
        self.selecting = selecting
        self.driven = Signal(skin.rows + skin.columns)
        self.released = Signal(skin.rows + skin.columns)
        columns = Mux(selecting, 0, pins.columns_drive)
        proof.m.d.comb += [
            self.driven.eq(Cat(pins.rows_drive, pins.columns_drive)),
            self.released.eq(Cat(pins.rows_drive & ~sheet.selected, columns)),
        ]
        self.discharges = Signal()
        proof.m.d.comb += self.discharges.eq(selecting & pins.columns_drive.any())
        self.tests_1 = proof.before(sheet.inside["cycle.tests"])
        self.ends = sheet.inside["test.ends"]

    def line(self) -> Value:
        """Line of the next or current slot."""
        lines = len(self.driven)
        return (Const(1, 1) << self.sheet.inside["test.number"])[1 : lines + 1]


def one_line(proof: Proof, **changes: Any) -> None:
    """Free: the sheet, commands, and the later stages.

    Claimed: columns at the released level and rows at the selecting one are driven in separate clocks. Two or more
    lines are at the selecting level only while none is at the other. In a slot either all driven lines are at the
    selecting level, for the projection time, or one line alone is driven to the released level, for the settle time; a
    clock without a driven line is between.
    """
    scan = SelfTestScan(proof, **changes)
    m, sheet, skin = proof.m, scan.sheet, scan.sheet.skin
    selected, derived = sheet.selected, sheet.dut.derived
    apart(proof, scan.released[skin.rows :], selected)
    proof.claim(~scan.discharges | (scan.released == 0))
    proof.claim((selected & (selected - 1) == 0) | scan.discharges)
    alone = Signal()
    m.d.comb += alone.eq(scan.released.any())
    with m.If(scan.tests_1):
        proof.claim(scan.released & (scan.released - 1) == 0)
        proof.claim(~alone | (scan.driven == scan.released))
        proof.claim(~(alone & proof.before(scan.discharges)))
    discharged, driven = Signal(range(derived.project_clocks + 2)), Signal(range(derived.settle_clocks + 2))
    m.d.sync += [
        discharged.eq(Mux(scan.discharges, discharged + 1, 0)),
        driven.eq(Mux(scan.tests_1 & alone, driven + 1, 0)),
    ]
    proof.claim(~scan.discharges | (discharged < derived.project_clocks))
    proof.claim(~(scan.tests_1 & alone) | (driven < derived.settle_clocks))
    pin_lemmas(scan)
    slot, clock = sheet.inside["test.slot_state"], sheet.inside["test.clock"]
    project = derived.project_clocks
    after = Mux(slot == LET_GO, project - 1, Mux((slot == DRIVE) & (clock == 0), project, 0))
    proof.lemma(discharged == Mux((slot == DISCHARGE) & (clock != 0), clock - 1, after))
    in_see = (slot == SEE) & (driven <= derived.settle_clocks - 1 + clock)
    proof.lemma((driven == 0) | (slot == DRIVE) & (driven < clock) | in_see)


def pin_lemmas(scan: SelfTestScan) -> None:
    proof, sheet, inside = scan.proof, scan.sheet, scan.sheet.inside
    skin, derived, state, clock = sheet.skin, sheet.dut.derived, sheet.state, sheet.clock
    slot, slot_clock, before = inside["test.slot_state"], inside["test.clock"], proof.before(state, init=LISTEN)
    slot_before = proof.before(slot, init=REST)
    selects = (state == SELECT) & (clock != 0)
    proof.lemma(state <= SELECT)
    proof.lemma(slot <= SEE)
    proof.lemma((state == TEST) == (slot != REST))
    every, discharged = (1 << skin.rows) - 1, slot_before == DISCHARGE
    alone = Mux(slot_before == DRIVE, proof.before(scan.line()), 0)
    selected = Mux(selects, (Const(1, skin.rows) << inside["cycle.y"])[: skin.rows], 0)
    proof.lemma(inside["cycle.selected"] == Mux(discharged, every, selected))
    charged = Mux(discharged, (1 << skin.columns) - 1, alone[skin.rows :])
    proof.lemma((before == LISTEN) | (before == CHARGE) | (inside["precharge.pins"] == charged))
    proof.lemma((slot_before == REST) == (before != TEST))
    holds = (before != LISTEN) & (before != TEST) & proof.before(1)
    proof.lemma(inside["drives"] == Mux(holds | discharged, every, alone[: skin.rows]))
    proof.lemma(inside["inverted"] == discharged)
    proof.lemma((state != SELECT) | (before == Mux(clock == 0, GAP, SELECT)) & (clock <= derived.settle_clocks))
    proof.lemma((state != GAP) | (before == CHARGE))
    proof.lemma((before != TEST) | (state == TEST) | (state == LISTEN))
    proof.lemma((state != TEST) | (before == Mux(slot == IN_GAP, LISTEN, TEST)))
    proof.lemma((slot != DISCHARGE) | (slot_before == Mux(slot_clock == 0, IN_GAP, DISCHARGE)))
    proof.lemma((slot != DISCHARGE) | (slot_clock < derived.project_clocks))
    proof.lemma((slot != LET_GO) | (slot_before == DISCHARGE) & (slot_clock == 0))
    proof.lemma((slot != DRIVE) | (slot_before == Mux(slot_clock == 0, LET_GO, DRIVE)))
    proof.lemma((slot != DRIVE) | (slot_clock < derived.settle_clocks))
    proof.lemma((slot != SEE) | (slot_before == Mux(slot_clock == 0, DRIVE, SEE)) & (slot_clock <= SEEN))
    proof.lemma((slot != REST) | (slot_before == REST) | (slot_before == SEE))
    proof.lemma((slot != IN_GAP) | (slot_before == REST))


def shown(proof: Proof, **changes: Any) -> None:
    """Free as in :func:`one_line`. Claimed: a sent slot has the pins' levels in the last clock in which its line was
    driven, and stays until it is taken; numbers are in order."""
    scan = SelfTestScan(proof, **changes)
    m, sheet, skin = proof.m, scan.sheet, scan.sheet.skin
    slots, number = sheet.dut.slots, sheet.inside["test.number"]
    read, released = sheet.read_2[: skin.rows], ~sheet.pressed_2
    payload = slots.payload.as_value()
    expected = Cat(read, released)
    judged = proof.before(scan.ends)
    alone_1 = proof.before(proof.before(sheet.inside["test.alone"]))
    alone_2 = proof.before(alone_1)
    alone_3 = proof.before(alone_2)
    lines = payload[-len(scan.driven) :]
    with m.If(judged):
        proof.claim(lines == proof.before(expected))
        proof.claim(alone_3 == proof.before(scan.line()))
        proof.claim(alone_2 == 0)
    with m.If(proof.before(slots.valid & ~slots.ready)):
        proof.claim(slots.valid & (payload == proof.before(payload)))
    lasts = proof.before(number)
    proof.claim((number == lasts) | (number == lasts + 1) | (number == 0))
    pin_lemmas(scan)
    synchronizer_lemmas(sheet)
    _shown_lemmas(scan, alone_1, alone_2)


def _shown_lemmas(scan: SelfTestScan, alone_1: Signal, alone_2: Signal) -> None:
    proof, inside = scan.proof, scan.sheet.inside
    slot, clock, asks = inside["test.slot_state"], inside["test.clock"], inside["test.asks"]
    number = inside["test.number"]
    proof.lemma((slot == REST) | asks)
    proof.lemma(~scan.sheet.dut.slots.valid | inside["test.tells"] & ~asks)
    proof.lemma(~(asks | scan.sheet.dut.slots.valid) | (number <= len(scan.driven)))
    proof.lemma(number <= len(scan.driven) + 1)
    with proof.m.If((slot == SEE) & (clock == 1)):
        proof.lemma(alone_1 == scan.line())
    with proof.m.If((slot == SEE) & (clock == SEEN)):
        proof.lemma((alone_2 == scan.line()) & (alone_1 == 0))
    line_before = proof.before(scan.line())
    with proof.m.If(((slot == DRIVE) & (clock != 0)) | (slot == SEE)):
        proof.lemma(line_before == scan.line())


_BUGS = (
    Bug("two lines at once", SelfTest, "alone", lambda alone, _: alone | alone << 1),
    Bug("no gap before a line", SelfTest, "discharges",
        lambda discharges, inside: discharges | (inside["slot_state"] == LET_GO)),
    Bug("columns are charged meanwhile", ReversalCycle, "charges",
        lambda charges, inside: charges | (inside["cycle_state"] == TEST)),
    Bug("rows are held meanwhile", ReversalCycle, "listens",
        lambda listens, inside: listens & (inside["cycle_state"] != TEST)),
    Bug("no gap before the discharge", SelfTest, "discharges",
        lambda discharges, inside: discharges | (inside["slot_state"] == IN_GAP)),
    Bug("driven for a clock more", SelfTest, "alone",
        lambda alone, inside: Mux((inside["slot_state"] == SEE) & (inside["clock"] == 0), inside["line"], alone)),
)  # fmt: skip
_SHOWN_BUGS = (
    Bug("read too late", SelfTest, "judges", lambda _, inside: (inside["slot_state"] == SEE) & (inside["clock"] == 1)),
    Bug("taken over by the next", SelfTest, "asks", lambda asks, inside: 1),
    Bug("a slot is skipped", SelfTest, "number", lambda number, inside: number + inside["over"]),
)  # fmt: skip
CASES = (
    ProofCase("one line is driven alone", "2x2, col2row", partial(one_line, rows=2, columns=2), 2, _BUGS, 30),
    ProofCase("one line is driven alone", "2x1, row2col, shortest times",
              partial(one_line, rows=2, columns=1, diodes="row2col", **SHORT), 2),
    ProofCase("slots are what the pins showed", "2x2", partial(shown, rows=2, columns=2, **SHORT), 2, _SHOWN_BUGS, 40),
)  # fmt: skip
