"""The labeller's memories and stalls."""

from functools import partial

from amaranth.hdl import Array, Const, Mux, Signal, Value

from contactfpga.skin import Skin
from contactfpga_hdl.label.join import Brackets, Join
from contactfpga_hdl.label.run import RunLabeller, Sum
from contactfpga_hdl.label.steps import Walk, place_bits, place_of, waiting
from contactfpga_hdl.util.stack import Stack
from contactfpga_sim.verify.proofs.case import Bug, ProofCase
from contactfpga_sim.verify.proofs.inside import Inside
from contactfpga_sim.verify.proofs.proof import Proof


def skin_of(rows: int, columns: int, connectivity: int, closed: bool = False) -> Skin:
    flat = Skin(rows=rows, columns=columns, connectivity=connectivity, settle_us=100, zone_capacity=1)
    return flat.replace(surface="cylinder", radius_mm=10.0, closed=True, zone_capacity=1) if closed else flat


def rows_into(proof: Proof, dut: RunLabeller):
    """Free rows at any time: ``valid``, ``cells`` and ``last``."""
    valid, last = proof.free(1, "valid"), proof.free(1, "last")
    cells = proof.free(dut.derived.skin.columns, "cells")
    proof.m.d.comb += [
        dut.rows.valid.eq(valid),
        dut.rows.payload.cells.eq(cells),
        dut.rows.payload.last.eq(last),
    ]
    return valid, cells, last


def nothing_overflows(proof: Proof, columns: int, connectivity: int, closed: bool = False) -> None:
    """Free: any rows at any time. Assumed: records are taken at once, which ``stalls_change_nothing`` permits.

    Claimed: the stacks neither overflow nor underflow; no place of the table is written while it holds an open zone, or
    read while it holds none or in the clock of its write; after a frame's last row no zone is open; a walk that has
    ended leaves no run.
    """
    m = proof.m
    dut = RunLabeller(skin_of(2, columns, connectivity, closed))
    derived = dut.derived
    inside = proof.put(dut)
    valid, cells, last = rows_into(proof, dut)
    m.d.comb += dut.records.ready.eq(1)
    walk, join, stack = inside.part("walk"), inside.part("join"), inside.part("join.stack")
    step, step_valid, joined = walk.step, walk.step_valid, join.join
    works = step_valid & ~step.end
    with m.If(works & stack.pop):
        proof.claim(stack.level != 0)
    with m.If(works & stack.push & ~stack.pop):
        proof.claim(stack.level < waiting(derived))

    # Which places of the table hold an open zone or a waiting group; one clock after the stack of `join`.
    summing = join.join_valid & ~joined.end
    half = 1 << place_bits(derived)
    lookup = proof.before(join.lookup)
    live, taken, read, stored = (Signal(2 * half, name=name) for name in ("live", "taken", "read", "stored"))
    m.d.comb += [
        taken.eq(Mux(summing & (joined.load | joined.again), Const(1) << lookup, 0)),
        read.eq(Mux(joined.load, taken, 0)),
        stored.eq(Mux(summing & joined.store, Const(1) << joined.place, 0)),
    ]
    m.d.sync += live.eq((live & ~taken) | Mux(joined.leaves, 0, stored))  # in the last row zones are stored, too
    proof.claim((taken & ~live) == 0)
    proof.claim((read & proof.before(stored)) == 0)  # its word was read in the clock before
    proof.claim((live & ~taken & stored) == 0)
    with m.If(summing & joined.again):
        proof.claim(taken == proof.before(stored))
    with m.If(summing & joined.store):
        proof.claim(Mux(joined.place[-1], joined.place[:-1] <= waiting(derived), joined.place < derived.open_zones))
    with m.If(join.join_valid & joined.end):
        proof.claim(live == 0)
    with m.If(~inside["walk.work"] & ~inside["walk.found"]):
        proof.claim((inside["walk.befores"] == 0) & (inside["walk.edges"] == 0))

    # Between two rows nothing is known of the one before but its brackets, and they nest.
    walked, walked_last = Signal(columns), Signal()  # the row in the walk
    with m.If(valid & dut.rows.ready):
        m.d.sync += [walked.eq(cells), walked_last.eq(last)]
    stepped = proof.before(walked)  # the row of the step that comes out of the walk
    open_row, midst = Signal(columns), Signal()  # the row that was joined last, and whether another is half joined
    with m.If(works):
        m.d.sync += midst.eq(~step.row_done)
        with m.If(step.row_done):
            m.d.sync += open_row.eq(Mux(step.final, 0, stepped))
    earlier, later, known = brackets_of(inside)
    nests, first_runs = _brackets(m, open_row, earlier, later)
    places = (Mux(is_first, 1 << place_of(derived, x), 0) for x, is_first in enumerate(first_runs))
    open_places = sum(places, Const(0, derived.open_zones))  # no two are the same
    with m.If(~midst):
        proof.lemma((open_row == 0) | nests)
        proof.lemma(stack.level == 0)
        proof.lemma((known == 0) & (inside["join.number"] == 0) & ~inside["join.pushed"])
    with m.If(inside["join.brackets.late.row_done"]):
        proof.lemma(~works & ~midst)
    with m.If(~proof.before(midst)):
        proof.lemma(live[:half] == proof.before(open_places))
    proof.lemma(live[half:] == proof.before((Const(2) << stack.level) - 2))
    with m.If(step_valid & step.end):
        proof.lemma(~midst & (open_row == 0))
    proof.lemma(inside["walk.before"] == Mux(walked_last, 0, walked))
    with m.If(midst | works):
        proof.lemma(~inside["walk.found"] & (inside["walk.work"] == ~(works & step.row_done)))
    proof.lemma(walk_is_sound(inside))
    with m.If(~inside["walk.work"]):
        proof.lemma(inside["walk.opens"])
        with m.If(~inside["walk.found"]):
            proof.lemma(inside["walk.before"] == Mux(works, Mux(step.final, 0, stepped), open_row))


def walk_is_sound(labeller: Inside):
    """Whether the walk's mask is a run of ones from column 0 on, then the other clusters' ends, and each register
    without the lowest bits is its neighbor without them."""
    inside, ends = labeller["walk.inside"], labeller["walk.ends"]
    work, found = labeller["walk.work"], labeller["walk.found"]
    before, before_later = labeller["walk.befores"], labeller["walk.befores_later"]
    edges, stop, later = (labeller[f"walk.{name}"] for name in ("edges", "edges_stop", "edges_later"))
    first = (inside & (inside + 1) == 0) & (ends & inside == 0) & inside[0]
    left = (before_later == (before & before - 1)) & (stop == (edges & edges - 1)) & (later == (stop & stop - 1))
    return Mux(work, ~found & first & left, found == ends.any())


def brackets_of(labeller: Inside):
    """Which runs of the row before have an earlier and a later one, and what is known of the new row, after the last
    step."""
    done = labeller["join.brackets.late.row_done"]
    new = [labeller[f"join.brackets.new_{name}"] for name in ("earlier", "later")]
    old = [labeller[f"join.brackets.old_{name}"] for name in ("earlier", "later")]
    earlier, later = (Mux(done, after, before) for after, before in zip(new, old, strict=True))
    return earlier, later, Mux(done, 0, new[0] | new[1])


def _brackets(m, row, earlier, later):
    starts = Signal(len(row))
    m.d.comb += starts.eq(row & ~(row << 1))
    runs = sum(starts[1:], starts[0])
    depth = Const(0, len(row).bit_length() + 1)
    nests = Const(1, 1)
    for i in range(len(earlier)):
        nests &= ~(earlier[i] & (depth == 0)) & ((i < runs) | ~(earlier[i] | later[i]))
        after = Signal(len(row).bit_length() + 1, name=f"depth_{i}")
        m.d.comb += after.eq(depth + (later[i] & ~earlier[i]) - (earlier[i] & ~later[i]))
        depth = after
    numbers = [sum(starts[:x], Const(0, 1)) for x in range(len(row))]
    return nests & (depth == 0), [starts[x] & ~Array(earlier)[numbers[x]] for x in range(len(row))]


def stalls_change_nothing(proof: Proof, columns: int, connectivity: int, closed: bool = False) -> None:
    """Free: rows at any time, and when records are taken.

    Claimed: while a record waits it is unchanged, no row is taken and nothing changes inside.
    """
    m = proof.m
    dut = RunLabeller(skin_of(4, columns, connectivity, closed))
    inside = proof.put(dut)
    rows_into(proof, dut)
    m.d.comb += dut.records.ready.eq(proof.free(1, "ready"))
    waits = dut.records.valid & ~dut.records.ready
    with m.If(waits):
        proof.claim(~dut.rows.ready)
        proof.claim(~inside["sum.write__en"])
    with m.If(proof.before(waits)):
        for register in (dut.records.valid, dut.records.payload, *inside.registers()):
            proof.claim(Value.cast(register) == proof.before(register))


def an_end_mark_a_frame(proof: Proof, columns: int, connectivity: int) -> None:
    """Free: rows at any time, and when records are taken.

    Claimed: the end marks are the last rows taken, except at most three still inside.
    """
    m = proof.m
    dut = RunLabeller(skin_of(4, columns, connectivity))
    inside = proof.put(dut)
    valid, _, last = rows_into(proof, dut)
    m.d.comb += dut.records.ready.eq(proof.free(1, "ready"))
    owed = Signal(range(5))
    m.d.sync += owed.eq(
        owed + (valid & last & dut.rows.ready) - (dut.records.valid & dut.records.ready & dut.records.payload.end)
    )
    walk, join = inside.part("walk"), inside.part("join")
    proof.claim(owed <= 3)
    with m.If(dut.records.valid & dut.records.payload.end):
        proof.claim(owed != 0)
    held = inside["walk.last"] + (walk.step_valid & walk.step.end) + (join.join_valid & join.join.end)
    proof.lemma(owed == held)


def _pushed_in_a_stall(level, inside: Inside):
    stack = inside.component
    return level + (stack.push & ~stack.pop & ~stack.enable)


_OVERFLOW_BUGS = (
    Bug("brackets forgotten", Brackets, "old_later",
        lambda brackets, inside: Mux(inside["late.row_done"], 0, brackets)),
    Bug("never pushed", Join, "push", lambda *_: 0),
    Bug("the group that waits is looked up among the zones", Join, "lookup", lambda place, _: place[:-1]),
    Bug("always in the first place", Join, "decided.place", lambda *_: 0),
    Bug("the last row is a row like others", Walk, "last", lambda *_: 0),
    Bug("a run of the row before is left", Walk, "befores", lambda runs, inside: runs | ~inside["work"]),
    Bug("a zone stays open", Walk, "before",
        lambda row, inside: Mux(inside["rows__ready"] & inside.component.rows.valid,
                                inside.component.rows.payload.cells, row)),
)  # fmt: skip
_STALL_BUGS = (
    Bug("the walk runs on", Walk, "inside",
        lambda columns, inside: Mux(inside.component.enable, columns, columns >> 1)),
    Bug("the join runs on", Join, "kept",
        lambda group, inside: Mux(inside.component.enable | ~inside.component.valid, group, inside["group"])),
    Bug("the stack runs on", Stack, "level", _pushed_in_a_stall),
    Bug("the table is written", Sum, "write__en",
        lambda _, inside: inside.component.valid & ~inside.component.join.end & inside.component.join.store),
    Bug("rows are taken", Walk, "rows__ready", lambda _, inside: ~inside["work"]),
)  # fmt: skip
_END_BUGS = (
    Bug("no mark after the first row", Walk, "step_valid",
        lambda valid, inside: valid & (inside["work"] | inside["y"].any() | ~inside.component.enable)),
    Bug("the mark comes again", Walk, "last", lambda last, inside: last | inside["last"]),
)  # fmt: skip
CASES = (
    *(
        ProofCase("nothing overflows, nothing is left", f"{columns} columns, {connectivity}-connected",
                  partial(nothing_overflows, columns=columns, connectivity=connectivity), clocks,
                  _OVERFLOW_BUGS if (columns, connectivity) == (4, 8) else (), bug_clocks=14, campaign=columns == 8)
        for columns, connectivity, clocks in ((4, 8, 11), (4, 4, 14), (8, 8, 16), (8, 4, 26))
    ),
    *(
        ProofCase("nothing overflows, nothing is left", f"{columns} columns, {connectivity}-connected, closed",
                  partial(nothing_overflows, columns=columns, connectivity=connectivity, closed=True), clocks,
                  _OVERFLOW_BUGS[:2] if columns == 4 else (), bug_clocks=14, campaign=True)
        for columns, connectivity, clocks in ((3, 8, 11), (4, 8, 12), (4, 4, 15))
    ),
    ProofCase("a stall changes nothing", "8 columns, 8-connected, closed",
              partial(stalls_change_nothing, columns=8, connectivity=8, closed=True), 2),
    ProofCase("a stall changes nothing", "8 columns, 8-connected",
              partial(stalls_change_nothing, columns=8, connectivity=8), 2, _STALL_BUGS, bug_clocks=16),
    ProofCase("a stall changes nothing", "8 columns, 4-connected",
              partial(stalls_change_nothing, columns=8, connectivity=4), 2),
    ProofCase("an end mark a frame", "8 columns, 8-connected",
              partial(an_end_mark_a_frame, columns=8, connectivity=8), 2, _END_BUGS),
    ProofCase("an end mark a frame", "8 columns, 4-connected",
              partial(an_end_mark_a_frame, columns=8, connectivity=4), 2),
)  # fmt: skip
