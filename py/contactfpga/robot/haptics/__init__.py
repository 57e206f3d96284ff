"""How hard, where, and how sure: forces at the zones, from pressure units under the bumper.

SI units, in the link's frame. A wrench is what contacts exert on the link; normals point out of it; no push is
below 0.
"""

from contactfpga.haptics.alone import AloneWatch
from contactfpga.haptics.answer import HapticsError
from contactfpga.haptics.calibrate import Calibration, calibrate
from contactfpga.haptics.closings import ClosingWatch
from contactfpga.haptics.contact import Contact, Contacts, Touch
from contactfpga.haptics.drift import Drift, DriftWatch
from contactfpga.haptics.evidence import Closing
from contactfpga.haptics.live import WithReadings, felt
from contactfpga.haptics.locate import Locator, Place, closed
from contactfpga.haptics.reach import Reach
from contactfpga.haptics.solve import contacts
from contactfpga.haptics.surface import Center, Cylinder, Plane
from contactfpga.haptics.unit import Unit
from contactfpga.haptics.units import LoadCells
from contactfpga.haptics.wrench import Bumper, Motion, Noise, Wrench

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
