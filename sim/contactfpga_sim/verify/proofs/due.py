"""What the link sends unasked: the first frame after power-up or a restart goes out, whatever is in it."""

from functools import partial
from typing import Any

from amaranth.hdl import Signal, Value

from contactfpga.skin import Skin
from contactfpga_hdl.link.link import Link
from contactfpga_sim.verify.proofs.bugs import Bug
from contactfpga_sim.verify.proofs.case import Case
from contactfpga_sim.verify.proofs.proof import Proof


def first_is_sent(proof: Proof, **changes: Any) -> None:
    """Free: when it is decided about frames, and what these say. Given: each took a row time or more.

    Claimed: no frame is left out before one was sent. So from a restart on, which begins with all registers of the link
    as at power-up, a frame is packed before any is left out: where ``contact`` waits for the first frame, it can wait
    for its ``commit``.
    """
    dut = Link(Skin(rows=2, columns=2, send="on_change", **changes))
    inside = proof.put(dut)
    for port, name in ((dut.summary, "summary"), (dut.tag, "tag"), (dut.time, "time")):
        proof.m.d.comb += Value.cast(port).eq(proof.free(Value.cast(port).shape(), name))
    decide, sends = dut.frames.decide, dut.frames.verdict.send
    proof.m.d.comb += decide.eq(proof.free(1, "decide"))
    if changes["scan"] == "adaptive":
        proof.given(dut.tag.slots != 0)
    sent = Signal(name="sent_one")
    proof.m.d.sync += sent.eq(sent | decide & sends)
    proof.claim(~decide | sends | sent)
    derived = dut.derived
    due = ("turns", derived.keep_alive_turns) if derived.scan.waits else ("pause", derived.keep_alive_frames - 1)
    proof.lemma(sent | (inside[due[0]] == due[1]))


_BUGS = (
    Bug("a hello counts for it", Link, "due", lambda due, inside: due & inside["hello_due"]),
    Bug("the time runs out", Link, "pause", lambda _, inside: inside["pause"] + 1),
)
CASES = (
    Case("the first frame is sent", "raster", partial(first_is_sent, scan="raster"), 2, _BUGS),
    Case("the first frame is sent", "adaptive", partial(first_is_sent, scan="adaptive"), 2),
    Case("the first frame is sent", "line reversal", partial(first_is_sent, scan="reversal", precharge_us=1.0), 2),
)
