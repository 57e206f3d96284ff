"""The public names of :mod:`contactfpga.robot.body`."""

from contactfpga.robot.body import *
from contactfpga.robot.body import __all__ as __all__
