"""Several sheets on a line."""

from functools import partial
from unittest import mock

from amaranth.hdl import Const, Mux, Signal

from contactfpga.skin import Skin
from contactfpga.wire import protocol
from contactfpga.wire.sheet_number import SheetPlace
from contactfpga_hdl.link.link import Link
from contactfpga_hdl.several import RoundRobin
from contactfpga_sim.verify.proofs.case import Bug, ProofCase
from contactfpga_sim.verify.proofs.proof import Proof

_SKIN = Skin(rows=1, columns=2, report="cells", settle_us=40)
_GUARDED = _SKIN.replace(guard=True)
_PLACE = SheetPlace(1, 2)


def grants_go_round(proof: Proof, sheets: int) -> None:
    """Free: which sheets hold the grant in each clock.

    Claimed: in each clock one sheet has the grant, initially the first, and keeps it while it holds it; then the next
    sheet has it, cyclically. So a sheet that does not hold the grant delays no other.
    """
    m = proof.m
    dut = RoundRobin(sheets)
    proof.put(dut)
    holds = proof.free(sheets, "holds")
    m.d.comb += dut.holds.eq(holds)
    whose = Signal(range(sheets))
    with m.If(~holds.bit_select(whose, 1)):
        m.d.sync += whose.eq(Mux(whose == sheets - 1, 0, whose + 1))
    proof.claim(dut.grant == (Const(1, sheets) << whose)[:sheets])
    proof.lemma(whose < sheets)


def packets_are_whole(proof: Proof, hello: bytes, skin: Skin = _SKIN) -> None:
    """Free: all inputs of a sheet's link in each clock, and its waits for the grant. Assumed: the grant stays while it
    is held, as ``grants_go_round`` shows.

    Claimed: the link offers bytes and takes anything only with the grant, and releases it only when the last byte sent,
    if any, was a delimiter. After a byte it releases the grant with nothing in hand, so it sends one packet per grant.
    """
    m = proof.m
    with mock.patch.object(protocol, "encode_hello", return_value=hello):
        dut = Link(skin, _PLACE)
        inside = proof.put(dut)
    for name in ("asked", "epoch", "number", "tag", "summary", *(["faults"] if skin.guard else [])):
        port = getattr(dut, name)
        m.d.comb += port.eq(proof.free(port.shape(), name))
    frames = dut.frames
    for port, name in ((frames.write.en, "en"), (frames.write.data, "data"), (frames.write.offset, "offset")):
        m.d.comb += port.eq(proof.free(port.shape(), name))
    for port, name in ((frames.decide, "decide"), (frames.commit, "commit"), (frames.end, "end")):
        m.d.comb += port.eq(proof.free(port.shape(), name))
    m.d.comb += dut.bytes.ready.eq(proof.free(1, "ready"))
    grant = Signal()
    m.d.comb += dut.grant.eq(grant)
    m.d.sync += grant.eq(Mux(grant & dut.holds, 1, proof.free(1, "grant")))
    moves = dut.bytes.valid & dut.bytes.ready
    last = Signal(8)  # byte sent; at first as after a delimiter
    sent = Signal()  # a byte with this grant
    with m.If(moves):
        m.d.sync += last.eq(dut.bytes.payload)
    m.d.sync += sent.eq(grant & dut.holds & (sent | moves))
    takes = inside["take_frame"] | inside["take_hello"] | (inside["take_report"] if skin.guard else 0)
    proof.claim(grant | ~dut.bytes.valid)
    proof.claim(grant | ~takes)
    proof.claim(~(sent & takes))
    with m.If(grant & ~dut.holds):
        proof.claim(Mux(moves, dut.bytes.payload, last) == 0)
    proof.lemma(inside["idle"] | grant)
    with m.If(inside["idle"]):
        proof.lemma((last == 0) & ~sent)


_GRANT_BUGS = (
    Bug("a grant is given up in a packet", RoundRobin, "others", lambda others, inside: inside["grant"]),
    Bug("the first sheet always has a grant", RoundRobin, "grant", lambda grant, inside: grant | 1),
)
_REPORT_BUGS = (
    Bug("a report is taken without a grant", Link, "take_report",
        lambda take, inside: take | inside["idle"] & inside["reporter.due"]),
    Bug("a report does not hold its grant", Link, "holds", lambda holds, inside: holds & ~inside["take_report"]),
)  # fmt: skip
_PACKET_BUGS = (
    Bug("taken without a grant", Link, "take_frame",
        lambda take, inside: take | inside["idle"] & inside["waits"] & ~inside["take_hello"]),
    Bug("given up before the delimiter", Link, "holds", lambda holds, inside: holds & (inside["tail"] < 4)),
    Bug("kept for the next packet", Link, "holds", lambda holds, inside: holds | ~inside["idle"]),
)  # fmt: skip
CASES = (
    ProofCase("grants go round", "2 sheets", partial(grants_go_round, sheets=2), 2, _GRANT_BUGS),
    ProofCase("grants go round", "16 sheets", partial(grants_go_round, sheets=16), 2),
    ProofCase(
        "packets of several sheets are whole",
        "1x2, hello of 3 bytes",
        partial(packets_are_whole, hello=bytes([0, 2, 0x40, *[0x80] * 3, 0])),
        2,
        _PACKET_BUGS,
        bug_clocks=28,
    ),
    ProofCase(
        "packets of several sheets are whole",
        "1x2, guard lines, hello of 3 bytes",
        partial(packets_are_whole, hello=bytes([0, 2, 0x40, *[0x80] * 3, 0]), skin=_GUARDED),
        2,
        _REPORT_BUGS,
        bug_clocks=28,
    ),
    ProofCase(
        "packets of several sheets are whole",
        "1x2",
        partial(packets_are_whole, hello=protocol.encode_hello(_SKIN, place=_PLACE)),
        2,
    ),
)
