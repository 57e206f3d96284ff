"""The adaptive scan's choice of rows, without contention."""

from functools import partial

from amaranth.hdl import Const, Mux, Signal

from contactfpga.skin import Skin
from contactfpga_hdl.scan.adaptive import AdaptiveScanner
from contactfpga_hdl.scan.seek import Seek
from contactfpga_hdl.util.bits import popcount
from contactfpga_sim.verify.proofs.case import Bug, ProofCase
from contactfpga_sim.verify.proofs.inside import Inside
from contactfpga_sim.verify.proofs.proof import Proof

ROWS = 2
ALL = (1 << ROWS) - 1


def released_between(proof: Proof) -> None:
    """Free: the columns, and when rows are taken.

    Claimed: all rows or one are driven; between two choices none are, for at least the release time; others are driven
    for the settle time.
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


WAIT, PICK, SEARCH, START = range(4)  # in the order in which the source names them


def frames(proof: Proof, rows: int) -> None:
    """Free: whether each slot hits, and whether its row is busy; when a strobe comes once rows are chosen.

    Assumed: a frame's rows are handed on before the next one's first strobe, by the Skin's limits.

    Claimed: each slot drives unknown rows, one if alone, in ascending order; after a frame's last slot every row is
    known; a frame has at most ``2 rows - 1`` slots, and ``rows + 2 ceil(log2 rows) + 2``.
    """
    m = proof.m
    dut = Seek(Skin(scan="adaptive", rows=rows, columns=1, settle_us=20))
    inside = proof.put(dut)
    state, everything = inside["choice_state"], (1 << rows) - 1
    m.d.comb += [
        dut.strobe.eq(proof.free(1, "strobe") & (state == WAIT)),
        dut.hit.eq(proof.free(1, "hit")),
        dut.busy.eq(proof.free(1, "busy")),
        dut.clear.eq(proof.before(dut.ends)),
    ]
    known, alone = Signal(rows), Signal(rows)  # of this frame, counted apart
    last = Signal(rows)  # driven alone, one-hot
    probes = Signal(range(2 * rows))
    with m.If(dut.strobe):
        m.d.sync += known.eq(known | Mux(dut.alone | ~dut.hit, dut.pattern, 0))
        with m.If(dut.alone):
            m.d.sync += [alone.eq(alone | dut.pattern), last.eq(dut.pattern)]
        with m.Else():
            m.d.sync += probes.eq(probes + 1)
        proof.claim(dut.pattern != 0)
        proof.claim(dut.pattern & known == 0)
        proof.claim(~dut.alone | (dut.pattern & (dut.pattern - 1) == 0) & (dut.pattern > last))
        proof.claim(probes + popcount(alone) < 2 * rows - 1)
        proof.claim(probes + popcount(alone) < dut.derived.max_frame_slots)
        proof.claim(~dut.idle | (dut.pattern == everything) & ~dut.alone)
    with m.If(dut.ends):
        proof.claim(known == everything)
        m.d.sync += [known.eq(0), alone.eq(0), last.eq(0), probes.eq(0)]
    _choice_lemmas(proof, inside, dut, state, known, alone, last, probes)


def _choice_lemmas(proof: Proof, inside: Inside, dut: Seek, state, known, alone, last, probes) -> None:
    rows, everything = dut.skin.rows, (1 << dut.skin.rows) - 1
    todo, suspects, spare = inside["todo"], inside["suspects"], inside["spare"]
    searching, level = inside["searching"], inside["level"]
    starts = state == START
    rest = (~known & ~todo)[:rows]
    above = rest & ~suspects
    waits = state == WAIT
    probing = waits & ~dut.alone
    searched = (state == SEARCH) | waits & searching
    proof.lemma(dut.known == Mux(starts, everything, known))
    proof.lemma(alone & ~known == 0)
    proof.lemma((known & (last | last - 1)[:rows] == (last | last - 1)[:rows]) | (last == 0))
    proof.lemma((last & (last - 1))[:rows] == 0)
    proof.lemma(inside["listed"] == popcount(inside["on_list"]))
    proof.lemma(starts | (probes + spare + probing <= rows - 1))
    proof.lemma(inside["hits"] <= 2)
    levels = dut.derived.row_levels
    searches = inside["hits"] * levels - Mux(searching, level, 0)
    proof.lemma(starts | (probes <= searches + (rest == 0)))
    with proof.m.If(starts):
        proof.lemma((known == 0) & (probes == 0) & (alone == 0) & (last == 0))
    with proof.m.Else():
        proof.lemma(todo & known == 0)
        proof.lemma((above == 0) | ((above & -above)[:rows] > suspects))
        proof.lemma(searching == searched)
        proof.lemma(Mux(searching, suspects & ~rest, suspects & ~todo) == 0)
        proof.lemma((~dut.idle | waits) & ~(waits & searching & dut.alone))
    with proof.m.If(searched):
        proof.lemma(suspects != 0)
        for bit in range(1, dut.derived.row_levels):
            low = Const(sum(1 << row for row in range(rows) if not row >> bit & 1), rows)
            proof.lemma((level >= bit) | (suspects & low == 0) | (suspects & ~low == 0))
            with proof.m.If(waits & (level == bit)):
                proof.lemma(dut.pattern == suspects & low)
    with proof.m.If(probing):
        proof.lemma((dut.pattern != 0) & (dut.pattern & ~rest == 0))
        with proof.m.If(searching):
            proof.lemma((level != 0) & (dut.pattern & ~suspects == 0) & (suspects & ~dut.pattern != 0))
            proof.lemma(dut.pattern < (suspects & ~dut.pattern & -(suspects & ~dut.pattern))[:rows])
        with proof.m.Else():
            proof.lemma((dut.pattern == rest) & (suspects == 0))
        proof.lemma(~dut.idle | (dut.pattern == everything))
    with proof.m.If(waits & dut.alone):
        proof.lemma((dut.pattern == (todo & -todo)[:rows]) & (todo != 0) & ~dut.idle)
        proof.lemma((suspects != 0) | (rest == 0))
    with proof.m.If(state == PICK):
        proof.lemma((suspects != 0) | (rest == 0) | inside["suspected"])


def _in_state(inside: Inside, state: int):
    return inside["choice_state"] == state


def _highest(rows):
    mirrored = rows[::-1]
    return (mirrored & -mirrored)[: len(rows)][::-1]


def _wrong_half(suspects, inside: Inside):
    dut, now = inside.component, inside["suspects"]
    probed = _in_state(inside, WAIT) & dut.strobe & ~dut.alone & inside["searching"]
    return Mux(probed, Mux(dut.hit, now & ~dut.pattern, dut.pattern), suspects)


_SEEK_BUGS = (
    Bug("the wrong half", Seek, "suspects", _wrong_half),
    Bug("known rows again", Seek, "known",
        lambda known, inside: Mux(inside.component.alone, known, known & inside["known"])),
    Bug("alone forever", Seek, "todo",
        lambda todo, inside: todo | Mux(_in_state(inside, WAIT) & inside.component.alone, inside["pattern"], 0)),
    Bug("the highest first", Seek, "pattern",
        lambda rows, inside: Mux(_in_state(inside, PICK) & (rows & (rows - 1) == 0), _highest(inside["todo"]), rows)),
    Bug("what comes after them is forgotten", Seek, "open",
        lambda rows, inside: Mux(_in_state(inside, PICK), 0, rows)),
)  # fmt: skip
CASES = (
    ProofCase("frames of an adaptive scan", "4 rows", partial(frames, rows=4), 3, _SEEK_BUGS, 40),
    ProofCase("frames of an adaptive scan", "8 rows", partial(frames, rows=8), 3),
    ProofCase("frames of an adaptive scan", "16 rows", partial(frames, rows=16), 3),
    ProofCase("a release between rows", "2 rows", released_between, 4, _BUGS, 60),
)
