"""The odometer's digits are the counts."""

from functools import partial

from amaranth.hdl import Cat, Const, Signal

from contactfpga.wire.protocol import DIGIT_BITS, EPOCH_DIGITS, SENT_DIGITS
from contactfpga_hdl.link.odometer import LIVE_DIGITS, Odometer
from contactfpga_sim.verify.proofs.bugs import Bug
from contactfpga_sim.verify.proofs.case import Case
from contactfpga_sim.verify.proofs.proof import Proof

_REST, _READ, _WRITE, _CLEAR = range(4)


def digits_are_the_counts(proof: Proof, counter: str) -> None:
    """Free: pulses of both counters at any time, hold, and the place that is read. Assumed: no pulse comes while one of
    its kind waits.

    Claimed: once the digits were cleared, and with no carry under way or waiting, the digits of the counter make up how
    many pulses there were, modulo what they can hold; ``digit`` is that of the place a clock before; other places hold
    0.
    """
    m = proof.m
    dut = Odometer()
    inside = proof.put(dut)
    for port, name in ((dut.sent, "sent"), (dut.epoch, "epoch"), (dut.hold, "hold"), (dut.place, "place")):
        m.d.comb += port.eq(proof.free(port.shape(), name))
    state, at = inside["carry_state"], inside["at"]
    waits = {"sent": inside["sent_waits"], "epoch": inside["epoch_waits"]}
    proof.given(~(dut.sent & waits["sent"]) & ~(dut.epoch & waits["epoch"]))
    first, last = (LIVE_DIGITS, SENT_DIGITS - 1) if counter == "sent" else (SENT_DIGITS, SENT_DIGITS + EPOCH_DIGITS - 1)
    words = {place: inside.word("digits", Const(place, 4)) for place in range(16)}
    value = Cat(words[place] for place in range(first, last + 1))
    counted = Signal(len(value), name="counted")
    with m.If(getattr(dut, counter)):
        m.d.sync += counted.eq(counted + 1)
    ours = (at >= first) & (at <= last)
    carry = Signal(len(value), name="carry")
    for place in range(first, last + 1):
        with m.If((state != _REST) & (state != _CLEAR) & (at == place)):
            m.d.comb += carry.eq(1 << DIGIT_BITS * (place - first))
    with m.If((state == _REST) & ~waits[counter]):
        proof.claim(value == counted)
    with m.If(proof.before(state == _REST)):
        before = proof.before(dut.place)
        for place in range(16):
            with m.If((before == place) & (state == _REST)):
                proof.claim(dut.digit == words[place])
    for place in (*range(LIVE_DIGITS), *range(SENT_DIGITS + EPOCH_DIGITS, 16)):
        proof.claim((words[place] == 0) | (state == _CLEAR))
    with m.If(state == _CLEAR):
        proof.lemma(counted == waits[counter])
        for place, word in words.items():
            proof.lemma((word == 0) | (place >= at))
    with m.Else():
        proof.lemma((value + carry + waits[counter])[: len(value)] == counted)
        proof.lemma((state == _REST) | ours | _others(at, counter))
    with m.If(state == _WRITE):
        read = Signal(DIGIT_BITS, name="read")
        for place, word in words.items():
            with m.If(at == place):
                m.d.comb += read.eq(word)
        proof.lemma(dut.digit == read)


def _others(at, counter: str):
    low, high = (SENT_DIGITS, SENT_DIGITS + EPOCH_DIGITS - 1) if counter == "sent" else (LIVE_DIGITS, SENT_DIGITS - 1)
    return (at >= low) & (at <= high)


_BUGS = (
    Bug("the epoch begins a place late", Odometer, "at",
        lambda at, inside: at + ((inside["carry_state"] == _REST) & (at == SENT_DIGITS) & (inside["at"] != at))),
    Bug("a pulse is lost while the other counter's waits", Odometer, "epoch_waits",
        lambda waits, inside: waits & ~((inside["carry_state"] == _REST) & inside["sent_waits"])),
)  # fmt: skip
CASES = (
    Case("digits are the counts", "frames sent", partial(digits_are_the_counts, counter="sent"), 2),
    Case("digits are the counts", "epoch", partial(digits_are_the_counts, counter="epoch"), 2, _BUGS, bug_clocks=30),
)
