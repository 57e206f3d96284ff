"""The labeller's records are the zones of the frame."""

from functools import partial

from amaranth.hdl import Cat, Const, Fragment, Mux, Signal, Value

from contactfpga_hdl.label.around import Unwrap
from contactfpga_hdl.label.join import Brackets, Join
from contactfpga_hdl.label.run import RunLabeller
from contactfpga_hdl.label.steps import Walk, place_of
from contactfpga_hdl.payloads import moments_layout, zone_layout
from contactfpga_sim.verify.proofs.case import Bug, ProofCase, plant
from contactfpga_sim.verify.proofs.inside import Inside
from contactfpga_sim.verify.proofs.label import rows_into, skin_of, walk_is_sound
from contactfpga_sim.verify.proofs.marks import Marks, marked_skin
from contactfpga_sim.verify.proofs.proof import Proof
from contactfpga_sim.verify.proofs.zones import (
    OpenRow,
    RowStep,
    TurnedRow,
    empty_row,
    flood_around,
    flood_fill,
    next_row,
    open_rows_agree,
    turned_rows_agree,
    turns_are_known,
    weights_of,
)


def records_are_the_zones(proof: Proof, columns: int, connectivity: int, rows: int = 4, closed: bool = False) -> None:
    """Free: any rows at any time. Assumed: records are taken at once.

    Claimed: from the second clock after a row to the second clock after the next one, exactly the zones that end with
    it leave, each once, and after a last row one end mark.
    """
    dut = RunLabeller(skin_of(rows, columns, connectivity, closed))
    inside = proof.put(dut)
    valid, cells, last = rows_into(proof, dut)
    y, handed = Signal(range(rows)), valid & dut.rows.ready
    with proof.m.If(handed):
        proof.m.d.sync += y.eq(Mux(last, 0, y + 1))
    proof.lemma(inside["walk.y_next"] == y)
    _records(proof, dut, inside, Cat(handed, last, cells, y), partial(weights_of, dut.derived))


def cells_leave_together(proof: Proof, columns: int, connectivity: int) -> None:
    """The labeller with marks (:mod:`.marked`), which a step adds as its run's moments (:func:`a_run_has_its_cells`).

    Free: any rows at any time, and the marked cells. Assumed: records are taken at once.

    Claimed: as in :func:`records_are_the_zones`; a mark is never added to itself, and a run has a cell.
    """
    dut = RunLabeller(marked_skin(skin_of(4, columns, connectivity)))
    marks = Marks(proof, columns)

    def of_run(_, inside: Inside):
        step = inside.component.step
        return Mux(step.has_run, marks.within(step.start, step.past, step.y), 0)

    plant(Bug("marks, not moments", Join, "decided.run", of_run), design := Fragment.get(dut, None))
    inside = proof.put(design)
    valid, cells, last = rows_into(proof, dut)
    handed = valid & dut.rows.ready
    offered = Cat(handed, last, cells, marks.numbers(dut, handed, last))
    open_row, rows = _records(proof, dut, inside, offered, partial(marks.weights, columns=columns))
    walk, sums = inside.part("walk"), inside.part("sum")
    with proof.m.If(walk.step_valid & ~walk.step.end & walk.step.has_run):
        proof.claim(walk.step.start < walk.step.past)
    run, kept, found = (Value.cast(part) for part in (sums.join.run, inside["sum.kept"], inside["sum.found"]))
    with proof.m.If(sums.valid & ~sums.join.end):
        proof.claim((run & kept | run & found | kept & found) == 0)
    met: Value = Signal.like(marks.passed)  # in the open row's frame
    taken, taken_last, _, taken_y = rows[0]
    with proof.m.If(taken):
        proof.m.d.sync += met.eq(Mux(taken_last, 0, met | taken_y))
    marks.in_one_zone(open_row, met)
    for there, its_last, _, its_y in rows:
        proof.lemma(~there | (its_y & met == 0))
        met = Mux(there, Mux(its_last, 0, met | its_y), met)
    proof.lemma(marks.passed == met)


def _records(proof: Proof, dut: RunLabeller, inside: Inside, offered, weights) -> tuple[OpenRow, list[tuple]]:
    """Claims and lemmas of records; ``offered``: whether a row is handed over, and the row with its number.

    Returns the specification's open row, and the rows handed over since, two clocks ago and one.
    """
    m, derived = proof.m, dut.derived
    columns, closed = derived.skin.columns, derived.skin.closed
    m.d.comb += dut.records.ready.eq(1)
    wanted = proof.chosen(zone_layout(derived).size, "wanted")
    handed, last, cells, _ = _split(offered, columns)
    delayed = proof.before(offered)
    newer = _split(delayed, columns)
    taken, taken_last, row, y = older = _split(proof.before(delayed), columns)

    open_row = empty_row(derived)
    after, ended_zones = next_row(m, derived, open_row, row, taken_last, wanted, weights(y))
    expected, expected_end = Signal(range(2 * columns + 1)), Signal()
    seen, seen_ends = Signal(range(2 * columns + 1)), Signal(range(2 * columns + 1))
    record = dut.records.payload
    seen_now = seen + (dut.records.valid & ~record.end & (record.zone.as_value() == wanted))
    ends_now = seen_ends + (dut.records.valid & record.end)
    steps = ((columns + 1) // 2 if derived.skin.connectivity == 8 else columns) + closed
    age = Signal(range(steps + 3), init=steps + 2)
    done = age == steps + 2
    with m.If(taken):
        m.d.sync += [*open_row.copy(after, when=~taken_last), expected.eq(ended_zones), expected_end.eq(taken_last)]
        m.d.sync += [seen.eq(0), seen_ends.eq(0), age.eq(0)]
    with m.Else():
        m.d.sync += [seen.eq(seen_now), seen_ends.eq(ends_now), age.eq(age + ~done)]
    newest = Signal(columns)  # the row last handed over, empty before a frame
    with m.If(handed):
        m.d.sync += newest.eq(Mux(last, 0, cells))
    proof.lemma((inside["walk.before"] == newest) & (age <= steps + 2))
    with m.If(taken | done):
        proof.claim(seen_now == expected)
        proof.claim(ends_now == expected_end)
    proof.rests(taken | done & ~newer[0])
    _lemmas(proof, dut, inside, open_row, taken | done, done & ~taken & ~newer[0])
    next_taken, next_last, next_cells, next_y = newer
    with m.If(next_taken):
        row_before = Mux(taken, Mux(taken_last, 0, row), open_row.cells)
        _loaded(proof, dut, inside, row_before, next_cells, next_last, next_y)
    return open_row, [older, newer]


def _split(value, columns: int) -> tuple:
    """Whether there is a row, whether it is the last, its cells, and its number."""
    return value[0], value[1], value[2 : 2 + columns], value[2 + columns :]


def _lemmas(proof: Proof, dut: RunLabeller, inside: Inside, open_row: OpenRow, rest, idle) -> None:
    m, columns = proof.m, range(dut.derived.skin.columns)
    join = inside.part("join")
    starts = Signal(len(columns))
    m.d.comb += starts.eq(open_row.cells & ~(open_row.cells << 1))
    numbers = [sum(starts[:x], Const(0, 1)) for x in columns]  # of the run that starts there
    earlier = [starts[x] & open_row.reach[x][:x].any() for x in columns]
    later = [starts[x] & (open_row.reach[x] & starts)[x + 1 :].any() for x in columns]
    words = [inside.word("sum.table", place) for place in range(dut.derived.open_zones)]
    with m.If(rest):
        for brackets, ones in (("earlier", earlier), ("later", later)):
            for x in columns:
                known = inside[f"join.brackets.old_{brackets}"].bit_select(numbers[x], 1)
                proof.lemma(~starts[x] | (known == ones[x]))
        for x in columns:
            with m.If(starts[x] & ~earlier[x]):
                word, moments = words[place_of(dut.derived, x)], open_row.moments[x].as_value()
                proof.lemma(word[: len(moments)] == moments)
        if isinstance(open_row, TurnedRow):
            proof.lemma(inside["join.brackets.known_turned"] == 0)
            turned = inside["join.brackets.old_turned"]
            for x in columns:
                with m.If(starts[x]):
                    linked = turned.bit_select(numbers[x], 1)
                    turns_are_known(proof, open_row, x, words[place_of(dut.derived, x)], linked)
        known = inside["join.brackets.known_earlier"] | inside["join.brackets.known_later"]
        proof.lemma((known == 0) & (inside["join.brackets.late"] == 0) & (inside["join.number"] == 0))
        proof.lemma((inside["sum.kept"] == 0) & ~inside["join.pushed"])
        proof.lemma(inside.part("join.stack").level == 0)
    with m.If(idle):
        proof.lemma(~inside["walk.last"] & ~inside.part("walk").step_valid & ~join.join_valid)
        proof.lemma(~inside["walk.work"] & ~inside["walk.found"] & (inside["walk.before"] == open_row.cells))
    proof.lemma(walk_is_sound(inside))
    with m.If(~inside["walk.work"]):
        proof.lemma(inside["walk.opens"])
    open_rows_agree(proof, open_row)
    if isinstance(open_row, TurnedRow):
        turned_rows_agree(proof, open_row)


def _loaded(proof: Proof, dut: RunLabeller, inside: Inside, before, row, last, y) -> None:
    walk = inside.part("walk")
    proof.lemma(inside["walk.befores_later"] == (before & ~(before << 1))[: len(before)])
    proof.lemma((inside["walk.last"] == last) & (inside["walk.y"] == y))
    proof.lemma(inside["walk.edges_later"] == (row ^ (row << 1)))
    if dut.derived.skin.connectivity == 8:
        joined = (row | before) & ((row | before) >> 1)
    else:
        joined = row & (row >> 1) | before & (before >> 1)
    ends = (row | before) & ~joined
    proof.lemma((inside["walk.ends"] == ends) & (inside["walk.found"] == (ends != 0)))
    proof.lemma(~walk.step_valid | walk.step.end)
    if dut.derived.skin.closed:
        eight = dut.derived.skin.connectivity == 8
        over = (row | before)[0] & (row | before)[-1] if eight else row[0] & row[-1] | before[0] & before[-1]
        proof.lemma(inside["walk.seam"] == over)


def a_run_has_its_cells(proof: Proof, columns: int, connectivity: int) -> None:
    """Free: any rows at any time, and when records are taken.

    Claimed: what a step adds are the moments of its run's cells. That a run has a cell is shown elsewhere.
    """
    dut = RunLabeller(skin_of(16, columns, connectivity))
    inside = proof.put(dut)
    rows_into(proof, dut)
    proof.m.d.comb += dut.records.ready.eq(proof.free(1, "ready"))
    step, run = inside.part("walk").step, inside["join.decided.run"]
    proof.lemma(step.area == (step.past - step.start)[: len(step.area)])
    proof.lemma(walk_is_sound(inside))
    with proof.m.If(inside.part("walk").step_valid & ~step.end):
        proof.lemma(step.past <= columns)
    moments = Signal(moments_layout(dut.derived))
    within = [step.has_run & (step.start <= x) & (x < step.past) for x in range(columns)]
    for name, weights in weights_of(dut.derived, step.y).items():
        proof.m.d.comb += moments[name].eq(sum(Mux(cell, weights[x], 0) for x, cell in enumerate(within)))
    with proof.m.If(inside.part("walk").step_valid & ~step.end & (~step.has_run | (step.start < step.past))):
        proof.claim(Value.cast(run) == moments.as_value())


def rows_find_the_zones(proof: Proof, rows: int, columns: int, connectivity: int, closed: bool = False) -> None:
    """The specification itself. Free: a frame and a zone's record.

    Claimed: row by row as many zones with this record end as a flood fill of the frame finds.
    """
    m = proof.m
    derived = skin_of(rows, columns, connectivity, closed).derived
    frame, wanted = proof.free(rows * columns, "frame"), proof.free(zone_layout(derived).size, "wanted")
    open_row, found = empty_row(derived), 0
    for y in range(rows):
        cells, last = frame.word_select(y, columns), Const(y == rows - 1)
        open_row, ended = next_row(
            m, derived, open_row, cells, last, wanted, weights_of(derived, Const(y, range(rows)))
        )
        found += ended
    proof.claim(found == (flood_around if closed else flood_fill)(m, derived, frame, wanted))


def _seam_forgotten(seam, inside: Inside):
    return seam & ~inside["last"]


_BUGS = (
    Bug("a row's first cluster ends a column early", Walk, "inside",
        lambda columns, inside: Mux(inside["found"], columns >> 1, columns)),
    Bug("always in the first row", Walk, "y", lambda *_: 0),
    Bug("what was just stored is forgotten", Join, "decided.again", lambda *_: 0),
    Bug("the table is not read", Join, "decided.load", lambda *_: 0),
    Bug("a zone leaves a row early", Join, "decided.leaves",
        lambda leaves, inside: leaves | inside["decided.closes"] & inside["decided.store"]),
    Bug("runs do not join", Brackets, "new_later", lambda _, inside: inside["known_later"]),
)  # fmt: skip
_CLOSED_BUGS = (
    Bug("the seam is forgotten in a last row", Walk, "seam", _seam_forgotten),
    Bug("cells past the seam are not counted", Unwrap, "turned_group.turned", lambda *_: 0),
    Bug("nothing is a ring", Unwrap, "turned_group.ring", lambda *_: 0),
)
_RUN_BUGS = (
    Bug("a run has its first cell alone", Join, "decided.run.area", lambda area, _: area.any()),
    Bug("its last column is not counted", Join, "decided.run.sum_x",
        lambda sum_x, inside: sum_x - inside.component.step.past + 1),
)  # fmt: skip
_SPECIFICATION_BUGS = (Bug("zones of one row do not merge", RowStep, "next_reach_2", lambda reach, _: reach & 0b100),)


REST_CLOCKS = 2
"""Clocks before rest in the induction: the lemmas of two clocks pin the labeller down, those of rest alone do not."""


def _case(columns: int, connectivity: int, rows: int = 4, closed: bool = False, **options) -> ProofCase:
    build = partial(records_are_the_zones, columns=columns, connectivity=connectivity, rows=rows, closed=closed)
    size = f"{columns} columns, {rows} rows, {connectivity}-connected{', closed' * closed}"
    return ProofCase("records are the zones", size, build, REST_CLOCKS, **options)


def _marked(columns: int, connectivity: int, **options) -> ProofCase:
    build = partial(cells_leave_together, columns=columns, connectivity=connectivity)
    size = f"{columns} columns, {connectivity}-connected"
    return ProofCase("cells of a zone leave together", size, build, REST_CLOCKS, **options)


CASES = (
    _case(1, 8),
    _case(1, 4),
    _case(2, 8),
    _case(2, 4),
    _case(3, 8, bugs=_BUGS, bug_clocks=14),
    _case(3, 4),
    _case(4, 8, campaign=True),
    _case(4, 4, campaign=True),
    _case(3, 8, rows=2, closed=True, campaign=True, bugs=_CLOSED_BUGS, bug_clocks=14),
    _case(3, 4, rows=2, closed=True, campaign=True),
    _marked(3, 8, bugs=tuple(bug for bug in _BUGS if bug.signal != "y"), bug_clocks=14),
    _marked(5, 4),
    _marked(8, 8, campaign=True),
    _marked(8, 4, campaign=True),
    *(
        ProofCase("a run has its cells", f"{columns} columns, {connectivity}-connected",
                  partial(a_run_has_its_cells, columns=columns, connectivity=connectivity), 2, bugs)
        for columns, connectivity, bugs in ((8, 8, _RUN_BUGS), (16, 8, ()), (16, 4, ()))
    ),
    *(
        ProofCase("rows find the zones", f"3x3, {connectivity}-connected, closed",
                  partial(rows_find_the_zones, rows=3, columns=3, connectivity=connectivity, closed=True), 1,
                  bounded=True, campaign=True)
        for connectivity in (8, 4)
    ),
    *(
        ProofCase("rows find the zones", f"{rows}x{columns}, {connectivity}-connected",
                  partial(rows_find_the_zones, rows=rows, columns=columns, connectivity=connectivity), 1, bugs,
                  bug_clocks=1, bounded=True, campaign=columns == 4)
        for rows, columns, bugs in ((3, 3, _SPECIFICATION_BUGS), (3, 4, ()))
        for connectivity in (8, 4)
    ),
)  # fmt: skip
