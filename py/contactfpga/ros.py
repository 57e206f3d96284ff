"""The public names of :mod:`contactfpga.robot.ros`."""

from contactfpga.robot.ros import *
from contactfpga.robot.ros import __all__ as __all__
