"""The public names of :mod:`contactfpga_sim.lab.mujoco`; needs the extra ``mujoco``."""

from contactfpga_sim.lab.mujoco import *
from contactfpga_sim.lab.mujoco import __all__ as __all__
