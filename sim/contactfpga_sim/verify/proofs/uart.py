"""The UART's framing, and pulses read by their length."""

from functools import partial

from amaranth.hdl import Array, Cat, Const, Mux, Signal

from contactfpga_hdl.link.pulses import PulseReceiver
from contactfpga_hdl.link.uart import Transmitter
from contactfpga_sim.verify.proofs.case import Bug, ProofCase
from contactfpga_sim.verify.proofs.inside import Inside
from contactfpga_sim.verify.proofs.proof import Proof


def framing(proof: Proof, bit_clocks: int) -> None:
    """Free: bytes at any time.

    Claimed: after a byte is taken there is a start bit, its bits, lowest first, and a stop bit, ``bit_clocks`` each;
    else the line is high. The next byte is taken in the stop bit's last clock or whenever nothing is sent, and in no
    other clock.
    """
    m = proof.m
    dut = Transmitter(bit_clocks)
    inside = proof.put(dut)
    valid, byte = proof.free(1, "valid"), proof.free(8, "byte")
    m.d.comb += [dut.bytes.valid.eq(valid), dut.bytes.payload.eq(byte)]
    bit = Signal(range(11), init=10)  # 10: nothing is sent
    phase = Signal(range(bit_clocks))
    frame = Signal(10)
    idle, ends = bit == 10, phase == bit_clocks - 1
    proof.claim(dut.bytes.ready == (idle | (bit == 9) & ends))
    proof.claim(dut.pin == Mux(idle, 1, Array(frame)[bit]))
    with m.If(valid & dut.bytes.ready):
        m.d.sync += [frame.eq(Cat(Const(0, 1), byte, Const(1, 1))), bit.eq(0), phase.eq(0)]
    with m.Elif(~idle):
        m.d.sync += [phase.eq(Mux(ends, 0, phase + 1)), bit.eq(bit + ends)]
    proof.lemma((bit <= 10) & (phase < bit_clocks) & (inside["bits_left"] == 10 - bit))
    with m.If(idle):
        proof.lemma(inside["shift"] == 0x1FF)
    with m.Else():
        proof.lemma(inside["clock"] == bit_clocks - 1 - phase)
        proof.lemma(inside["shift"] == (Cat(frame[1:], Const(0x3FF, 10)) >> bit)[:9])


def _taken(inside: Inside):
    stream = inside.component.bytes
    return stream.valid & stream.ready


_BUGS = (
    Bug("no start bit", Transmitter, "pin", lambda pin, inside: Mux(_taken(inside), 1, pin)),
    Bug("a bit short", Transmitter, "bits_left", lambda left, inside: Mux(_taken(inside), 9, left)),
    Bug("stop bit low", Transmitter, "shift", lambda shift, inside: Mux(_taken(inside), shift[:8], shift)),
    Bug("highest bit first", Transmitter, "shift",
        lambda shift, inside: Mux(_taken(inside), Cat(shift[:8][::-1], shift[8]), shift)),
    Bug("taken a bit early", Transmitter, "bytes__ready",
        lambda ready, inside: ready | (inside["bits_left"] == 2) & (inside["clock"] == 0)),
)  # fmt: skip


def read_by_length(proof: Proof, bit_clocks: int) -> None:
    """Free: the level of the pin.

    Claimed: a bit or a mark comes exactly where the level, two clocks late, rises. The low level before is up to 3 bits
    long for a one, over 7 for a zero, and between for a mark. ``good`` comes a clock after the eighth bit since a byte
    or a mark, at once for a mark between bytes, and a clock after ``bad`` for one in a byte.
    """
    m = proof.m
    dut = PulseReceiver(bit_clocks)
    inside = proof.put(dut)
    pin = proof.free(1, "pin")
    m.d.comb += dut.pin.eq(pin)
    one, mark = 3 * bit_clocks, 7 * bit_clocks
    level = proof.before(proof.before(pin, init=1), init=1)
    past = Signal(mark + 1, init=(1 << mark + 1) - 1)  # levels before, the last one lowest
    m.d.sync += past.eq(Cat(level, past))
    rises = level & ~past[0]
    short, long = past[: one + 1].any(), ~past.any()
    is_bit, is_mark = rises & (short | long), rises & ~short & ~long
    bits = Signal(range(9))  # of the byte so far, or all of one that is whole
    begun = Mux(bits == 8, 0, bits)
    with m.If(is_bit):
        m.d.sync += bits.eq(begun + 1)
    with m.Elif(is_mark | (bits == 8)):
        m.d.sync += bits.eq(0)
    proof.claim(dut.bits.bit == is_bit)
    with m.If(is_bit):
        proof.claim((dut.bits.level == short) & (dut.bits.index == begun))
    cut = is_mark & (bits != 0)
    was_cut = proof.before(cut)
    proof.claim(dut.bits.good == ((bits == 8) | was_cut | is_mark & (bits == 0)))
    proof.claim(dut.bits.bad == cut)
    proof.lemma((bits <= 8) & (inside["bits__index"] == bits[:3]) & (inside["whole"] == (was_cut | (bits == 8))))
    for length in range(mark + 2):
        ended = past[length] if length <= mark else 1
        with m.If(~past[:length].any() & ended):
            proof.lemma(inside["low"] == length)
    with m.If((bits == 8) | was_cut):
        proof.lemma(past[0])


_PULSE_BUGS = (
    Bug("a mark has to last a clock longer", PulseReceiver, "mark", lambda mark, inside: mark & (inside["low"] != 7)),
    Bug("a mark within a byte leaves its bits", PulseReceiver, "bits__index",
        lambda index, inside: Mux(inside["mark"], inside["bits__index"], index)),
    Bug("a mark of no bits is bad", PulseReceiver, "bits__bad", lambda bad, inside: inside["ends"] & inside["mark"]),
    Bug("a long low level is counted over", PulseReceiver, "low",
        lambda low, inside: Mux(inside["low"] == 15, 0, low)),
)  # fmt: skip
CASES = (
    ProofCase("UART framing", "4 clocks per bit", partial(framing, bit_clocks=4), 2, _BUGS, bug_clocks=44),
    ProofCase("UART framing", "5 clocks per bit", partial(framing, bit_clocks=5), 2),
    ProofCase("UART framing", "104 clocks per bit", partial(framing, bit_clocks=104), 2),
    ProofCase(
        "pulses by their length", "2 clocks a bit", partial(read_by_length, bit_clocks=2), 4, _PULSE_BUGS, bug_clocks=24
    ),
    ProofCase("pulses by their length", "3 clocks a bit", partial(read_by_length, bit_clocks=3), 4),
)
