"""Records of frames as words."""

from functools import partial

from amaranth.hdl import Cat, Const, Mux, Signal

from contactfpga.skin import Skin
from contactfpga_hdl.link.records import NUMBER_BITS, Records
from contactfpga_sim.verify.proofs.case import Bug, ProofCase
from contactfpga_sim.verify.proofs.inside import Inside
from contactfpga_sim.verify.proofs.proof import Proof
from contactfpga_sim.verify.proofs.streams import drain


def frames_leave_whole(proof: Proof, skin: Skin) -> None:
    """Free: items at any time, whether a frame is sent, restarts, and when words are taken. Assumed: no more items per
    frame than fit, by the audit.

    Claimed: the words offered are those of whole frames, each word once and in order, and the last one is marked. The
    frame offered next is the newest whole one. A frame is lost only if the next one's first item comes while it waits,
    and then the next one that is whole is offered, sent or not. A frame's first word is offered two clocks after the
    frame is whole and the last word of the frame before is offered; each further one as soon as the word before is
    taken. Followed: one place of all frames, which the solver chooses.
    """
    m, derived = proof.m, skin.derived
    dut = Records(skin)
    inside = proof.put(dut)
    taken, item = proof.free(1, "taken"), proof.free(dut.item.shape(), "item")
    send, restart = proof.free(1, "send"), proof.free(1, "restart")
    m.d.comb += [dut.taken.eq(taken), dut.item.eq(item), dut.send.eq(send), dut.restart.eq(restart)]
    for port, name in ((dut.tag, "tag"), (dut.summary, "summary")):
        m.d.comb += port.eq(proof.free(port.shape(), name))
    drain(proof, dut.words, "words")
    place = proof.chosen(range(derived.max_items + 1), "place")

    count, number = Signal(range(derived.max_items + 1)), Signal(NUMBER_BITS)
    lost = Signal()  # a whole frame was, and none has been whole since
    filled, whole, left = (_Frame(place, dut.words.payload.data.shape(), name) for name in ("filled", "whole", "left"))
    at = Signal.like(count)  # of the word to be offered next
    handed = whole.there & ~left.there
    loses = lost | whole.there & ~handed
    ends = item.end & (send | loses)
    word = Mux(item.end, _closing_word(dut, number), item.data)
    proof.given(~taken | item.end | (count != derived.max_items))
    with m.If(handed):
        m.d.sync += [*left.copy(whole), at.eq(0), whole.there.eq(0)]
    with m.If(taken):
        m.d.sync += [count.eq(Mux(item.end, 0, count + 1)), lost.eq(loses & ~item.end), whole.there.eq(ends)]
        m.d.sync += number.eq(number + ends)
        with m.If(count == place):
            m.d.sync += filled.word.eq(word)
        with m.If(ends):
            m.d.sync += [whole.last.eq(count), whole.word.eq(Mux(count == place, word, filled.word))]
    with m.If(restart):
        m.d.sync += count.eq(0)

    offers = left.there & (~dut.words.valid | dut.words.ready)  # a new word in the next clock
    offered = proof.before(Cat(offers, at == place, left.word, at == left.last))
    with m.If(offers):
        m.d.sync += [at.eq(at + 1), left.there.eq(at != left.last)]
    begun = proof.before(Const(1))
    proof.claim(~begun | (dut.words.valid == (offered[0] | proof.before(dut.words.valid & ~dut.words.ready))))
    with m.If(offered[0]):
        proof.claim(~offered[1] | (dut.words.payload.data == offered[2:-1]))
        proof.claim(dut.words.payload.last == offered[-1])
    _lemmas(proof, inside, place, at, (count, filled), whole, left)
    proof.lemma((inside["number"] == number) & (inside["must_keep"] == lost))


class _Frame:
    """A frame that may be there: the place of its last word, and its word at the followed place."""

    def __init__(self, place, word, name: str):
        self.there = Signal(name=f"{name}_there")
        self.last = Signal(place.shape(), name=f"{name}_last")
        self.word = Signal(word, name=f"{name}_word")

    def copy(self, other: "_Frame") -> list:
        return [self.there.eq(other.there), self.last.eq(other.last), self.word.eq(other.word)]


def _closing_word(dut: Records, number):
    tag, summary = dut.tag, dut.summary
    flags = Cat(summary.overflow, summary.mismatch, tag.fault)
    motion = tag.motion if dut.skin.reads_rows else Const(0, 0)
    return Cat(tag.time, number, summary.cells, summary.zones, flags, motion)


def _lemmas(proof: Proof, inside: Inside, place, at, filling: tuple, whole: _Frame, left: _Frame) -> None:
    count, filled = filling
    half, bits = inside["read_half"], len(inside["place"])
    read, write = (inside.word("store", Cat(place, Const(0, 8))[:bits] | (side << bits)) for side in (half, ~half))
    proof.lemma(inside["place"] == count)
    proof.lemma((inside["frame_waits"] == whole.there) & (inside["reading"] == left.there))
    proof.lemma(~whole.there | (count == 0) & (inside["end"] == whole.last))
    proof.lemma(~whole.there | (place > whole.last) | (write == whole.word))
    proof.lemma((place >= count) | (write == filled.word))
    longest = inside.component.derived.max_items
    proof.lemma((count <= longest) & (~whole.there | (whole.last <= longest)))
    (reading,) = inside.part("store").read_ports
    with proof.m.If(left.there):
        proof.lemma((at <= left.last) & (left.last <= longest) & (inside["last"] == left.last))
        proof.lemma(reading.addr[:bits] == at)
        proof.lemma((place < at) | (place > left.last) | (read == left.word))


_BUGS = (
    Bug("a frame is overwritten as it is read", Records, "write__addr",
        lambda address, _: address ^ (1 << len(address) - 1)),
    Bug("a frame waits on while the next one is filled", Records, "frame_waits",
        lambda waits, inside: waits | inside["frame_waits"] & ~inside.component.item.end),
    Bug("a replaced frame is not made up for", Records, "must_keep", lambda *_: 0),
    Bug("the last word is not marked", Records, "closes", lambda *_: 0),
    Bug("a word is dropped while the reader waits", Records, "fetches", lambda _, inside: inside["reading"]),
    Bug("two fields change places", Records, "closing.cells", lambda _, inside: inside.component.summary.zones),
    Bug("a restart leaves items", Records, "place",
        lambda place, inside: Mux(inside.component.restart, inside["place"], place)),
    Bug("frames that are not sent are counted", Records, "number",
        lambda _, inside: inside["number"] + (inside["taken"] & inside.component.item.end)),
)  # fmt: skip
_ZONES = Skin(rows=2, columns=3, report="moments", zone_capacity=2)
_CELLS = Skin(rows=3, columns=4, report="cells", scan="reversal", precharge_us=1)
CASES = (
    ProofCase("records leave in whole frames", "2x3, 2 zones", partial(frames_leave_whole, skin=_ZONES), 1, _BUGS),
    ProofCase("records leave in whole frames", "3x4, cells", partial(frames_leave_whole, skin=_CELLS), 1),
)
