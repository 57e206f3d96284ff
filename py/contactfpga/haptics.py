"""The public names of :mod:`contactfpga.robot.haptics`."""

from contactfpga.robot.haptics import *
from contactfpga.robot.haptics import __all__ as __all__
