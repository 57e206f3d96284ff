"""Limits of two board houses for a rigid board with two layers, read in November 2026 from copies of their pages."""

from __future__ import annotations

import dataclasses


@dataclasses.dataclass(frozen=True)
class House:
    """Least sizes in mm without an extra price, and the longest sides of a board."""

    name: str
    source: str
    board_mm: tuple[float, float]
    """The longer and the shorter side."""
    track_mm: float
    """Least width of a track and clearance between two."""
    drill_mm: float
    ring_mm: float
    """Copper around a plated hole."""
    print_mm: float
    text_mm: float
    bare_mm: float
    """Distance of print from a pad's opening."""


HOUSES = (
    House("JLCPCB", "https://jlcpcb.com/capabilities/Capabilities", (500, 400), 0.127, 0.3, 0.15, 0.15, 1.0, 0.15),
    House("PCBWay", "https://www.pcbway.com/capabilities.html", (1100, 500), 0.1, 0.3, 0.15, 0.15, 0.8, 0.15),
)


def too_large(width_mm: float, height_mm: float) -> str:
    """A sentence for a board that one of the houses does not list; "" for any other."""
    short, long = sorted((width_mm, height_mm))
    found = [house for house in HOUSES if long > house.board_mm[0] or short > house.board_mm[1]]
    if not found:
        return ""
    listed = " and ".join("{} ({:g} x {:g} mm)".format(house.name, *house.board_mm) for house in found)
    others = ", ".join(house.name for house in HOUSES if house not in found)
    step = f"order it from {others}" if others else "ask a house for an offer, or make several smaller sheets"
    return f"a board of {width_mm:.0f} x {height_mm:.0f} mm is larger than listed by {listed}: {step}"
