"""The check for flipped registers finds none while none flips."""

from functools import partial

from contactfpga.choices import scans
from contactfpga.skin import Skin
from contactfpga_hdl.scan.frame_clock import FrameClock
from contactfpga_hdl.scan.pins import DirectRows
from contactfpga_hdl.scan.raster import Scanner
from contactfpga_sim.verify.proofs.case import Bug, ProofCase
from contactfpga_sim.verify.proofs.proof import Proof

SKINS = {
    "raster": Skin(rows=4, columns=2, settle_us=1, zone_capacity=1),
    "reversal": Skin(rows=4, columns=2, scan="reversal", precharge_us=0.5, zone_capacity=1),
}


def none_is_found(proof: Proof, scan: str) -> None:
    """Free: all inputs of a scan. Claimed: it never asks for a restart."""
    dut = scans.find(scan).load_gateware()(SKINS[scan])
    inside = proof.put(dut)
    for path, member, port in dut.signature.flatten(dut):
        if member.flow.name == "In":
            proof.m.d.comb += port.eq(proof.free(len(port), "_".join(map(str, path))))
    proof.claim(~dut.upset)
    if scan == "raster":
        following = inside["following"]
        proof.lemma((following != 0) & (following & (following - 1) == 0))


_ROW = Bug("a row flips", DirectRows, "selected",
    lambda rows, inside: rows ^ ~(inside.component.drive | inside.component.release))  # fmt: skip


def _bugs(scan: str) -> tuple[Bug, ...]:
    def time(bit: int) -> Bug:
        return Bug(f"bit {bit} of the time flips", FrameClock, "time",
            lambda time, inside: time ^ inside.component.request << bit)  # fmt: skip

    slot = Bug("a bit of the slot's row flips", Scanner, "following",
        lambda rows, inside: rows ^ inside.component.request << 1)  # fmt: skip
    return (time(0), time(7), *((slot, _ROW) if scan == "raster" else ()))


CASES = tuple(
    ProofCase("no register is found wrong", f"4x2, {scan}", partial(none_is_found, scan=scan), 2, _bugs(scan))
    for scan in SKINS
)
