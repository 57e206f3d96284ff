"""How hard, where, and how sure: forces at the zones, from pressure units under the bumper.

SI units, in the link's frame. A wrench is what contacts exert on the link; normals point out of it; a push is 0 or above.
"""

from contactfpga.haptics.answer import HapticsError
from contactfpga.haptics.calibrate import Calibration, calibrate
from contactfpga.haptics.contact import Contact, Contacts, Touch
from contactfpga.haptics.drift import Drift, DriftWatch
from contactfpga.haptics.solve import contacts
from contactfpga.haptics.surface import Center, Cylinder, Plane
from contactfpga.haptics.units import LoadCells, Unit
from contactfpga.haptics.wrench import Bumper, Motion, Noise, Wrench

__all__ = [
    "Bumper",
    "Calibration",
    "Center",
    "Contact",
    "Contacts",
    "Cylinder",
    "Drift",
    "DriftWatch",
    "HapticsError",
    "LoadCells",
    "Motion",
    "Noise",
    "Plane",
    "Touch",
    "Unit",
    "Wrench",
    "calibrate",
    "contacts",
]
