"""The public names of :mod:`contactfpga.tools.recordings`."""

from contactfpga.tools.recordings import *
from contactfpga.tools.recordings import __all__ as __all__
