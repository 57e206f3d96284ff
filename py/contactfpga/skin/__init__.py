"""The one description of a sheet, its limits, and everything that follows from it."""

from contactfpga.errors import SkinError
from contactfpga.skin.skin import Skin

__all__ = ["Skin", "SkinError"]
