"""The designs that are compared, and what each takes of an FPGA."""

from __future__ import annotations

from typing import Any

from contactfpga.skin import Skin
from contactfpga_hdl.board import sizes
from contactfpga_hdl.top import Top
from contactfpga_sim.lab import size
from contactfpga_sim.lab.flips.reference import BAUD, CLOCK_HZ

DESIGNS: dict[str, dict[str, Any]] = {
    "run": {},
    "run, on_change": {"send": "on_change"},
    "serial": {"labeller": "serial"},
    "run, on_change, reversal": {"send": "on_change", "scan": "reversal", "precharge_us": 0.5},
    "run, dual": {"dual": True},
    "run, on_change, dual": {"send": "on_change", "dual": True},
    "serial, dual": {"labeller": "serial", "dual": True},
}
"""Fields that differ from the reference Skin's."""


def skin(design: str) -> Skin:
    """The design with the clock and the line of the study."""
    return Skin(clock_hz=CLOCK_HZ, baud=BAUD, **DESIGNS[design])


def luts(design: str) -> int:
    """LUT4 of the design on a UP5K, with the reference Skin's clock."""
    return size.luts(lambda: Top(Skin(**DESIGNS[design])), sizes.UP5K)
