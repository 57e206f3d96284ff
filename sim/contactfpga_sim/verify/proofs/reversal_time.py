"""Longest times of line reversal: between frames, and from a touch."""

from functools import partial
from typing import Any

from amaranth.hdl import Mux, Signal, Value

from contactfpga_hdl.scan.reversal import ReversalScanner
from contactfpga_hdl.scan.reversal_cycle import ReversalCycle
from contactfpga_hdl.scan.reversal_rows import Contact
from contactfpga_hdl.util.bits import popcount
from contactfpga_sim.verify.proofs.case import Bug, ProofCase
from contactfpga_sim.verify.proofs.inside import Inside
from contactfpga_sim.verify.proofs.proof import Proof
from contactfpga_sim.verify.proofs.reversal import CHARGE, GAP, LISTEN, LONG, SELECT, SHORT, Sheet, skin_of
from contactfpga_sim.verify.proofs.reversal_frames import Frames, keep_frames
from contactfpga_sim.verify.proofs.reversal_reach import Report, Switch, closed_lemmas

PACKED = 6
"""Most clocks from taking a frame's last row until it is packed."""
HANDED = 5
"""Clocks from a row's sample until it, and an empty row after it, are taken, inclusive."""


class Prompt:
    """Stages that take each row at once, and pack each frame within ``PACKED`` clocks of its last row."""

    def __init__(self, sheet: Sheet, spec: Frames):
        proof, derived = sheet.proof, sheet.dut.derived
        self.waited = Signal(range(PACKED + 1))  # clocks since the last row was taken, but for the first
        with proof.m.If(spec.packing & ~sheet.packed):
            proof.m.d.sync += self.waited.eq(self.waited + 1)
        with proof.m.Else():
            proof.m.d.sync += self.waited.eq(0)
        proof.given(sheet.dut.rows.ready)
        proof.given(~spec.packing | sheet.packed | (self.waited < PACKED - 1))
        self.slot = max(derived.release_clocks - 2, HANDED) + derived.settle_clocks + 2
        self.first = derived.settle_clocks + max(4, derived.precharge_clocks - derived.project_clocks)
        self.end = max(derived.project_clocks + 2, PACKED + 3)

        self.longest: int = self.frame(sheet.skin.rows)

    def frame(self, rows):
        """Most clocks between the beginnings of a frame of ``rows`` rows, at least one, and the next."""
        return self.first + (rows - 1) * self.slot + self.end


def _frame_time(sheet: Sheet, prompt: Prompt) -> tuple[Signal, Signal]:
    m, longest = sheet.proof.m, prompt.longest
    since, bound = Signal(range(longest + 2)), Signal(range(longest + 1))
    count = popcount(sheet.wanted)
    with m.If(sheet.begins):
        m.d.sync += since.eq(count != 0)
        m.d.sync += bound.eq(Mux(count != 0, prompt.frame(count), 0)[: len(bound)])
    with m.Elif(since != 0):
        m.d.sync += since.eq(since + 1)
    return since, bound


def next_frame(proof: Proof, **changes: Any) -> None:
    """Free: the sheet. Assumed: rows are taken at once, and frames packed soon; see ``Prompt``.

    Claimed: the frame after one with n rows, n > 0, begins at most ``Prompt.frame(n)`` clocks after it. When nothing
    was touched and a row reads touched, a frame with the pins' readings begins at most ``2 + project`` clocks later,
    or, if another was under way or began before, ``3 + PACKED``.
    """
    sheet = Sheet(proof, skin_of(**changes))
    spec = Frames(sheet)
    prompt = Prompt(sheet, spec)
    m = proof.m
    since, bound = _frame_time(sheet, prompt)
    proof.claim(since <= bound)
    awake = Signal(range(PACKED + 8 + sheet.dut.derived.project_clocks))  # clocks since a touch that the solver chooses
    alone = Signal()  # no frame has been under way since
    with m.If(awake == 0):
        m.d.sync += alone.eq(1)
    with m.If(spec.underway | spec.packing | sheet.begins):
        m.d.sync += alone.eq(0)
    with m.If(sheet.begins & ((awake >= 2) | sheet.wanted.any())):
        m.d.sync += awake.eq(0)
    with m.Elif(awake == 0):
        m.d.sync += awake.eq(proof.free(1, "this_touch") & sheet.inside["cycle.rests"] & sheet.read.any())
    with m.Else():
        m.d.sync += awake.eq(awake + 1)
    reach = 2 + sheet.dut.derived.project_clocks
    proof.claim((awake <= reach) | ~alone & (awake <= 3 + PACKED))
    keep_frames(sheet, spec)
    packing = _packing(sheet, spec, prompt)
    _frame_time_lemmas(sheet, prompt, packing, since, bound)
    _awake_lemmas(sheet, spec, packing, awake, alone, since)


def _packing(sheet: Sheet, spec: Frames, prompt: Prompt) -> Value:
    m, due = sheet.proof.m, sheet.inside["cycle.due"]
    packing = Signal(range(PACKED + 8))
    with m.If(due != 0):
        m.d.comb += packing.eq(PACKED + 4 - due)
    with m.Elif(sheet.dut.rows.valid):
        m.d.comb += packing.eq(PACKED + 1)
    with m.Elif(spec.packing):
        m.d.comb += packing.eq(PACKED - prompt.waited)
    sheet.proof.lemma(prompt.waited < PACKED)
    sheet.proof.lemma(spec.packing | (prompt.waited == 0))
    return packing


def _handing(sheet: Sheet) -> Value:
    m, due = sheet.proof.m, sheet.inside["cycle.due"]
    handing = Signal(range(8))
    with m.If(due != 0):
        m.d.comb += handing.eq(5 - due)
    with m.Elif(sheet.dut.rows.valid):
        m.d.comb += handing.eq(1 + sheet.inside["offer.follows"])
    return handing


def _frame_time_lemmas(sheet: Sheet, prompt: Prompt, packing, since, bound) -> None:
    m, proof, derived, inside = sheet.proof.m, sheet.proof, sheet.dut.derived, sheet.inside
    clock, handing = sheet.clock, _handing(sheet)
    after = popcount(inside["cycle.todo"]) * prompt.slot + prompt.end
    row = derived.settle_clocks + 1
    proof.lemma((since != 0) | (sheet.state == LISTEN))
    left = Signal(range(1 << len(bound)))
    with m.Switch(sheet.state):
        with m.Case(CHARGE):
            charge = derived.release_clocks - 3 - clock
            m.d.comb += left.eq(Mux(charge > handing, charge, handing) + 2 + row + after - prompt.slot)
        with m.Case(GAP):
            m.d.comb += left.eq(1 + row + after - prompt.slot)
        with m.Case(SELECT):
            m.d.comb += left.eq(row - clock + after - Mux(clock <= 1, prompt.slot, 0))
        with m.Case(LISTEN):
            listens = derived.project_clocks + 2 - clock
            m.d.comb += left.eq(Mux(listens > packing, listens, packing))
    proof.lemma((since == 0) | (since + left <= bound) & ~inside["cycle.rests"])


def _awake_lemmas(sheet: Sheet, spec: Frames, packing, awake, alone, since) -> None:
    proof, rests, project = sheet.proof, sheet.inside["cycle.rests"], sheet.dut.derived.project_clocks
    with proof.m.If(awake != 0):
        proof.lemma((sheet.state == LISTEN) & (since == 0))
        proof.lemma(rests | (awake <= sheet.clock) | (sheet.clock == project + 2))
        proof.lemma(~(alone & (spec.underway | spec.packing)))
        proof.lemma((packing == 0) | (awake + packing <= PACKED + 3))
        proof.lemma(~rests | (awake <= 2))
        proof.lemma((awake != 1) | sheet.read_1.any())
        proof.lemma((awake != 2) | sheet.read_2.any())


def in_two_frames(proof: Proof, **changes: Any) -> None:
    """Free: one switch and all other pin readings. Assumed: see ``Prompt`` and ``Switch``.

    Claimed: a switch that stays closed is offered within two frames of all rows, less ``PACKED``; and again and again.
    """
    m = proof.m
    sheet = Sheet(proof, skin_of(**changes))
    spec, switch = Frames(sheet), Switch(sheet)
    report, prompt = Report(sheet, spec, switch), Prompt(sheet, spec)
    since, bound = _frame_time(sheet, prompt)
    most = 2 * prompt.longest - PACKED
    age = Signal(range(most + 2))  # clocks for which the switch was closed, and not offered
    m.d.sync += age.eq(Mux(switch.closed & ~report.offered, age + 1, 0))
    proof.claim(age <= most)
    keep_frames(sheet, spec)
    closed_lemmas(sheet, spec, switch, report)
    packing = _packing(sheet, spec, prompt)
    _frame_time_lemmas(sheet, prompt, packing, since, bound)
    _age_lemmas(sheet, switch, report, prompt, spec.underway, packing, age, since, bound)


def _age_lemmas(
    sheet: Sheet, switch: Switch, report: Report, prompt: Prompt, underway, packing, age, since, bound
) -> None:
    proof, rests, clock = sheet.proof, sheet.inside["cycle.rests"], sheet.clock
    listened = sheet.dut.derived.project_clocks + 2
    proof.lemma(bound <= prompt.longest)
    proof.lemma(~report.due | report.reported | underway)
    proof.lemma((age == 0) | switch.closed_1)
    proof.lemma((age <= 1) | switch.closed_2)
    with proof.m.If(since == 0):
        proof.lemma(~rests | (age <= 2))
        proof.lemma(rests | (age <= clock) | (clock == listened))
        proof.lemma((packing == 0) | (age + packing <= PACKED + 3))
        proof.lemma(age <= max(listened, PACKED + 3))
    with proof.m.Elif(report.due & ~report.reported):
        proof.lemma(age <= since + prompt.longest + 1)
    with proof.m.Else():
        proof.lemma(age <= since + 1)


def rises(proof: Proof, **changes: Any) -> None:
    """Free: the sheet, and when rows are taken. Assumed: no frame is packed before its last row is taken.

    Claimed: when a row of a watched untouched sheet reads touched at the pins, ``contact`` is high three clocks later.
    """
    sheet = Sheet(proof, skin_of(**changes))
    spec = Frames(sheet)
    touch = sheet.inside["cycle.rests"] & (sheet.read != 0)
    proof.claim(~proof.before(proof.before(proof.before(touch))) | sheet.dut.contact)
    keep_frames(sheet, spec)


def fault_reports(proof: Proof, **changes: Any) -> None:
    """Free: the sheet, and when rows are taken. Assumed: no frame is packed before its last row is taken.

    Claimed: while the sheet rests, nothing reads touched and the last frame is packed, its flag differs from whether a
    column is stuck for at most two clocks; then a frame begins. Its flag, from three clocks later on, is what was known
    in the clock after it began.
    """
    sheet = Sheet(proof, skin_of(**changes))
    spec, dut = Frames(sheet), sheet.dut
    idle = sheet.inside["cycle.rests"] & ~(spec.underway | spec.packing) & (sheet.wanted == 0)
    differs, begun = Signal(), proof.before(proof.before(sheet.begins))
    proof.m.d.comb += differs.eq(idle & (dut.stuck != dut.tag.fault))
    earlier = proof.before(differs)
    proof.claim(~(differs & earlier & proof.before(earlier)))
    proof.claim(~proof.before(begun) | (dut.tag.fault == proof.before(proof.before(dut.stuck))))
    proof.claim(dut.stuck == sheet.inside.part("precharge").held[: sheet.skin.columns].any())
    keep_frames(sheet, spec)


def _wakes_alone(inside: Inside):
    return inside["rests"] & inside["settled"] & inside["touched"][0]


def _wakes(inside: Inside):
    return inside["rests"] & inside["touched"].any()


_NEXT_BUGS = (
    Bug("rests though something is touched", ReversalCycle, "rests", lambda rests, inside: rests | inside["begins"]),
    Bug("waits for nothing", ReversalCycle, "waits", lambda waits, inside: waits | inside["touched"].any()),
    Bug("does not wake", ReversalCycle, "rests", lambda rests, inside: rests | inside["rests"]),
    Bug("listens anew once awake", ReversalCycle, "clock", lambda clock, inside: Mux(_wakes(inside), 0, clock)),
    Bug("driven for a clock more", ReversalCycle, "clock",
        lambda clock, inside: clock
        - ((inside["cycle_state"] == SELECT) & (inside["todo"] & inside["selected"]).any())),
)  # fmt: skip
_TWO_BUGS = (
    Bug("does not wake", ReversalCycle, "rests", lambda rests, inside: rests | inside["rests"]),
    Bug("one row at most", ReversalCycle, "todo",
        lambda rows, inside: Mux(inside["begins"], rows & (~rows + 1), rows)),
)  # fmt: skip
_CONTACT_BUGS = (
    Bug("with the row", Contact, "contact",
        lambda contact, inside: Mux(inside["strobe"] | inside["contact"], contact, 0)),
    Bug("for one clock", Contact, "contact", lambda contact, inside: contact & ~inside["contact"]),
    Bug("of row 0 alone", ReversalScanner, "wakes", lambda _, inside: _wakes_alone(inside)),
)  # fmt: skip
_REPORT_BUGS = (
    Bug("with the next frame", ReversalScanner, "changed", lambda *_: 0),
    Bug("of column 0 alone", ReversalScanner, "stuck", lambda _, inside: inside.part("precharge").held[0]),
    Bug("a frame late", ReversalScanner, "begun", lambda _, inside: inside["rows__valid"]),
)
CASES = (
    ProofCase("the next frame in time", "2x2", partial(next_frame, rows=2, columns=2, **SHORT), 2, _NEXT_BUGS, 32),
    ProofCase("the next frame in time", "3x2, debounced",
              partial(next_frame, rows=3, columns=2, debounce="sym_defer_pk"), 2),
    ProofCase("the next frame in time", "8x2, long times",
              partial(next_frame, rows=8, columns=2, **LONG), 2),
    ProofCase("the next frame in time", "3x2, long precharge",
              partial(next_frame, rows=3, columns=2, precharge_us=12), 2),
    ProofCase("reported within two frames", "2x2", partial(in_two_frames, rows=2, columns=2, **SHORT), 2,
              _TWO_BUGS, 54),
    ProofCase("reported within two frames", "3x2, debounced",
              partial(in_two_frames, rows=3, columns=2, debounce="sym_defer_pk"), 2),
    ProofCase("contact in three clocks", "3x2", partial(rises, rows=3, columns=2), 3, _CONTACT_BUGS),
    ProofCase("contact in three clocks", "3x2, shortest times, row2col",
              partial(rises, rows=3, columns=2, diodes="row2col", **SHORT), 3),
    ProofCase("faults are reported at once", "3x2", partial(fault_reports, rows=3, columns=2), 4, _REPORT_BUGS, 100),
)  # fmt: skip
