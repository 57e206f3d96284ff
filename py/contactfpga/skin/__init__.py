"""The description of a sheet, its limits, and derived quantities."""

from contactfpga.errors import SkinError
from contactfpga.skin.skin import Skin

__all__ = ["Skin", "SkinError"]
