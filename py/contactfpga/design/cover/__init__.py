"""The soft cover between a contact and the switches: which of them close.

Units are SI; stress is positive in compression. The paper is Battaglia et al., "Combining Haptic Sensing with Safe
Interaction", cited by equation number with misprints corrected; Johnson is K. L. Johnson, "Contact mechanics" (1985).
"""

from contactfpga.design.cover.answer import CoverError, NoSolution
from contactfpga.design.cover.cell import ResistiveCell
from contactfpga.design.cover.cells import Cells, cells_of
from contactfpga.design.cover.felt import Felt, Sheet, feel
from contactfpga.design.cover.hertz import Ball
from contactfpga.design.cover.layers import BODIES, Body, Indentation
from contactfpga.design.cover.patch import Ellipse, Part, Rectangle
from contactfpga.design.cover.point import Switch
from contactfpga.design.cover.press import MODELS, Bed, Cap, Cover, Indenter, Load, load_cover

__all__ = [
    "BODIES",
    "MODELS",
    "Ball",
    "Bed",
    "Body",
    "Cap",
    "Cells",
    "Cover",
    "CoverError",
    "Ellipse",
    "Felt",
    "Indentation",
    "Indenter",
    "Load",
    "NoSolution",
    "Part",
    "Rectangle",
    "ResistiveCell",
    "Sheet",
    "Switch",
    "cells_of",
    "feel",
    "load_cover",
]
