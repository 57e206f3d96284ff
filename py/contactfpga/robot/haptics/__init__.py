"""How hard, where, and how sure: forces at the zones, from pressure units under the bumper.

SI units, in the link's frame. A wrench is what contacts exert on the link; normals point out of it; no push is
below 0.
"""

from contactfpga.robot.haptics.alone import AloneWatch
from contactfpga.robot.haptics.answer import HapticsError
from contactfpga.robot.haptics.calibrate import Calibration, calibrate
from contactfpga.robot.haptics.closings import ClosingWatch
from contactfpga.robot.haptics.contact import Contact, Contacts, Touch
from contactfpga.robot.haptics.drift import Drift, DriftWatch
from contactfpga.robot.haptics.evidence import Closing
from contactfpga.robot.haptics.live import WithReadings, felt
from contactfpga.robot.haptics.locate import Locator, Place, closed
from contactfpga.robot.haptics.reach import Reach
from contactfpga.robot.haptics.solve import contacts
from contactfpga.robot.haptics.surface import Center, Cylinder, Plane
from contactfpga.robot.haptics.unit import Unit
from contactfpga.robot.haptics.units import LoadCells
from contactfpga.robot.haptics.wrench import Bumper, Motion, Noise, Wrench

__all__ = [
    "AloneWatch",
    "Bumper",
    "Calibration",
    "Center",
    "Closing",
    "ClosingWatch",
    "Contact",
    "Contacts",
    "Cylinder",
    "Drift",
    "DriftWatch",
    "HapticsError",
    "LoadCells",
    "Locator",
    "Motion",
    "Noise",
    "Place",
    "Plane",
    "Reach",
    "Touch",
    "Unit",
    "WithReadings",
    "Wrench",
    "calibrate",
    "closed",
    "contacts",
    "felt",
]
