"""Fault reports."""

from functools import partial
from unittest import mock

from amaranth.hdl import Array, Cat, Const, Mux, Signal, Value

from contactfpga.skin import Skin
from contactfpga.skin.derived import CHECK_BYTES
from contactfpga.wire import protocol
from contactfpga.wire.sheet_number import NUMBER_BYTES, SheetPlace
from contactfpga_hdl.link.faults import Reporter, report_of
from contactfpga_hdl.link.link import Link
from contactfpga_sim.verify.proofs.case import Bug, ProofCase
from contactfpga_sim.verify.proofs.inside import Inside
from contactfpga_sim.verify.proofs.proof import Proof

_ROUND = 4
_IDLE, _FETCH, _BYTE, _TAIL = range(4)


def reports_are_true(proof: Proof, skin: Skin, place_of: SheetPlace | None = None) -> None:
    """Free: the word in each clock, frames, wishes for a hello, when bytes are taken, one place of a report.

    Claimed: the byte at that place follows the word in the clock after the byte before was taken, and is stable. A
    report has the right length. Without one on the wire, after the word was stable for two clocks more than there are
    places, it is the last sent word or a report is due; after a hello one is due, too, until it is taken. Of two
    reports without a hello between them the second does not precede a frame that waited while the first was taken.

    Free for one of several sheets: its grants. Assumed: a grant stays while it is held.
    """
    m = proof.m
    hello = protocol.encode_hello(skin)
    short = hello[:1] + hello[-CHECK_BYTES - 1 :]  # so that a search soon comes to what follows it
    with mock.patch.object(protocol, "encode_hello", return_value=short):
        dut = Link(skin, place_of)
        inside = proof.put(dut)
    closing = CHECK_BYTES
    if place_of is not None:
        closing += NUMBER_BYTES
        grant = Signal()
        m.d.comb += dut.grant.eq(grant)
        m.d.sync += grant.eq(Mux(grant & dut.holds, 1, proof.free(1, "grant")))
        proof.lemma(inside["idle"] | grant)
    _free_inputs(proof, dut)
    word = Value.cast(dut.faults)
    empty = report_of(len(word), 0)
    length = len(empty)
    place = proof.chosen(range(length), "place")
    proof.given(place < length)
    right = Array([Const(length, 8), *(_digit(word, index) for index in range(length - 2)), Const(0x90, 8)])
    take = {name: inside[f"take_{name}"] for name in ("frame", "hello", "report")}
    taken = take["frame"] | take["hello"] | take["report"]
    reports, index = Signal(name="on_wire"), Signal(4, name="index")
    transfer = dut.bytes.valid & dut.bytes.ready
    with m.If(taken):
        m.d.sync += [reports.eq(take["report"]), index.eq(0)]
    with m.Elif(reports & transfer):
        m.d.sync += [index.eq(index + 1), reports.eq(index != length + closing)]
    expected = Signal(8, name="expected")
    sent, ever = Signal(8, name="sent"), Signal(name="ever")
    last = Mux(ever, sent, Array(empty)[place])
    fetched = proof.before(taken | transfer)
    with m.If(fetched):
        m.d.sync += expected.eq(right[place])
    with m.If(reports & dut.bytes.valid & (index == place)):
        proof.claim(dut.bytes.payload == expected)
        m.d.sync += [sent.eq(dut.bytes.payload), ever.eq(1)]
    with m.If(reports & dut.bytes.valid & (index == length + closing)):
        proof.claim(dut.bytes.payload == protocol.DELIMITER)
    proof.claim(~(reports & taken))
    _unreported(proof, dut, inside, reports, take, last, right[place])
    _order(proof, inside, take)
    _lemmas(proof, inside, reports, index, place, expected, last, empty, closing)


def _digit(word: Value, index: int) -> Value:
    bits = word[7 * index : 7 * index + 7]
    return Cat(bits, Const(0, 7 - len(bits)), Const(1, 1))


def _free_inputs(proof: Proof, dut: Link) -> None:
    m, frames = proof.m, dut.frames
    for port, name in ((dut.tag, "tag"), (dut.summary, "summary"), (dut.faults, "faults")):
        m.d.comb += port.eq(proof.free(port.shape(), name))
    ones = {"asked": dut.asked, "epoch": dut.epoch, "number": dut.number, "decide": frames.decide}
    ones |= {"commit": frames.commit, "end": frames.end, "write": frames.write.en}
    ones |= {"write_offset": frames.write.offset, "write_data": frames.write.data}
    for name, port in ones.items():
        m.d.comb += port.eq(proof.free(port.shape(), name))
    m.d.comb += dut.bytes.ready.eq(proof.free(1, "bytes_ready"))


def _unreported(proof: Proof, dut: Link, inside: Inside, reports, take, last, right) -> None:
    m = proof.m
    word = Value.cast(dut.faults)
    stood = Signal(range(_ROUND + 3), name="stood")  # clocks in which no report was on the wire and the word the same
    steady = ~reports & (word == proof.before(word)) & ~take["report"]
    m.d.sync += stood.eq(Mux(steady, Mux(stood == _ROUND + 2, stood, stood + 1), 0))
    due = inside["reporter.due"]
    started = proof.before(Const(1))
    with m.If(started & steady & (stood == _ROUND + 2)):
        proof.claim(due | (last == right))
    with m.If(proof.before(take["hello"])):
        proof.claim(due)
    with m.If(proof.before(due & ~take["report"])):
        proof.claim(due)


def _order(proof: Proof, inside: Inside, take) -> None:
    waits = inside["waits"]
    held = Signal(name="held")  # by the last report, a frame that has waited since
    proof.m.d.sync += held.eq(Mux(take["report"], waits, held & waits & ~take["frame"] & ~take["hello"]))
    proof.claim(~(take["report"] & held & waits))
    proof.lemma(~held | inside["is_report"])


def _lemmas(proof: Proof, inside: Inside, reports, index, place, expected, last, empty: bytes, closing: int) -> None:
    length = len(empty)
    m, state, offset = proof.m, inside["wire_state"], inside["offset"]
    fetch, byte, tail = (state == one for one in (_FETCH, _BYTE, _TAIL))
    proof.lemma((inside["is_report"] & (state != _IDLE)) == reports)
    with m.If(reports):
        proof.lemma(inside["end"] == length)
        with m.If(fetch | byte):
            proof.lemma((offset == index) & ((index < length) | fetch & (index == length) & (inside["tail"] == 0)))
        with m.If(tail):
            proof.lemma((inside["tail"] <= closing) & (index == length + inside["tail"]))
    kept = inside.word("reporter.sent", place)
    writes = inside["reporter.offers"] & (inside["reporter.at"] == place)
    for constant in (0, length - 1):
        with m.If(place == constant):
            proof.lemma(last == empty[constant])
    offered = reports & byte & (index == place)
    proof.lemma(~offered | (inside["reporter.byte"] == expected))
    proof.lemma(Mux(writes, inside["reporter.byte"], kept) == Mux(offered, expected, last))


def _sheet(rows: int, columns: int) -> Skin:
    return Skin(rows=rows, columns=columns, guard=True, settle_us=40)


_PLACED_BUGS = (Bug("reports go first", Link, "is_report", lambda _, inside: Const(0)),)
_BUGS = (
    Bug("no report after a hello", Reporter, "report_due", lambda due, inside: due & ~inside["greeted"]),
    Bug("a change is missed", Reporter, "watched", lambda _, inside: Const(0)),
    Bug("a digit is taken too late", Reporter, "byte", lambda byte, inside: byte ^ inside["offers"]),
    Bug("reports go first", Link, "is_report", lambda _, inside: Const(0)),
    Bug("the last digit is left out", Link, "end", lambda end, inside: end - inside["take_report"]),
)
CASES = (
    ProofCase(
        "reports are true", "1x1, guard lines", partial(reports_are_true, skin=_sheet(1, 1)), 8, _BUGS, bug_clocks=36
    ),
    ProofCase(
        "reports are true",
        "1x1, guard lines, one of two sheets",
        partial(reports_are_true, skin=_sheet(1, 1), place_of=SheetPlace(1, 2)),
        8,
        _PLACED_BUGS,
        bug_clocks=36,
    ),
    ProofCase("reports are true", "2x3, guard lines", partial(reports_are_true, skin=_sheet(2, 3)), 8, campaign=True),
)
