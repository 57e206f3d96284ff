"""The choice of rows in an adaptive scan: whatever the columns read, each frame is whole, in order and short enough."""

from functools import partial

from amaranth.hdl import Const, Mux, Signal

from contactfpga.skin import Skin
from contactfpga_hdl.scan.seek import Seek
from contactfpga_hdl.util.bits import popcount
from contactfpga_sim.verify.proofs.bugs import Bug
from contactfpga_sim.verify.proofs.case import Case
from contactfpga_sim.verify.proofs.inside import Inside
from contactfpga_sim.verify.proofs.proof import Proof

WAIT, PICK, SEARCH, START = range(4)  # in the order in which the source names them


def frames(proof: Proof, rows: int) -> None:
    """Free: whether a slot hits, and whether its row is busy, each time; when a strobe comes once rows are chosen.

    Assumed: a frame's rows are handed on before the next one's first strobe, as the Skin's limits see to.

    Claimed: each slot drives rows that are not known yet, one if alone; these come in ascending order; after the last
    slot of a frame every row is known; a frame has at most ``2 rows - 1`` slots, and ``rows + 2 ceil(log2 rows) + 2``.
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
    _lemmas(proof, inside, dut, state, known, alone, last, probes)


def _lemmas(proof: Proof, inside: Inside, dut: Seek, state, known, alone, last, probes) -> None:
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
    """The highest of the rows, alone."""
    turned = rows[::-1]
    return (turned & -turned)[: len(rows)][::-1]


def _wrong_half(suspects, inside: Inside):
    dut, now = inside.component, inside["suspects"]
    probed = _in_state(inside, WAIT) & dut.strobe & ~dut.alone & inside["searching"]
    return Mux(probed, Mux(dut.hit, now & ~dut.pattern, dut.pattern), suspects)


_BUGS = (
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
    Case("frames of an adaptive scan", "4 rows", partial(frames, rows=4), 3, _BUGS, 40),
    Case("frames of an adaptive scan", "8 rows", partial(frames, rows=8), 3),
    Case("frames of an adaptive scan", "16 rows", partial(frames, rows=16), 3),
)
