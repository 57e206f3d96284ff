"""The adaptive scanner: rows that are driven together never meet others that are driven."""

from amaranth.hdl import Mux, Signal

from contactfpga.skin import Skin
from contactfpga_hdl.scan.adaptive import AdaptiveScanner
from contactfpga_hdl.util.bits import popcount
from contactfpga_sim.verify.proofs.bugs import Bug
from contactfpga_sim.verify.proofs.case import Case
from contactfpga_sim.verify.proofs.inside import Inside
from contactfpga_sim.verify.proofs.proof import Proof
from contactfpga_sim.verify.proofs.seek import PICK, SEARCH, START, WAIT

ROWS = 2
ALL = (1 << ROWS) - 1


def released_between(proof: Proof) -> None:
    """Free: the columns in each clock, and when rows are taken.

    Claimed: the rows that are driven are all or one, and change to none first; none are driven for the release time at
    least, others for the settle time.
    """
    dut = AdaptiveScanner(Skin(scan="adaptive", rows=ROWS, columns=1, settle_us=1, zone_capacity=1))
    inside = proof.put(dut)
    settled, released = dut.derived.settle_clocks, dut.derived.release_clocks
    proof.m.d.comb += [dut.pins.columns.eq(proof.free(1, "columns")), dut.rows.ready.eq(proof.free(1, "ready"))]
    driven = Signal(ROWS)
    proof.m.d.comb += driven.eq(~dut.pins.rows)
    before = proof.before(driven, init=ALL)
    changes = driven != before
    longest = max(settled, released)
    since = Signal(range(longest + 1), init=longest)  # clocks for which the rows before, or none, were driven
    proof.m.d.sync += since.eq(Mux(changes, 1, Mux(since == longest, longest, since + 1)))
    with proof.m.If(changes):
        proof.claim((driven == 0) | (before == 0))
        proof.claim(since >= Mux(before == 0, released, settled))
    clock, off = inside["clock"], inside["off"]
    proof.lemma((clock < dut.derived.row_clocks) & (since <= longest))
    proof.lemma(off == (driven == 0))
    proof.lemma(~changes | (clock == 0) & (before == 0) | off & (clock == settled) & (before != 0))
    with proof.m.If(off):
        proof.lemma(clock >= settled)
        proof.lemma(Mux(clock == settled, changes & (since >= settled), since == clock - settled))
    with proof.m.Else():
        proof.lemma(Mux(clock == 0, changes & (since >= released) | (since >= settled), 1))
        proof.lemma((clock == 0) | (clock > settled) | (since >= clock))
        proof.lemma((clock < settled) | (driven == ALL) & (since >= settled))
    _seek_lemmas(proof, inside)
    _slot_lemmas(proof, inside, settled, off, driven, since)


def _seek_lemmas(proof: Proof, inside: Inside) -> None:
    state, pattern, alone = inside["seek.choice_state"], inside["seek.pattern"], inside["seek.alone"]
    proof.lemma(inside["seek.listed"] == popcount(inside["seek.on_list"]))
    proof.lemma((inside["seek.level"] == 0) & ((state == SEARCH) | ~inside["seek.searching"]))
    with proof.m.If(state == WAIT):
        proof.lemma((pattern != 0) & (~alone | (pattern != ALL)))
    with proof.m.If(inside["seek.idle"]):
        proof.lemma((state == WAIT) & (pattern == ALL) & ~alone)
        proof.lemma((inside["seek.on_list"] == 0) & (inside["seek.todo"] == 0) & (inside["seek.hits"] == 0))
    with proof.m.If(state == SEARCH):
        proof.lemma((inside["seek.suspects"] != 0) & ~inside["seek.suspected"])


def _slot_lemmas(proof: Proof, inside: Inside, settled: int, off, driven, since) -> None:
    """When in a slot rows are chosen: after its strobe, or where idle rows hit, from the release on."""
    clock, state = inside["clock"], inside["seek.choice_state"]
    pattern, idle, watches = inside["seek.pattern"], inside["seek.idle"], inside["watches"]
    todo, due = inside["seek.todo"], inside["row_due"]
    waits = state == WAIT
    proof.lemma(waits | (clock >= settled) & (clock <= settled + 4))
    proof.lemma((state != START) | (clock == settled + 3))
    proof.lemma((state != SEARCH) | off & ((clock == settled) | (clock == settled + 2)))
    proof.lemma((state != PICK) | (clock > settled))
    chosen = (todo != 0) & ~inside["seek.suspected"]
    proof.lemma((state != PICK) | (clock == settled + 2) | chosen & off)
    proof.lemma(due == Mux(waits, Mux(clock == settled, 1, Mux(clock == settled + 1, 2, 0)), 0))
    with proof.m.If(~off & (clock < settled)):
        proof.lemma(driven == pattern)
    with proof.m.If(~off & (clock >= settled)):
        asleep = (inside["seek.on_list"] == 0) & (todo == 0) & ~inside["seek.suspected"]
        at_rest = waits & idle & (pattern == ALL)
        proof.lemma(Mux(clock == settled + 2, (state == PICK) & asleep, 1))
        proof.lemma(Mux(clock == settled + 3, (state == START) & asleep, 1))
        proof.lemma((clock == settled + 2) | (clock == settled + 3) | at_rest)
    with proof.m.If(watches):
        proof.lemma(~off & (driven == ALL) & (since >= settled))
        proof.lemma(idle | (clock == settled + 2) | (clock == settled + 3))


def _wakes(inside: Inside):
    return inside["strobe"] & inside["seek.idle"] & inside["hit"]


_BUGS = (
    Bug("driven on", AdaptiveScanner, "drive",
        lambda _, inside: inside["clock"] == inside.component.derived.row_clocks - 1),
    Bug("no release", AdaptiveScanner, "release", lambda release, inside: release & ~_wakes(inside)),
    Bug("a short release", AdaptiveScanner, "clock", lambda clock, inside: clock + _wakes(inside)),
)  # fmt: skip
CASES = (Case("a release between rows", "2 rows", released_between, 4, _BUGS, 60),)
