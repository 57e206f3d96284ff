"""The public names of :mod:`contactfpga.design.cover`."""

from contactfpga.design.cover import *
from contactfpga.design.cover import __all__ as __all__
