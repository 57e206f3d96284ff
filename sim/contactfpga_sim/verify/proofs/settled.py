"""A scan that obeys "sample at", and never was told to."""

from amaranth.hdl import Value

from contactfpga.skin.derived import Derived
from contactfpga_hdl.scan.pins import moves_sample
from contactfpga_sim.verify.proofs.inside import Inside
from contactfpga_sim.verify.proofs.proof import Proof


def at_settle_time(proof: Proof, inside: Inside, derived: Derived, slot: Value | None = None) -> None:
    """Samples stay at the end of the settle time; ``slot``: the clock within a slot of a raster scan."""
    if not moves_sample(derived):
        return
    settle = derived.settle_clocks
    part = "cycle." if derived.skin.reads_rows else ""
    clock, following = inside[f"{part}sample_clock"], inside[f"{part}next_sample_clock"]
    proof.lemma((clock == settle) & (following == settle) & ~inside[f"{part}early"])
    if slot is not None:
        proof.lemma(inside["sample_due"] == ((slot == settle) | (slot == settle + 1)))
