"""Commands of yosys and nextpnr for bitstreams, simulated netlists and figures."""

import dataclasses

NO_COLLISIONS = "setparam -set COLLISION_X_MASK 1'1 t:$memrd_v2"
"""Option for memories whose words are never used from a clock in which they are written.

Amaranth promises the word before the write; on an FPGA this takes an address comparison and two registers per bit.
"""

_BLOCK_RAMS = 'setattr -set ram_style "block" m:*'


@dataclasses.dataclass(frozen=True)
class Family:
    command: str
    options: str
    before: tuple[str, ...]
    """Yosys commands before synthesis."""
    route: str = ""


FAMILIES = {
    # No other memory there; left alone, yosys makes small ones of flip-flops. Wires take longer than the 750 ps that
    # yosys counts for each: with 2,000 ps fewer LUTs follow one another.
    "iCE40UP": Family(
        "synth_ice40",
        "-abc9 -dff -device u",
        (NO_COLLISIONS, _BLOCK_RAMS, "scratchpad -set synth_ice40.abc9.W 2000"),
    ),
    # Flip-flops of a tile share their enable. One that few have leaves places empty, and the HX1K has none to spare.
    # In an FPGA that full the usual router of nextpnr goes on forever for many seeds; this one ends, but
    # with -dff not for the bitmap of a 16x16 sheet at 48 MHz.
    "iCE40HX": Family(
        "synth_ice40", "-abc9 -device hx -dffe_min_ce_use 6", (NO_COLLISIONS, _BLOCK_RAMS), "--router router2"
    ),
    # The products have a few bits each; the way to a multiplier and back takes longer than they do.
    "LFE5U": Family("synth_ecp5", "-nodsp", (NO_COLLISIONS,)),
}


def overrides(fpga: str) -> dict[str, str]:
    family = _family(fpga)
    return {
        "synth_opts": family.options,
        "script_after_read": "\n".join(family.before),
        "nextpnr_opts": family.route,
    }


def script(fpga: str, top: str, before: tuple[str, ...] | None = None) -> str:
    """Yosys commands that synthesize RTLIL; ``before`` replaces the family's."""
    family = _family(fpga)
    first = family.before if before is None else before
    return "; ".join((*first, f"{family.command} {family.options} -top {top}"))


def _family(fpga: str) -> Family:
    return next(family for name, family in FAMILIES.items() if fpga.startswith(name))
