"""LUT4, flip-flops, block RAMs and clock of a whole design by place and route, measured once and kept."""

from __future__ import annotations

import dataclasses
import hashlib

from amaranth.back import rtlil

from contactfpga.skin import Skin
from contactfpga_hdl import sizes
from contactfpga_hdl.top import Top
from contactfpga_sim.chart import kept

DEVICE = sizes.UP5K


def measure(skin: Skin) -> sizes.Size:
    """On :data:`DEVICE`, from one seed; some ten seconds to minutes, unless this very netlist was measured before."""
    netlist = rtlil.convert(Top(skin), name="top", emit_src=False)
    key = hashlib.sha256(f"{DEVICE} {netlist}".encode()).hexdigest()

    def new() -> dict:
        return dataclasses.asdict(sizes.measure(lambda: Top(skin), DEVICE, seeds=1))

    return sizes.Size(**kept.kept("size", key, new))
