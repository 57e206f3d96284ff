"""Two differing copies are stopped within a byte."""

from functools import partial

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from contactfpga.skin import Skin
from contactfpga_hdl.dual import PAUSE_BITS, Dual
from contactfpga_sim.verify.proofs.case import Bug, ProofCase
from contactfpga_sim.verify.proofs.proof import Proof


class _Core(wiring.Component):
    """Any gateware: its outputs are free. ``runs`` is low in the clock after a reset."""

    def __init__(self, said: Value):
        self.said = said
        self.runs = Signal()
        super().__init__({"tx": Out(1, init=1), "rows": Out(1), "contact": Out(1), "rx": In(1, init=1)})

    def elaborate(self, platform):
        m = Module()
        m.d.comb += Cat(self.tx, self.rows, self.contact).eq(self.said)
        m.d.sync += self.runs.eq(1)
        return m


def differences_stop_the_line(proof: Proof, fail_safe: bool) -> None:
    """Free: outputs of both copies in each clock, and the level of ``rx``.

    Claimed: until the second's output differs from the first's a clock before, all outputs are the first's, ``contact``
    with ``fail_safe`` a clock later. A difference makes ``tx`` low from the next clock on, for longer than a byte, and
    ``contact`` with ``fail_safe`` high until a scan after the restart. Both are reset until the line was high as long.
    The second's reset and ``rx`` are the first's a clock later.
    """
    m = proof.m
    skin = Skin(rows=1, columns=1, dual=True, fail_safe=fail_safe)
    said = [proof.free(3, name) for name in ("first_said", "second_said")]
    first, second = map(_Core, said)
    dut = Dual(skin, first, second)
    inside = proof.put(dut)
    m.d.comb += dut.rx.eq(proof.free(1, "rx"))
    pause, scan = PAUSE_BITS * skin.derived.bit_clocks, skin.derived.frame_clocks
    last = 2 * pause + scan
    since = Signal(range(last + 3), init=last + 2)  # the last difference, in clocks
    resets = proof.before(inside["holds"], init=1)  # of the second, which starts a clock late
    differs = (proof.before(said[0]) != said[1]) & ~resets
    m.d.sync += since.eq(Mux(differs, 1, Mux(since <= last + 1, since + 1, since)))
    differed = Signal()
    m.d.sync += differed.eq(differed | differs)
    with m.If(~differed):
        proof.claim(Cat(dut.tx, dut.rows) == said[0][:2])
        proof.claim(dut.contact == (proof.before(said[0][2]) if fail_safe else said[0][2]))
    with m.If(since <= pause):
        proof.claim(~dut.tx)
    with m.If((since > 1) & (since <= 2 * pause + 1)):
        proof.claim(~first.runs)
    with m.If(since <= last):
        proof.claim(dut.contact | (not fail_safe))
    proof.claim(second.runs == proof.before(first.runs))
    proof.claim(second.rx == proof.before(dut.rx, init=1))
    proof.claim(first.rx == dut.rx)
    proof.lemma(differed | (since == last + 2))
    proof.lemma(inside["left"] == Mux(since <= last, last + 1 - since, 0))
    proof.lemma(inside["breaks"] == (since <= pause + 1))
    proof.lemma(inside["holds"] == (since <= 2 * pause + 1))
    proof.lemma((not fail_safe) | (since > last + 1) | dut.contact)
    proof.lemma(inside["holds_second"] == resets)
    proof.lemma(first.runs == proof.before(~inside["holds"]))
    proof.lemma(second.runs == proof.before(~resets))
    proof.lemma(inside["before"] == proof.before(said[0]))


_BUGS = (
    Bug("the line is broken for a clock only", Dual, "breaks", lambda breaks, inside: inside["differs"]),
    Bug("the copies are not reset together", Dual, "holds_second", lambda holds, inside: 0),
    Bug("a difference shows in one of the outputs only", Dual, "differs",
        lambda differs, inside: differs & ~inside["holds"] & inside["tx"]),
)  # fmt: skip
CASES = (
    ProofCase("differences stop the line", "two copies, contact fail-safe",
              partial(differences_stop_the_line, fail_safe=True), 2, _BUGS),
    ProofCase("differences stop the line", "two copies", partial(differences_stop_the_line, fail_safe=False), 2),
)  # fmt: skip
