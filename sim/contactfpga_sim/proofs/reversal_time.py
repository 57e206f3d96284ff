"""How long line reversal takes at most: from a frame to the next, and from a touch of an untouched sheet."""

from functools import partial
from typing import Any

from amaranth.hdl import Mux, Signal, Value

from contactfpga_hdl.scan.reversal import ReversalScanner
from contactfpga_hdl.util.popcount import popcount
from contactfpga_sim.proofs.bugs import Bug
from contactfpga_sim.proofs.case import Case
from contactfpga_sim.proofs.proof import Proof
from contactfpga_sim.proofs.reversal import CHARGE, GAP, LISTEN, SELECT, Sheet, pin_lemmas, skin_of, synchronizer_lemmas
from contactfpga_sim.proofs.reversal_frames import Frames, keep_frames

PACKED = 6
"""Clocks from when a frame's last row is taken until it is packed, at most."""
HANDED = 5
"""Clocks from a row's sample until it is taken, and an empty one after it, with that clock."""


class Prompt:
    """Each row is taken at once, and each frame is packed ``PACKED`` clocks after its last row at the latest."""

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
        self.first = derived.settle_clocks + 4
        self.end = max(derived.project_clocks + 2, PACKED + 3)

    def frame(self, rows) -> Value:
        """The most clocks from the begin of a frame with so many rows, one at least, to that of the next."""
        return self.first + (rows - 1) * self.slot + self.end


def next_frame(proof: Proof, **changes: Any) -> None:
    """Free: the sheet. Assumed: rows are taken at once, and frames packed soon; see ``Prompt``.

    Claimed: the frame after one with n rows, n > 0, begins ``Prompt.frame(n)`` clocks after it at the latest. When
    nothing was touched, and a row reads touched, a frame that includes what the pins read then begins
    ``2 + project`` clocks later at the latest, or 3 after another frame was packed.
    """
    sheet = Sheet(proof, skin_of(**changes))
    spec = Frames(sheet)
    prompt = Prompt(sheet, spec)
    m, rows = proof.m, sheet.skin.rows
    longest = prompt.first + (rows - 1) * prompt.slot + prompt.end
    since, bound = Signal(range(longest + 2)), Signal(range(longest + 1))  # 0: no frame with a row was the last one
    with m.If(sheet.begins):
        count = popcount(sheet.wanted)
        m.d.sync += [since.eq(sheet.wanted.any()), bound.eq(Mux(sheet.wanted.any(), prompt.frame(count), 0)[: len(bound)])]
    with m.Elif(since != 0):
        m.d.sync += since.eq(since + 1)
    proof.claim(since <= bound)
    awake = Signal(range(PACKED + 8 + sheet.dut.derived.project_clocks))
    with m.If((awake == 0) | sheet.begins & (awake >= 2)):
        m.d.sync += awake.eq(sheet.inside["rests"] & (sheet.read != 0) & ~(sheet.begins & (awake >= 2)))
    with m.Else():
        m.d.sync += awake.eq(awake + 1)
    proof.claim(awake <= max(2 + sheet.dut.derived.project_clocks, 3 + PACKED))
    keep_frames(sheet, spec)
    _frame_time_lemmas(sheet, spec, prompt, since, bound)
    _awake_lemmas(sheet, spec, prompt, awake, since)


def _frame_time_lemmas(sheet: Sheet, spec: Frames, prompt: Prompt, since, bound) -> None:
    """What is left of the frame, in each state."""
    proof, derived, inside = sheet.proof, sheet.dut.derived, sheet.inside
    state, clock, due, todo = sheet.state, sheet.clock, inside["due"], inside["todo"]
    handing = Signal(range(8))  # until no row waits
    packing = Signal(range(PACKED + 8))  # until a frame may begin
    m = proof.m
    with m.If(due != 0):
        m.d.comb += [handing.eq(5 - due), packing.eq(PACKED + 4 - due)]
    with m.Elif(sheet.dut.rows.valid):
        m.d.comb += [handing.eq(1 + inside["follows"]), packing.eq(PACKED + 1)]
    with m.Elif(spec.packing):
        m.d.comb += packing.eq(PACKED - prompt.waited)
    slots = popcount(todo) * prompt.slot
    select, settled = derived.settle_clocks + 1, derived.project_clocks + 2
    proof.lemma(prompt.waited < PACKED)
    proof.lemma(spec.packing | (prompt.waited == 0))
    proof.lemma((since != 0) | (state == LISTEN))
    with m.If(since != 0):
        with m.If(state == CHARGE):
            charge = derived.release_clocks - 3 - clock
            more = Mux(charge > handing, charge, handing)
            proof.lemma(since + more + 2 + select + slots - prompt.slot + prompt.end <= bound)
        with m.Elif(state == GAP):
            proof.lemma(since + 1 + select + slots - prompt.slot + prompt.end <= bound)
        with m.Elif(state == SELECT):
            rest = Mux(clock <= 1, slots - prompt.slot, slots)
            proof.lemma(since + derived.settle_clocks - clock + 1 + rest + prompt.end <= bound)
        with m.Else():
            listens = settled - clock
            proof.lemma(since + Mux(listens > packing, listens, packing) <= bound)
            proof.lemma(~inside["rests"])


def _awake_lemmas(sheet: Sheet, spec: Frames, prompt: Prompt, awake, since) -> None:
    proof, clock, rests = sheet.proof, sheet.clock, sheet.inside["rests"]
    project = sheet.dut.derived.project_clocks
    with proof.m.If(awake != 0):
        proof.lemma((sheet.state == LISTEN) & (since == 0))
        proof.lemma(rests | (awake >= 1))
        proof.lemma(~rests | (awake <= 2))


def rises(proof: Proof, **changes: Any) -> None:
    """Free: the sheet, and when rows are taken. Assumed: no frame is packed before its last row is taken.

    Claimed: when a row reads touched at the pins while an untouched sheet is watched, ``contact`` is high three clocks
    later.
    """
    sheet = Sheet(proof, skin_of(**changes))
    spec = Frames(sheet)
    touch = sheet.inside["rests"] & (sheet.read != 0)
    proof.claim(~proof.before(proof.before(proof.before(touch))) | sheet.dut.contact)
    keep_frames(sheet, spec)


CASES = (
    Case("the next frame in time", "3x2", partial(next_frame, rows=3, columns=2), 2, (), 40),
    Case("contact in three clocks", "3x2", partial(rises, rows=3, columns=2), 3, (), 12),
)
