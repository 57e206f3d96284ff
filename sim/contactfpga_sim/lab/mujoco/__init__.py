"""A robot in MuJoCo that wears sheets: contacts press switches, and the driver gets the board's bytes."""

from contactfpga_sim.lab.mujoco.sheets import Sheets
from contactfpga_sim.lab.mujoco.touch import SheetTouch
from contactfpga_sim.lab.mujoco.wear import wear
from contactfpga_sim.lab.mujoco.worn import WornSheet

__all__ = ["SheetTouch", "Sheets", "WornSheet", "wear"]
