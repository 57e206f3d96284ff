"""A robot in MuJoCo that wears sheets, read by the driver."""

from contactfpga_sim.lab.mujoco.sheets import Sheets
from contactfpga_sim.lab.mujoco.touch import SheetTouch
from contactfpga_sim.lab.mujoco.wear import wear
from contactfpga_sim.lab.mujoco.worn import WornSheet

__all__ = ["SheetTouch", "Sheets", "WornSheet", "wear"]
