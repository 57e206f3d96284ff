"""Forces at the zones with their uncertainty, from pressure units under the bumper.

Units are SI, in the link's frame. Contacts exert a wrench on the link; normals point outward; pushes are at least 0.
"""

from contactfpga.robot.haptics.calibrate import Calibration, Drift, DriftWatch, calibrate
from contactfpga.robot.haptics.contact import AloneWatch, Contact, Contacts, Touch
from contactfpga.robot.haptics.live import ClosingWatch, WithReadings, felt
from contactfpga.robot.haptics.locate import Closing, Locator, Place, Reach, closed
from contactfpga.robot.haptics.solve import contacts
from contactfpga.robot.haptics.units import LoadCells, Unit
from contactfpga.robot.haptics.values import HapticsError
from contactfpga.robot.haptics.wrench import Bumper, Center, Cylinder, Motion, Noise, Plane, Wrench

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
