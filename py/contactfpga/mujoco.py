"""The public names of :mod:`contactfpga_sim.apps.mujoco`; needs the extra ``mujoco``."""

from contactfpga.errors import MissingExtra

try:
    from contactfpga_sim.apps.mujoco import *
    from contactfpga_sim.apps.mujoco import __all__ as __all__
except ModuleNotFoundError as error:
    raise MissingExtra(f"contactfpga.mujoco ({error})", "mujoco") from None
