"""The studies' covers, of parts that one can buy or cut; none was built."""

from __future__ import annotations

from collections.abc import Callable

from contactfpga.design.cover import Cap, Cover, Switch

GAP_MM = 0.6

FOAM_M = 2e-3

DOME = Switch(force_n=0.4, travel_m=0.2e-3, spread=0.1, hysteresis=0.2)
"""A light metal dome switch."""


def bare(pitch_mm: float) -> Cover | None:
    """No cover: a switch closes without force if its middle is under the contact."""
    return None


def paper(pitch_mm: float) -> Cover:
    """The paper's switch, 1 N on a face of 12.6 mm2, flush under 5 mm of foam glued on a rigid base."""
    return Cover("foam", 5e-3, Switch())


def capped(pitch_mm: float, switch: Switch = DOME) -> Cover:
    """Proud caps under whole foam."""
    return Cover("foam", FOAM_M, switch, cap=Cap((pitch_mm - GAP_MM) * 1e-3))


def tiled(pitch_mm: float, switch: Switch = DOME) -> Cover:
    """Proud caps, each under its own foam tile."""
    return Cover("foam", FOAM_M, switch, cap=Cap((pitch_mm - GAP_MM) * 1e-3), cut=True)


COVERS: dict[str, Callable[[float], Cover | None]] = {
    "bare": bare,
    "paper": paper,
    "caps": capped,
    "tiles": tiled,
}
"""Covers by name, as functions of pitch in mm."""
