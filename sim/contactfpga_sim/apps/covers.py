"""The studies' covers, of parts that one can buy or cut, and their sheets, of one extent; none was built."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from contactfpga.design.cover import Cap, Cover, Switch
from contactfpga.skin import Skin

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

EXTENT_MM = 160.0

MOST_ZONES = 32
"""Zones per frame, enough here; more would need longer row times on the finest sheets."""


def sheet(pitch_mm: float, **settings: Any) -> Skin:
    """A square sheet of :data:`EXTENT_MM`, by default 4-connected."""
    lines = round(EXTENT_MM / pitch_mm)
    given: dict[str, Any] = {"connectivity": 4, "zone_capacity": MOST_ZONES} | settings
    return Skin(rows=lines, columns=lines, pitch_x_mm=pitch_mm, pitch_y_mm=pitch_mm, **given)
