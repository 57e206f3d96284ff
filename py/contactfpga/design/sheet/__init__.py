"""A sheet as files to order: a Skin's matrix laid out on a board, and the circuit of its lines."""

from contactfpga.design.sheet.layout import Layout, lay_out
from contactfpga.design.sheet.parts import SWITCHES, SheetError

__all__ = ["SWITCHES", "Layout", "SheetError", "lay_out"]
