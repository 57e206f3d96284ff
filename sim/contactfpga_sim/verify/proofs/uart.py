"""The UART's framing."""

from functools import partial

from amaranth.hdl import Array, Cat, Const, Mux, Signal

from contactfpga_hdl.link.uart import Transmitter
from contactfpga_sim.verify.proofs.bugs import Bug
from contactfpga_sim.verify.proofs.case import Case
from contactfpga_sim.verify.proofs.inside import Inside
from contactfpga_sim.verify.proofs.proof import Proof


def framing(proof: Proof, bit_clocks: int) -> None:
    """Free: bytes at any time.

    Claimed: after a byte is taken there is a start bit, its bits, lowest first, and a stop bit, ``bit_clocks`` each;
    else the line is high. The next byte is taken in the last clock of the stop bit or whenever nothing is sent, and in
    no other clock, so that no byte is lost or sent twice.
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
CASES = (
    Case("UART framing", "4 clocks per bit", partial(framing, bit_clocks=4), 2, _BUGS, bug_clocks=44),
    Case("UART framing", "5 clocks per bit", partial(framing, bit_clocks=5), 2),
    Case("UART framing", "104 clocks per bit", partial(framing, bit_clocks=104), 2),
)
