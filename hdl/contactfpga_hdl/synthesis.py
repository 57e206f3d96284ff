"""What yosys is told: the same for bitstreams, for the netlists that are simulated, and for the figures."""

NO_COLLISIONS = "setparam -set COLLISION_X_MASK 1'1 t:$memrd_v2"
"""No word is read in the clock in which it is written, or it is not used: what such a read gives may be anything.

Amaranth promises the word before the write, and an FPGA's memory does not: keeping that promise costs a comparison
of the addresses and two registers a bit.
"""

_BLOCK_RAMS = 'setattr -set ram_style "block" m:*'

FAMILIES = {
    # No other memory there; left alone, yosys makes small ones of flip-flops.
    "iCE40UP": ("synth_ice40", "-abc9 -device u", (NO_COLLISIONS, _BLOCK_RAMS)),
    # Flip-flops of a tile share their enable. One that few have leaves places empty, and the HX1K has none to spare.
    "iCE40HX": ("synth_ice40", "-abc9 -device hx -dffe_min_ce_use 6", (NO_COLLISIONS, _BLOCK_RAMS)),
    # The products have a few bits each; the way to a multiplier and back takes longer than they do.
    "LFE5U": ("synth_ecp5", "-nodsp", (NO_COLLISIONS,)),
}
"""By the beginning of the FPGA's name: synthesis command, its options, and what comes before it."""


def overrides(fpga: str) -> dict[str, str]:
    """The same for Amaranth's platforms."""
    _, options, before = _family(fpga)
    return {"synth_opts": options, "script_after_read": "\n".join(before)}


def script(fpga: str, top: str) -> str:
    """Yosys commands that synthesise what was read as RTLIL."""
    command, options, before = _family(fpga)
    return "; ".join((*before, f"{command} {options} -top {top}"))


def _family(fpga: str) -> tuple[str, str, tuple[str, ...]]:
    return next(family for name, family in FAMILIES.items() if fpga.startswith(name))
