"""What yosys and nextpnr do: the same for bitstreams, for simulated netlists and for the figures."""

import dataclasses

NO_COLLISIONS = "setparam -set COLLISION_X_MASK 1'1 t:$memrd_v2"
"""No word is read in the clock in which it is written, or it is not used: what such a read gives may be anything.

Amaranth promises the word before the write, and an FPGA's memory does not: keeping that promise costs a comparison
of the addresses and two registers per bit.
"""

_BLOCK_RAMS = 'setattr -set ram_style "block" m:*'


@dataclasses.dataclass(frozen=True)
class Family:
    """How designs for the FPGAs of a family are made."""

    command: str
    options: str
    before: tuple[str, ...]
    """Commands of yosys that come before it."""
    route: str = ""
    """Options of nextpnr."""


FAMILIES = {
    # No other memory there; left alone, yosys makes small ones of flip-flops.
    "iCE40UP": Family("synth_ice40", "-abc9 -device u", (NO_COLLISIONS, _BLOCK_RAMS)),
    # Flip-flops of a tile share their enable. One that few have leaves places empty, and the HX1K has none to spare.
    # In an FPGA that full the usual router of nextpnr goes on forever for many seeds; this one ends.
    "iCE40HX": Family(
        "synth_ice40", "-abc9 -device hx -dffe_min_ce_use 6", (NO_COLLISIONS, _BLOCK_RAMS), "--router router2"
    ),
    # The products have a few bits each; the way to a multiplier and back takes longer than they do.
    "LFE5U": Family("synth_ecp5", "-nodsp", (NO_COLLISIONS,)),
}
"""By the beginning of the FPGA's name."""


def overrides(fpga: str) -> dict[str, str]:
    """The same for Amaranth's platforms."""
    family = _family(fpga)
    return {
        "synth_opts": family.options,
        "script_after_read": "\n".join(family.before),
        "nextpnr_opts": family.route,
    }


def script(fpga: str, top: str, before: tuple[str, ...] | None = None) -> str:
    """Yosys commands that synthesize what was read as RTLIL; ``before`` instead of the family's."""
    family = _family(fpga)
    first = family.before if before is None else before
    return "; ".join((*first, f"{family.command} {family.options} -top {top}"))


def _family(fpga: str) -> Family:
    return next(family for name, family in FAMILIES.items() if fpga.startswith(name))
