"""A robot in MuJoCo that wears sheets, read by the driver."""

from contactfpga_sim.apps.mujoco.sheets import Sheets
from contactfpga_sim.apps.mujoco.touch import SheetTouch
from contactfpga_sim.apps.mujoco.wear import wear
from contactfpga_sim.apps.mujoco.worn import WornSheet

__all__ = ["SheetTouch", "Sheets", "WornSheet", "wear"]
