"""The divider: every barycenter is the nearest step to sum / area, and no zone or end mark is lost or overtaken."""

from functools import partial

from amaranth.hdl import Mux, Signal, Value

from contactfpga.skin import Skin
from contactfpga_hdl.payloads import barycenter_layout, moments_layout
from contactfpga_hdl.report.divide import Divider
from contactfpga_sim.verify.proofs.bugs import Bug
from contactfpga_sim.verify.proofs.case import Case
from contactfpga_sim.verify.proofs.inside import Inside
from contactfpga_sim.verify.proofs.proof import Proof
from contactfpga_sim.verify.proofs.streams import drain, feed


def zones_are_divided(proof: Proof, rows: int, columns: int, bits: int) -> None:
    """Free: records at any time, and when items are taken. Assumed: zones lie on the sheet.

    Claimed: a zone is taken Q clocks after it is offered, or later if an item waits then, and is offered as an item
    from the next clock on until that is taken; its area is the zone's, and x and y satisfy
    2 area x <= 2^(k + 1) sum + area < 2 area (x + 1). An end mark passes in the clock in which it is taken, if no item
    waits.
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
    _lemmas(proof, dut, inside, age, full, kept)


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


def _lemmas(proof: Proof, dut: Divider, inside: Inside, age, full, kept) -> None:
    """After i steps quotient and remainder are those of the sum's first bits, the others are still to be divided."""
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


_BUGS = (
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
CASES = tuple(
    Case("zones are divided", f"{rows}x{columns}, {bits} fraction bit{'s' * (bits != 1)}",
         partial(zones_are_divided, rows=rows, columns=columns, bits=bits), 2, bugs, bug_clocks=16)
    for rows, columns, bits, bugs in ((3, 4, 2, _BUGS), (2, 2, 1, ()), (5, 1, 0, ()))
)  # fmt: skip
