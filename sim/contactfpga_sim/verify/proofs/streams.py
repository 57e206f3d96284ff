"""Stages that pass on their inputs; and the divider."""

from functools import partial

from amaranth.hdl import Cat, Mux, Signal, Value

from contactfpga.choices.debounces import DebounceName
from contactfpga.skin import Skin
from contactfpga_hdl.debounce.even import Debounce
from contactfpga_hdl.payloads import moments_layout
from contactfpga_hdl.report.audit import Audit
from contactfpga_hdl.report.backlog import Queue
from contactfpga_hdl.report.bitmap import Bitmap
from contactfpga_hdl.report.divide import Divider, barycenter_layout
from contactfpga_sim.verify.proofs.case import Bug, ProofCase
from contactfpga_sim.verify.proofs.inside import Inside
from contactfpga_sim.verify.proofs.proof import Proof


def feed(proof: Proof, port, name: str):
    """Free offers to a stream, each assumed unchanged until it is taken."""
    payload = Value.cast(port.payload)
    valid, value = proof.free(1, f"{name}_valid"), proof.free(len(payload), name)
    proof.m.d.comb += [port.valid.eq(valid), payload.eq(value)]
    with proof.m.If(proof.before(valid & ~port.ready)):
        proof.given(valid & (value == proof.before(value)))


def drain(proof: Proof, port, name: str):
    """Free reads of a stream, whose offers are claimed unchanged until then."""
    proof.m.d.comb += port.ready.eq(proof.free(1, f"{name}_ready"))
    offers_stay(proof, port)


def offers_stay(proof: Proof, port) -> None:
    payload = Value.cast(port.payload)
    with proof.m.If(proof.before(port.valid & ~port.ready)):
        proof.claim(port.valid & (payload == proof.before(payload)))


def debounce(proof: Proof, method: DebounceName) -> None:
    """Free: rows at any time, and when they are taken. Without a debounce time the stage changes nothing.

    Claimed: each row is offered once, ``columns + 3`` clocks after it was taken, unchanged, until it is taken.
    """
    m = proof.m
    skin = Skin(rows=4, columns=3, debounce=method, debounce_press_us=0, debounce_release_us=0, settle_us=20)
    dut = Debounce(skin)
    inside = proof.put(dut)
    feed(proof, dut.raw, "raw")
    drain(proof, dut.rows, "rows")
    latency = skin.columns + 3
    age = Signal(range(latency + 1))  # clocks since a row was taken that is still inside; 0: none is
    row = Signal(dut.raw.payload.shape())
    with m.If(dut.raw.valid & dut.raw.ready):
        m.d.sync += [age.eq(1), row.eq(dut.raw.payload)]
    with m.Elif(dut.rows.valid & dut.rows.ready):
        m.d.sync += age.eq(0)
    with m.Elif((age != 0) & (age != latency)):
        m.d.sync += age.eq(age + 1)
    proof.claim(dut.raw.ready == (age == 0))
    proof.claim(dut.rows.valid == (age == latency))
    with m.If(dut.rows.valid):
        proof.claim(dut.rows.payload.as_value() == row.as_value())
    phases = [(age >= first) & (age <= last) for first, last in ((1, 3), (2, 4), (3, 5), (5, 5))]
    proof.lemma(age <= latency)
    proof.lemma(Cat(inside[name] for name in ("busy", "decide", "store", "finish")) == Cat(phases))
    with m.If(inside["busy"]):
        proof.lemma(inside["column"] == age - 1)


def audit(proof: Proof, capacity: int = 2) -> None:
    """Free: records at any time, and when items are taken. Assumed: no more zones per frame than possible.

    Claimed: of each frame the first ``capacity`` zones and the end mark pass, each in the clock in which it is taken;
    the others are taken and dropped. The summary counts all and flags missing ones.
    """
    m = proof.m
    dut = Audit(Skin(rows=3, columns=4, connectivity=4, zone_capacity=capacity, settle_us=20))
    inside = proof.put(dut)
    feed(proof, dut.records, "records")
    drain(proof, dut.items, "items")
    m.d.comb += [dut.taken.eq(proof.free(1, "taken")), dut.row.eq(proof.free(len(Value.cast(dut.row)), "row"))]
    record, item = dut.records.payload, dut.items.payload
    zones = Signal(dut.derived.zones_bits + 1)
    counted = Signal.like(zones)
    ended = Signal()
    taken = dut.records.valid & dut.records.ready
    with m.If(taken):
        m.d.sync += zones.eq(Mux(record.end, 0, zones + 1))
        with m.If(record.end):
            m.d.sync += [counted.eq(zones), ended.eq(1)]
    proof.given(zones <= dut.derived.skin.max_zones())
    passes = record.end | (zones < capacity)
    proof.claim((dut.items.valid & dut.items.ready) == (taken & passes))
    proof.claim(dut.items.valid == (dut.records.valid & passes))
    proof.claim(~(dut.records.valid & ~passes) | dut.records.ready)
    with m.If(dut.items.valid):
        proof.claim((item.end == record.end) & (item.data == record.zone.as_value()))
    with m.If(ended):
        proof.claim((dut.summary.zones == counted) & (dut.summary.overflow == (counted > capacity)))
    proof.lemma((inside["zones"] == zones) & (inside["overflow"] == (zones > capacity)))
    proof.lemma(counted <= dut.derived.skin.max_zones())


def bitmap(proof: Proof) -> None:
    """Free: rows at any time, and when items are taken.

    Claimed: a row is taken in the clock in which it passes on, unchanged. Three clocks after a last one an end mark is
    offered once, before any other row is taken.
    """
    m = proof.m
    dut = Bitmap(Skin(rows=3, columns=4, report="cells", settle_us=20))
    inside = proof.put(dut)
    feed(proof, dut.rows, "rows")
    drain(proof, dut.items, "items")
    since_last = Signal(2)  # clocks since a last row whose end mark is to come, 3 at most; 0: none is
    row, item = dut.rows.payload, dut.items.payload
    with m.If(since_last == 0):
        m.d.sync += since_last.eq(dut.rows.valid & dut.rows.ready & row.last)
        proof.claim(dut.items.valid == dut.rows.valid)
        proof.claim(dut.rows.ready == dut.items.ready)
        proof.claim(~dut.items.valid | (item.data == row.cells) & ~item.end)
    with m.Else():
        with m.If(since_last != 3):
            m.d.sync += since_last.eq(since_last + 1)
        with m.Elif(dut.items.ready):
            m.d.sync += since_last.eq(0)
        proof.claim(~dut.rows.ready)
        proof.claim(dut.items.valid == (since_last == 3))
        proof.claim(~dut.items.valid | item.end)
    proof.lemma(inside["countdown"] == Mux(since_last == 0, 0, 4 - since_last))


def backlog(proof: Proof, depth: int) -> None:
    """The queue before the packer. Free: items at any time, when they are taken, and one followed item.

    Claimed: the item leaves unchanged, after exactly those in before it; an item inside for two clocks is offered;
    there is room until all but one place are taken.
    """
    m = proof.m
    dut = Queue(width=4, depth=depth)
    inside = proof.put(dut)
    offered = dut.waiting.valid
    puts, takes = proof.free(1, "puts") & dut.items.ready, proof.free(1, "takes") & offered
    item, follow = proof.free(4, "item"), proof.free(1, "follow")
    m.d.comb += [dut.items.valid.eq(puts), dut.items.payload.eq(item), dut.waiting.ready.eq(takes)]
    count, ahead = Signal(range(depth + 1)), Signal(range(depth + 1))
    followed, kept = Signal(), Signal(4)
    m.d.sync += count.eq(count + puts - takes)
    with m.If(followed & takes):
        m.d.sync += [followed.eq(ahead != 0), ahead.eq(ahead - 1)]
    with m.Elif(~followed & puts & follow):
        m.d.sync += [followed.eq(1), kept.eq(item), ahead.eq(count - takes)]
    next_out = followed & (ahead == 0)
    proof.claim(~(next_out & offered) | (dut.waiting.payload == kept))
    proof.claim((count <= depth) & (~offered | (count != 0)) & (dut.items.ready | (count >= depth - 1)))
    with m.If(proof.before((count != 0) & ~takes)):
        proof.claim(offered)
    with m.If(proof.before(offered & ~takes)):
        proof.claim(offered & (dut.waiting.payload == proof.before(dut.waiting.payload)))
    produce, consume = inside["put"], inside["taken"]
    stored, place = Signal(range(depth)), Signal(range(depth))
    m.d.comb += [stored.eq(produce - consume), place.eq(consume + ahead - offered)]
    word = inside.word("storage", place)
    proof.lemma(stored + offered == count)
    proof.lemma(~followed | (ahead < count))
    proof.lemma(~followed | (offered & (ahead == 0)) | (word == kept))


_DEBOUNCE_BUGS = (
    Bug("withdrawn", Debounce, "rows__valid", lambda _, inside: inside["finish"]),
    Bug("a row taken while one waits", Debounce, "raw__ready", lambda ready, inside: ready | inside["rows__valid"]),
    Bug("columns swapped", Debounce, "rows__payload.cells",
        lambda cells, inside: Mux(inside["decide"], Cat(inside["rows__payload.cells"], inside["next_pressed"]), cells)),
    Bug("a column short", Debounce, "busy",
        lambda busy, inside: busy & (inside["column"] != inside.component.skin.columns - 2)),
)  # fmt: skip
_AUDIT_BUGS = (
    Bug("one too many", Audit, "items__valid",
        lambda valid, inside: valid | inside.component.records.valid & (inside["zones"] == 2)),
    Bug("the end mark is dropped", Audit, "items__valid", lambda valid, inside: valid & (inside["zones"] < 2)),
    Bug("taken without being passed on", Audit, "records__ready", lambda *_: 1),
    Bug("not counted from 0 again", Audit, "zones", lambda zones, inside: Mux(zones == 0, inside["zones"], zones)),
)  # fmt: skip
_BITMAP_BUGS = (
    Bug("the mark comes again", Bitmap, "countdown",
        lambda left, inside: Mux(inside["countdown"] == 1, inside["countdown"], left)),
    Bug("the mark is withdrawn", Bitmap, "countdown", lambda left, inside: Mux(inside["countdown"] == 1, 0, left)),
    Bug("a row is lost", Bitmap, "rows__ready", lambda _, inside: inside.component.items.ready),
)  # fmt: skip
_BACKLOG_BUGS = (
    Bug("one too many", Queue, "items__ready", lambda *_: 1),
    Bug("an item comes again", Queue, "waiting__valid", lambda offered, inside: offered | inside["waiting__valid"]),
    Bug("an item is passed over", Queue, "taken",
        lambda place, inside: place + (
            inside["waiting__valid"] & ~inside.component.waiting.ready & (inside["put"] != inside["taken"])
        )),
)  # fmt: skip


def zones_are_divided(proof: Proof, rows: int, columns: int, bits: int) -> None:
    """Free: records at any time, and when items are taken. Assumed: zones are on the sheet.

    Claimed: a zone is taken Q clocks after it is offered, or later if an item waits then, and is offered as an item
    from the next clock on until that is taken; its area is the zone's, and x and y satisfy 2 area x <= 2^(k + 1) sum +
    area < 2 area (x + 1). An end mark passes in the clock in which it is taken, if no item waits.
    """
    m = proof.m
    dut = Divider(Skin(rows=rows, columns=columns, report="barycenter", barycenter_bits=bits, settle_us=20))
    inside = proof.put(dut)
    feed(proof, dut.records, "records")
    drain(proof, dut.items, "items")
    record, zone = dut.records.payload, dut.records.payload.zone
    _assume_on_the_sheet(proof, zone, rows, columns)
    divided = dut.records.valid & ~record.end
    taken = dut.records.valid & dut.records.ready
    clocks = dut.derived.quotient_bits
    age = Signal(range(clocks + 1))  # clocks that the zone has been offered
    full, kept = Signal(), Signal(moments_layout(dut.derived), name="kept")
    with m.If(divided & (age != clocks)):
        m.d.sync += age.eq(age + 1)
    with m.If(dut.items.valid & dut.items.ready):
        m.d.sync += full.eq(0)
    with m.If(divided & taken):
        m.d.sync += [full.eq(1), kept.eq(zone), age.eq(0)]
    free = ~full | dut.items.ready
    with m.If(dut.records.valid):
        proof.claim(dut.records.ready == Mux(record.end, ~full & dut.items.ready, (age == clocks) & free))
    proof.claim(dut.items.valid == (full | dut.records.valid & record.end))
    with m.If(dut.items.valid):
        proof.claim(dut.items.payload.end == ~full)
    with m.If(full):
        _claim_nearest(proof, dut, kept, bits)
    _divide_lemmas(proof, dut, inside, age, full, kept)


def _assume_on_the_sheet(proof: Proof, zone, rows: int, columns: int) -> None:
    proof.given((zone.area != 0) & (zone.area <= rows * columns))
    proof.given((zone.sum_x <= zone.area * (columns - 1)) & (zone.sum_y <= zone.area * (rows - 1)))


def _claim_nearest(proof: Proof, dut: Divider, kept, bits: int) -> None:
    layout = barycenter_layout(dut.derived)
    item = dut.items.payload.data[: layout.size]
    proof.claim(dut.items.payload.data[layout.size :] == 0)
    proof.claim(item[: layout["area"].width] == kept.area[: layout["area"].width])
    for name in ("x", "y"):
        field = layout[name]
        step = item[field.offset : field.offset + field.width]
        wanted = (kept[f"sum_{name}"] << bits + 1) + kept.area
        proof.claim((2 * kept.area * step <= wanted) & (wanted < 2 * kept.area * (step + 1)))


def _divide_lemmas(proof: Proof, dut: Divider, inside: Inside, age, full, kept) -> None:
    m = proof.m
    record, clocks = dut.records.payload, dut.derived.quotient_bits
    area = record.zone.area
    proof.lemma(inside["waits"] == full)
    proof.lemma(inside["left"] == Mux(age == 0, 0, clocks + 1 - age))
    proof.lemma((age == 0) | dut.records.valid & ~record.end)
    waiting = inside["waiting"]
    fraction = clocks - dut.derived.cell_bits
    for place, (name, lines) in enumerate((("x", dut.derived.skin.columns), ("y", dut.derived.skin.rows))):
        quotient = waiting[place * clocks :][:clocks]
        total = kept[f"sum_{name}"] << fraction
        with m.If(full):
            proof.lemma((kept.area * quotient <= total) & (total < kept.area * (quotient + 1)))
            proof.lemma(inside["area"] == kept.area[: len(inside["area"])])
            proof.lemma(quotient <= lines - 1 << fraction)
        dividend = Value.cast(record.zone[f"sum_{name}"] << fraction)
        remainder, register = ~inside[f"{name}_remainder"], inside[f"{name}_bits"]
        for steps in range(clocks):
            with m.If(age == steps + 1):
                proof.lemma(remainder < area)
                proof.lemma(remainder + area * register[:steps] == dividend >> clocks - steps)
                proof.lemma(register[steps:] == dividend[: clocks - steps])


_DIVIDE_BUGS = (
    Bug("rounds down", Divider, "waiting.x", lambda quotient, _: quotient & ~1),
    Bug("what just fits does not", Divider, "x_less", lambda less, _: less + 1),
    Bug("a bit too few", Divider, "left",
        lambda left, inside: left - ((inside["left"] == 0) & (left != 0))),
    Bug("what waits changes under an end mark", Divider, "waiting",
        lambda quotients, inside: Mux(inside["waits"], quotients, inside["found"])),
    Bug("overwrites what waits", Divider, "waiting",
        lambda quotients, inside: Mux(inside["left"] == 1, inside["found"], quotients)),
    Bug("the end mark goes first", Divider, "records__ready",
        lambda ready, inside: Mux(inside.component.records.payload.end, inside.component.items.ready, ready)),
    Bug("begins with a bit too many", Divider, "x_begun",
        lambda _, inside: inside.component.records.payload.zone.sum_x >> inside.component.derived.cell_bits - 1),
)  # fmt: skip
CASES = (
    ProofCase("debounce hands on each row", "3 columns, sym_defer_pk", partial(debounce, method="sym_defer_pk"), 10,
              _DEBOUNCE_BUGS, bug_clocks=20),
    ProofCase("audit passes each record", "4 columns, 2 zones", audit, 2, _AUDIT_BUGS),
    ProofCase("bitmap passes each row", "3x4", bitmap, 2, _BITMAP_BUGS),
    ProofCase("backlog keeps each item", "4 items", partial(backlog, depth=4), 3, _BACKLOG_BUGS, bug_clocks=14),
    ProofCase("backlog keeps each item", "16 items", partial(backlog, depth=16), 3),
    *(
    ProofCase("zones are divided", f"{rows}x{columns}, {bits} fraction bit{'s' * (bits != 1)}",
              partial(zones_are_divided, rows=rows, columns=columns, bits=bits), 2, bugs, bug_clocks=16)
    for rows, columns, bits, bugs in ((3, 4, 2, _DIVIDE_BUGS), (2, 2, 1, ()), (5, 1, 0, ()))),
)  # fmt: skip
