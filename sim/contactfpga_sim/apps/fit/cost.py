"""LUT4 of a Skin."""

from __future__ import annotations

from contactfpga.skin import Skin
from contactfpga_hdl.board import sizes
from contactfpga_hdl.top import Top
from contactfpga_sim.apps import result_cache, size

DEVICE = sizes.UP5K


def luts_of(skin: Skin) -> int:
    """LUT4 of the design; takes seconds unless cached."""
    # A cached count spares looking at the netlist of the same Skin again.
    key = f"{result_cache.made_by(__name__, skin)} {size.tools(DEVICE)}"
    found: int = result_cache.cached("fit-luts", key, lambda: size.luts(lambda: Top(skin), DEVICE))
    return found
