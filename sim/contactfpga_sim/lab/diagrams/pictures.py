"""Draws the diagrams of the pages."""

from __future__ import annotations

from pathlib import Path

import matplotlib

from contactfpga import picture_style as style
from contactfpga.design import kits
from contactfpga_sim.lab.diagrams import cutaway, packet, together, touch, wires


def draw(folder: Path) -> list[Path]:
    kit = kits.kit("starter")
    with matplotlib.rc_context(style.SETTINGS):
        return [
            together.draw(kit, folder / "together.svg"),
            cutaway.draw(kit, folder / "cutaway.svg"),
            touch.draw(folder / "touch.svg"),
            wires.draw(kit, folder / "wiring.svg"),
            packet.draw(kit.skin, folder / "packet.svg"),
        ]
