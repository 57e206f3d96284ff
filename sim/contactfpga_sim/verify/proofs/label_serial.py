"""Proofs of the serial labeller."""

from functools import partial

from amaranth.hdl import Cat, Const, Fragment, Mux, Signal, Value
from amaranth.lib import data

from contactfpga.skin import Skin
from contactfpga_hdl.label.serial import SerialLabeller
from contactfpga_hdl.label.steps import nesting, place_of
from contactfpga_hdl.payloads import moments_layout, zone_layout
from contactfpga_sim.verify.proofs.case import Bug, ProofCase, plant
from contactfpga_sim.verify.proofs.inside import Inside
from contactfpga_sim.verify.proofs.label import rows_into, skin_of
from contactfpga_sim.verify.proofs.marks import Marks, marked_skin
from contactfpga_sim.verify.proofs.proof import Proof
from contactfpga_sim.verify.proofs.zones import (
    OpenRow,
    TurnedRow,
    empty_row,
    next_row,
    open_rows_agree,
    turned_rows_agree,
    turns_are_known,
    weights_of,
)


def _skin(rows: int, columns: int, connectivity: int, closed: bool) -> Skin:
    return skin_of(rows, columns, connectivity, closed).replace(labeller="serial", zone_capacity=1)


def nothing_overflows(proof: Proof, columns: int, connectivity: int, rows: int = 4, closed: bool = False) -> None:
    """Free and assumed: as in :func:`records_are_the_zones`.

    Claimed: wanted memory data are available, nothing is written to a place in use or outside the table, no word is
    used that was read during its write, the brackets' nesting fits, and after a frame no place is in use.
    """
    dut = SerialLabeller(_skin(rows, columns, connectivity, closed))
    inside, open_row = _labeller(proof, dut, dut, proof.lemma)
    m, places = proof.m, dut.derived.open_zones
    live = Signal(places)  # in use: by zones of the row before that are to come or of the new row, or groups that wait
    groups, wanted, whole, final = inside.part("groups"), inside["wanted"], inside["whole"], inside["last"]
    (read_port,), (write,) = groups.read_ports, groups.write_ports
    read = read_port.addr[:-1]
    taken = Mux(wanted, Const(1) << read, 0)[:places]
    stored = Mux(write.en, Const(1) << write.addr, 0)[:places]
    m.d.sync += live.eq(live & ~taken | Mux(whole & final, 0, stored))
    with m.If(wanted):
        proof.claim((taken & live).any())
        proof.claim(~write.en | (write.addr != read))
    with m.If(write.en):
        proof.claim((stored & ~live).any())
    for name in ("earlier", "later"):
        (port,), (written,) = inside.part(name).read_ports, inside.part(name).write_ports
        lost = Signal(name=f"lost_{name}")
        with m.If(port.en):
            m.d.sync += lost.eq(written.en & (written.addr == port.addr))
        proof.claim(~(inside["begins"] & lost))
        proof.claim(~written.en | (written.addr < places))
    depth = Signal(range(nesting(dut.derived) + 1))  # of zones; the seam is one more
    joins, earlier, later = inside["joins"], inside["earlier"], inside["later"]
    if closed:
        joins &= ~inside["at_seam"]
    opens, closes = joins & later & ~earlier, joins & earlier & ~later
    m.d.sync += depth.eq(depth + opens - closes)
    proof.claim(~opens | (depth < nesting(dut.derived)))
    proof.claim(~closes | (depth != 0))
    with m.If(dut.rows.ready):
        proof.claim(~final | (live == 0))
        firsts = (Mux(leader, 1 << place_of(dut.derived, x), 0) for x, leader in enumerate(open_row.leaders()))
        proof.lemma(live == sum(firsts, Const(0, places)))
        proof.lemma(depth == 0)


def records_are_the_zones(proof: Proof, columns: int, connectivity: int, rows: int = 4, closed: bool = False) -> None:
    """Free: rows at any time. Assumed: records are taken at once.

    Claimed: when a row can be taken, the zones that end with the previous row have left, each once, and after a last
    row one end mark; that is so after at most C + e + 2 clocks, on a closed sheet two more.
    """
    dut = SerialLabeller(_skin(rows, columns, connectivity, closed))
    _labeller(proof, dut, dut, proof.claim)


def cells_leave_together(proof: Proof, columns: int, connectivity: int) -> None:
    """The labeller with marks (:mod:`.marked`), which it adds as a cell's moments (:func:`a_cell_is_added`).

    Free: rows at any time, and the marked cells. Assumed: records are taken at once.

    Claimed: as in :func:`records_are_the_zones`; a mark is never added to itself.
    """
    dut = SerialLabeller(marked_skin(_skin(4, columns, connectivity, closed=False)))
    marks = Marks(proof, columns)

    def cell_of(inside: Inside):
        column = inside["column"]
        return Mux(inside["adds"], marks.within(column, column + 1, inside["y"]), 0)

    def added(right, inside: Inside):
        """The cell's marks in place of its area and of its column's lowest bit."""
        grows = inside["enable"] & inside["active"] & ~inside["closes"]
        share = Mux(inside["adds"], Cat(Const(1), inside["column"][0]), 0)
        return right ^ Mux(grows, ~_found(inside)[: len(right)] & (cell_of(inside) ^ share), 0)

    plant(Bug("marks, not moments", SerialLabeller, "moments", added), design := Fragment.get(dut, None))
    inside, open_row = _labeller(proof, dut, design, proof.claim, marks)
    kept = Value.cast(inside["moments"])
    cell, found = cell_of(inside), _found(inside)[: len(kept)]
    proof.claim((cell & kept | cell & found | kept & found) == 0)
    with proof.m.If(dut.rows.ready):
        marks.in_one_zone(open_row, marks.passed)


def a_cell_is_added(proof: Proof, columns: int, connectivity: int) -> None:
    """Free: rows at any time, and when records are taken.

    Claimed: a group's moments grow by those of the column's cell or by those that are found, never by both.
    """
    dut = SerialLabeller(_skin(16, columns, connectivity, closed=False))
    inside = proof.put(dut)
    rows_into(proof, dut)
    proof.m.d.comb += dut.records.ready.eq(proof.free(1, "ready"))
    _nothing_beyond(proof, dut, inside)
    proof.lemma(~inside["active"] | (inside["column"] < columns) & ~inside["mark"] & ~inside["tail"])
    started = proof.before(Const(1))  # at power-up it is not known what the memory reads
    proof.lemma(~started | proof.before(inside["wanted"]) | (_found(inside) == 0))
    grows = inside["enable"] & inside["active"] & ~inside["closes"]
    layout = moments_layout(dut.derived)
    kept, found = (data.View(layout, value[: layout.size]) for value in (inside["moments"], _found(inside)))
    for name, weights in weights_of(dut.derived, inside["y"]).items():
        here = sum(Mux(inside["column"] == x, weights[x], 0) for x in range(columns))
        wider = proof.before(kept[name] + Mux(inside["adds"], here, found[name]))
        proof.claim(~proof.before(grows) | (kept[name] == wider[: len(kept[name])]))
    with proof.m.If(started & grows & inside["adds"]):
        proof.claim(found.as_value() == 0)


def _labeller(
    proof: Proof, dut: SerialLabeller, design: SerialLabeller | Fragment, claim, marks: Marks | None = None
) -> tuple[Inside, OpenRow]:
    """Claims, in ``claim``, and lemmas of the labeller ``design``, whose ports are those of ``dut``."""
    m, derived = proof.m, dut.derived
    columns, closed = derived.skin.columns, derived.skin.closed
    inside = proof.put(design)
    valid, cells, last = rows_into(proof, dut)
    m.d.comb += dut.records.ready.eq(1)
    wanted = proof.chosen(zone_layout(derived).size, "wanted")
    handed, record = valid & dut.rows.ready, dut.records.payload
    if marks is None:
        weights = weights_of(derived, _row_number(proof, dut, inside, handed, last))
    else:
        weights = marks.weights(marks.numbers(dut, handed, last), columns)

    open_row = empty_row(derived)
    after, ended = next_row(m, derived, open_row, cells, last, wanted, weights)
    expected, expected_end = Signal(range(2 * columns + 1)), Signal()
    seen, seen_ends = Signal(range(2 * columns + 1)), Signal(range(2 * columns + 1))
    seen_now = seen + (dut.records.valid & ~record.end & (record.zone.as_value() == wanted))
    ends_now = seen_ends + (dut.records.valid & record.end)
    longest = columns + derived.open_zones + 2 + 2 * closed
    age = Signal(range(longest + 2), init=longest)
    with m.If(handed):
        m.d.sync += [*open_row.copy(after, when=~last), expected.eq(ended), expected_end.eq(last)]
        m.d.sync += [seen.eq(0), seen_ends.eq(0), age.eq(1)]
    with m.Else():
        m.d.sync += [seen.eq(seen_now), seen_ends.eq(ends_now), age.eq(Mux(dut.rows.ready, longest, age + 1))]
    claim((age < longest) | (age == longest) & dut.rows.ready)
    proof.rests(dut.rows.ready)
    with m.If(dut.rows.ready):
        claim(seen_now == expected)
        claim(ends_now == expected_end)
        _at_rest(proof, dut, inside, open_row)
    open_rows_agree(proof, open_row)
    if isinstance(open_row, TurnedRow):
        turned_rows_agree(proof, open_row)
    _nothing_beyond(proof, dut, inside)
    return inside, open_row


def _row_number(proof: Proof, dut: SerialLabeller, inside: Inside, handed, last) -> Signal:
    y = Signal(range(dut.derived.skin.rows))
    with proof.m.If(handed):
        proof.m.d.sync += y.eq(Mux(last, 0, y + 1))
    with proof.m.If(dut.rows.ready):
        proof.lemma(Mux(inside["last"], 0, inside["y"] + 1)[: len(y)] == y)
    return y


def _nothing_beyond(proof: Proof, dut: SerialLabeller, inside: Inside) -> None:
    """Lemma: words of the table that have no place are 0."""
    place_bits = len(inside["first"])
    for place in range(dut.derived.open_zones, 2 << place_bits):
        proof.lemma((place < 1 << place_bits) | (inside.word("groups", place) == 0))


def _found(inside: Inside) -> Value:
    """The word that the table reads; moments come first."""
    return Value.cast(inside.part("groups").read_ports[0].data)


def _at_rest(proof: Proof, dut: SerialLabeller, inside: Inside, open_row: OpenRow) -> None:
    derived, columns = dut.derived, range(dut.derived.skin.columns)
    starts = Signal(len(columns), name="run_starts")
    proof.m.d.comb += starts.eq(open_row.cells & ~(open_row.cells << 1))
    moments = len(inside["moments"])
    for x in columns:
        place = place_of(derived, x)
        earlier, later = open_row.reach[x][:x].any(), (open_row.reach[x] & starts)[x + 1 :].any()
        with proof.m.If(starts[x]):
            proof.lemma(inside.word("earlier", place) == earlier)
            proof.lemma(inside.word("later", place) == later)
        with proof.m.If(starts[x] & ~earlier):
            word = inside.word("groups", place)
            of_zone = open_row.moments[x].as_value()
            proof.lemma(word[: len(of_zone)] == of_zone)
            proof.lemma(~word[moments])  # has_run
        if isinstance(open_row, TurnedRow):
            with proof.m.If(starts[x]):
                linked = inside.word("linked_runs", place)
                turns_are_known(proof, open_row, x, inside.word("groups", place), linked)
    proof.lemma(inside["before"] == open_row.cells << 1)
    proof.lemma((inside["cells"] == 0) & ~inside["cell_left"] & ~inside["before_left"])
    proof.lemma(~inside["active"] & ~inside["tail"] & ~inside["second"])
    proof.lemma(inside["whole"] & ~inside["has_run"] & (inside["moments"] == 0))
    if derived.skin.closed:
        proof.lemma(~inside["at_seam"])
    started = proof.before(Const(1))  # at power-up it is not known what the memory reads
    proof.lemma(~started | (_found(inside) == 0))


def stalls_change_nothing(proof: Proof, columns: int, connectivity: int, rows: int = 4, closed: bool = False) -> None:
    """Free: rows at any time, and when records are taken.

    Claimed: while a record waits no row is taken, no bracket is written, and no register changes.
    """
    dut = SerialLabeller(_skin(rows, columns, connectivity, closed))
    inside = proof.put(dut)
    rows_into(proof, dut)
    proof.m.d.comb += dut.records.ready.eq(proof.free(1, "ready"))
    waits = dut.records.valid & ~dut.records.ready
    with proof.m.If(waits):
        proof.claim(~dut.rows.ready & ~inside["write_earlier__en"] & ~inside["write_later__en"])
    with proof.m.If(proof.before(waits)):
        for register in (dut.records.valid, dut.records.payload, *inside.registers()):
            proof.claim(Value.cast(register) == proof.before(register))


def _clusters_end_early(closes, inside: Inside):
    return (inside["cell_left"] | inside["before_left"]) & ~inside["before"][0]


_STALL_BUGS = (
    Bug("the walk runs on", SerialLabeller, "tail", lambda tail, inside: tail & inside["enable"]),
    Bug("rows are taken", SerialLabeller, "rows__ready", lambda _, inside: ~inside["active"] & ~inside["tail"]),
    Bug("runs are forgotten", SerialLabeller, "has_run",
        lambda has_run, inside: has_run & ~(inside["closes"] | ~inside["active"])),
    Bug("brackets are written", SerialLabeller, "write_later__en",
        lambda enable, inside: enable | inside["closes"] & inside["whole"] & inside["has_run"]),
)  # fmt: skip
_BUGS = (
    Bug("clusters end with the row before", SerialLabeller, "closes", _clusters_end_early),
    Bug("a zone is expected to go on forever", SerialLabeller, "write_later__en",
        lambda enable, inside: enable & inside["starts"]),
    Bug("the table is not read", SerialLabeller, "wanted",
        lambda wanted, inside: wanted & inside["earlier"]),
    Bug("a zone leaves a row early", SerialLabeller, "records__valid",
        lambda valid, inside: valid | inside["closes"] & inside["whole"]),
    Bug("always in the first row", SerialLabeller, "y", lambda *_: 0),
)  # fmt: skip


_CLOSED_BUGS = (
    Bug("the seam is forgotten in a last row", SerialLabeller, "meets",
        lambda meets, inside: meets & ~inside["last"]),
    Bug("the seam is no turn", SerialLabeller, "turn_now", lambda *_: 0),
)  # fmt: skip
_OVERFLOW_BUGS = (
    Bug("always in the first place", SerialLabeller, "write__addr", lambda *_: 0),
    Bug("a place is read again", SerialLabeller, "wanted",
        lambda _, inside: inside["begins"] & ~inside["second"]),
    Bug("brackets are read too late", SerialLabeller, "read_later__en",
        lambda enable, inside: enable | inside["advance"]),
    Bug("the last row is a row like others", SerialLabeller, "before",
        lambda before, inside: Mux(inside["advance"] & inside["active"],
                                   Cat(before[:-1], inside["cells"][0]), before)),
)  # fmt: skip


_CELL_BUGS = (
    Bug("a cell is added with what is found", SerialLabeller, "adds", lambda _, inside: inside["cells"][0]),
    Bug("columns are not added", SerialLabeller, "moments", lambda moments, _: moments[0]),
)  # fmt: skip


def _case(
    claim, columns: int, connectivity: int, clocks: int, rows: int = 4, closed: bool = False, **options
) -> ProofCase:
    build = partial(claim, columns=columns, connectivity=connectivity, rows=rows, closed=closed)
    title = f"serial: {claim.__name__.replace('_', ' ')}"
    size = f"{columns} columns, {rows} rows, {connectivity}-connected{', closed' * closed}"
    return ProofCase(title, size, build, clocks, **options)


def _marked(claim, columns: int, connectivity: int, **options) -> ProofCase:
    build = partial(claim, columns=columns, connectivity=connectivity)
    title = f"serial: {claim.__name__.replace('_', ' ')}"
    return ProofCase(title, f"{columns} columns, {connectivity}-connected", build, 2, **options)


CASES = (
    _case(records_are_the_zones, 1, 8, 2),
    _case(records_are_the_zones, 1, 4, 2),
    _case(records_are_the_zones, 2, 8, 2),
    _case(records_are_the_zones, 2, 4, 2),
    _case(records_are_the_zones, 3, 8, 2, bugs=_BUGS, bug_clocks=14),
    _case(records_are_the_zones, 3, 4, 2, campaign=True),
    _case(records_are_the_zones, 3, 8, 2, rows=2, closed=True, campaign=True, bugs=_CLOSED_BUGS, bug_clocks=14),
    _case(records_are_the_zones, 3, 4, 2, rows=2, closed=True, campaign=True),
    _marked(cells_leave_together, 3, 8, bugs=tuple(bug for bug in _BUGS if bug.signal != "y"), bug_clocks=14),
    _marked(cells_leave_together, 3, 4),
    _marked(cells_leave_together, 8, 8, campaign=True),
    _marked(cells_leave_together, 8, 4, campaign=True),
    _marked(a_cell_is_added, 8, 8, bugs=_CELL_BUGS, bug_clocks=14),
    _marked(a_cell_is_added, 16, 8),
    _marked(a_cell_is_added, 16, 4),
    _case(nothing_overflows, 1, 8, 2),
    _case(nothing_overflows, 2, 4, 2),
    _case(nothing_overflows, 3, 8, 2, bugs=_OVERFLOW_BUGS, bug_clocks=17),
    _case(nothing_overflows, 3, 8, 2, rows=2, closed=True, campaign=True),
    _case(nothing_overflows, 3, 4, 2, rows=2, closed=True, campaign=True),
    _case(stalls_change_nothing, 8, 8, 2, bugs=_STALL_BUGS, bug_clocks=16),
    _case(stalls_change_nothing, 8, 4, 2),
    _case(stalls_change_nothing, 8, 4, 2, closed=True),
)
