"""The public names of :mod:`contactfpga.design.circuit`."""

from contactfpga.design.circuit import *
from contactfpga.design.circuit import __all__ as __all__
