"""A sheet as files to order: the matrix of a Skin laid out on a board, and what its lines come to as a circuit."""

from contactfpga.design.sheet.layout import Layout, lay_out
from contactfpga.design.sheet.parts import SWITCHES, SheetError

__all__ = ["SWITCHES", "Layout", "SheetError", "lay_out"]
