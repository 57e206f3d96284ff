"""The packer: from items to a frame's stuffed bytes."""

from functools import partial

from amaranth.hdl import Cat, Const, Module, Mux, Signal

from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.link.pack import FULL_BLOCK, Packer
from contactfpga_sim.verify.proofs.case import Bug, ProofCase
from contactfpga_sim.verify.proofs.inside import Inside
from contactfpga_sim.verify.proofs.proof import Proof
from contactfpga_sim.verify.proofs.streams import feed

_STATES = ("ITEMS", "TRAILER", "CLOSE")


def frames_are_packed(proof: Proof, skin: Skin) -> None:
    """Free: items at any time, tag, summary and verdict, and one followed place of the frame. Assumed: no more items
    per frame than fit, by the audit; the tag is stable from ``decide`` to ``commit``, the summary and the verdict's
    numbers from the clock after ``decide`` on.

    Claimed: when a frame closes, that place holds the COBS byte for the bytes of all items, lowest first, and of the
    trailer; the frame ends after its last byte; nothing is written outside. An item is taken with its last byte. The
    frame closes once its bytes are written, and an unsent one leaves nothing.
    """
    m = proof.m
    derived = skin.derived
    dut = Packer(skin, offset_bits=derived.max_stored_bytes.bit_length())
    inside = proof.put(dut)
    place = proof.chosen(range(derived.max_stored_bytes), "place")
    feed(proof, dut.items, "items")
    for port, name in ((dut.tag, "tag"), (dut.summary, "summary"), (dut.frames.verdict, "verdict")):
        m.d.comb += port.eq(proof.free(port.shape(), name))
    plain = _PlainBytes(m, dut)
    _described_until_commit(proof, dut, plain)
    frame = _Followed(m, dut, plain, place)
    proof.given(plain.items <= derived.max_items)
    with m.If(dut.items.valid):
        proof.claim(dut.items.ready == (plain.last_read | plain.decides))
    proof.claim(dut.frames.decide == plain.decides)
    proof.claim(dut.frames.commit == plain.closes)
    proof.claim(dut.frames.write.en == (plain.writes | plain.closes))
    with m.If(dut.frames.write.en):
        proof.claim(dut.frames.write.offset < frame.length + plain.writes)
    with m.If(plain.closes):
        proof.claim(dut.frames.end == frame.length)
        proof.claim((place >= frame.length) | frame.agrees_now)
    _lemmas(proof, dut, inside, plain, frame)


def _described_until_commit(proof: Proof, dut: Packer, plain: "_PlainBytes") -> None:
    verdict = dut.frames.verdict
    numbers = Cat(verdict.sequence, verdict.overwritten, dut.summary)
    tag_before, numbers_before = proof.before(dut.tag), proof.before(numbers)
    with proof.m.If(plain.closing):
        proof.given(dut.tag.as_value() == tag_before)
        proof.given(plain.decided | (numbers == numbers_before))


class _PlainBytes:
    def __init__(self, m: Module, dut: Packer):
        derived, items, send = dut.derived, dut.items, dut.frames.verdict.send
        queue = Signal(8 * max(derived.item_bytes, derived.trailer_bytes), name="queue")
        self.queue = Signal.like(queue, name="queue_now")
        self.left = Signal(range(len(queue) // 8 + 1), name="queued")
        self.items = Signal(range(derived.max_items + 2), name="items_begun")
        self.decided = Signal(name="decided")  # one clock ago, and the frame is sent
        self.closing = Signal(name="closing")  # from the clock after the end mark to the frame's last one
        self.closes = Signal(name="closes")  # in that clock
        self.byte = self.queue[:8]
        self.writes = self.left != 0
        comes = items.valid & ~self.closing & (self.left <= 1)
        begins = comes & ~items.payload.end
        self.decides = comes & items.payload.end
        self.last_read = begins if derived.item_bytes == 1 else ~self.closing & (self.left == 2)
        m.d.comb += self.queue.eq(Mux(self.decided, _trailer(derived, dut), queue))
        with m.If(self.writes):
            m.d.sync += [queue.eq(self.queue >> 8), self.left.eq(self.left - 1)]
        m.d.sync += [self.closes.eq(self.closing & (self.left == 1)), self.decided.eq(self.decides & send)]
        with m.If(self.closes):
            m.d.sync += self.closing.eq(0)
        with m.If(begins):
            m.d.sync += [queue.eq(items.payload.data), self.left.eq(derived.item_bytes), self.items.eq(self.items + 1)]
        with m.If(self.decides):
            m.d.sync += [self.items.eq(0), self.closing.eq(send), self.left.eq(Mux(send, derived.trailer_bytes, 0))]


def _trailer(derived: Derived, dut: Packer):
    """The trailer by docs/protocol.md."""
    summary, verdict = dut.summary, dut.frames.verdict
    kind = {"moments": 5, "cells": 6}[derived.skin.report]
    return Cat(
        dut.tag.time,
        verdict.sequence,
        dut.tag.heard,
        summary.cells,
        summary.zones,
        verdict.overwritten,
        summary.overflow,
        summary.mismatch,
        dut.tag.fault,
        Const(0, 1),
        Const(kind, 4),
    )


class _Followed:
    """One place of a stuffed frame: the ``expected`` byte, and the last written one, ``found``.

    Every zero byte, and an imagined one before the frame, is the place of the distance to the next; others keep their
    place.
    """

    def __init__(self, m: Module, dut: Packer, plain: _PlainBytes, place):
        self.place = place
        self.length = Signal(range(dut.derived.max_stored_bytes + 1), init=1, name="frame_length")
        self.last_zero = Signal.like(self.length, init=0, name="last_zero")
        expected, found = Signal(8, name="expected"), Signal(8, name="found")
        expected_now, found_now = Signal(8, name="expected_now"), Signal(8, name="found_now")
        written = Signal(name="written")  # in this frame
        zero = plain.closes | plain.writes & (plain.byte == 0)
        hit = dut.frames.write.en & (dut.frames.write.offset == place)
        m.d.comb += [expected_now.eq(expected), found_now.eq(Mux(hit, dut.frames.write.data, found))]
        m.d.sync += [expected.eq(expected_now), found.eq(found_now), written.eq(written | hit)]
        with m.If(zero & (self.last_zero == place)):
            m.d.comb += expected_now.eq(self.length - place)
        with m.Elif(plain.writes & (self.length == place)):
            m.d.comb += expected_now.eq(plain.byte)
        with m.If(plain.closes | plain.decides & ~dut.frames.verdict.send):
            m.d.sync += [self.length.eq(1), self.last_zero.eq(0), written.eq(0)]
        with m.Elif(plain.writes):
            m.d.sync += self.length.eq(self.length + 1)
            with m.If(zero):
                m.d.sync += self.last_zero.eq(self.length)
        self.agrees = written & (found == expected)
        self.agrees_now = (written | hit) & (found_now == expected_now)


def _lemmas(proof: Proof, dut: Packer, inside: Inside, plain: _PlainBytes, frame: _Followed) -> None:
    derived, left = dut.derived, plain.left
    state = Mux(plain.closes, _STATES.index("CLOSE"), Mux(plain.closing, _STATES.index("TRAILER"), 0))
    proof.lemma((inside["part_state"] == state) & (inside["plain__valid"] == plain.writes))
    proof.lemma(~plain.writes | (inside["plain__payload"] == plain.byte))
    proof.lemma(Mux(plain.closes, plain.closing & ~plain.writes, ~plain.closing | plain.writes))
    _lemmas_on_reading(proof, dut, inside["index"], plain)
    open_length = inside["length"]  # of the block that is being filled
    proof.lemma((open_length != 0) & (open_length <= frame.length))
    proof.lemma(inside["full"] == (open_length == FULL_BLOCK))
    proof.lemma(inside["place"] == frame.length)
    proof.lemma(inside["code"] == frame.length - open_length)
    proof.lemma(frame.last_zero == frame.length - open_length)
    proof.lemma((frame.place == frame.last_zero) | (frame.place >= frame.length) | frame.agrees)
    proof.lemma(plain.items <= derived.max_items)
    written = frame.length - 1 + left
    longest = derived.max_items * derived.item_bytes + derived.trailer_bytes
    closing = (written <= longest) & (plain.items == 0)
    proof.lemma(Mux(plain.closing, closing, written == plain.items * derived.item_bytes))


def _lemmas_on_reading(proof: Proof, dut: Packer, index, plain: _PlainBytes) -> None:
    m, left, payload = proof.m, plain.left, dut.items.payload
    item_bytes, trailer_bytes = dut.derived.item_bytes, dut.derived.trailer_bytes
    proof.lemma(~plain.decided | plain.closing & (left == trailer_bytes))
    with m.If(plain.closing & plain.writes):
        proof.lemma((left <= trailer_bytes) & (index == trailer_bytes + 1 - left))
        proof.lemma(plain.queue == _trailer(dut.derived, dut) >> (8 * (trailer_bytes - left)[: len(left)]))
    with m.Elif(left > 1):
        proof.lemma((left <= item_bytes) & (index == item_bytes + 1 - left))
        proof.lemma(dut.items.valid & ~payload.end)
        proof.lemma(plain.queue == payload.data >> (8 * (item_bytes - left)[: len(left)]))
    with m.Else():
        proof.lemma(index == 0)


_ITEMS, _TRAILER, _CLOSE = range(len(_STATES))


def _in_state(inside: Inside, state: int):
    return inside["part_state"] == state


def _last_byte_first(byte, inside: Inside):
    dut = inside.component
    swapped = dut.items.payload.data.word_select(
        (dut.derived.item_bytes - 1 - inside["index"])[: len(inside["index"])], 8
    )
    return Mux(_in_state(inside, _ITEMS) & dut.items.valid & ~dut.items.payload.end, swapped, byte)


def _taken_early(ready, inside: Inside):
    dut = inside.component
    return ready | _in_state(inside, _ITEMS) & (inside["index"] == dut.derived.item_bytes - 2)


def _closes_early(state, inside: Inside):
    last = inside["index"] == inside.component.derived.trailer_bytes - 1
    return Mux(_in_state(inside, _TRAILER) & last, _CLOSE, state)


def _item_again(byte, inside: Inside):
    return Mux(inside["frames__decide"], inside.component.items.payload.data[:8], byte)


_BUGS = (
    Bug("the item is taken a byte early", Packer, "items__ready", _taken_early),
    Bug("a zero too many", Packer, "ends_block", lambda ends, inside: ends | (inside["plain__payload"] == 1)),
    Bug("the length is off by one", Packer, "length", lambda length, inside: length + (length == inside["length"] + 1)),
    Bug("highest byte first", Packer, "plain__payload", _last_byte_first),
    Bug("the trailer begins with an item's byte", Packer, "plain__payload", _item_again),
    Bug("closes a byte early", Packer, "part_state", _closes_early),
    Bug("what is not sent stays", Packer, "restart", lambda restart, inside: restart & ~_in_state(inside, _ITEMS)),
    Bug("two fields change places", Packer, "trailer.cells", lambda _, inside: inside.component.summary.zones),
)
_ZONES = Skin(rows=2, columns=4, zone_capacity=2, settle_us=40)
_CELLS = Skin(rows=2, columns=4, report="cells", settle_us=40)
CASES = (
    ProofCase("frames are packed", "2x4, 2 zones", partial(frames_are_packed, skin=_ZONES), 2, _BUGS, bug_clocks=20),
    ProofCase("frames are packed", "2x4, cells", partial(frames_are_packed, skin=_CELLS), 2),
)
