"""Contact zones of a switch-matrix skin, from an FPGA to Python."""

from contactfpga.skin import Skin, SkinError

__all__ = ["Skin", "SkinError"]
