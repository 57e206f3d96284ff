"""All that is taken of contactfpga, in one place."""

from contactfpga.derived import Derived
from contactfpga.errors import ContactFPGAError
from contactfpga.interrupt import guarded
from contactfpga.skin import Skin
from contactfpga_hdl.build import BuildFailed as PlacementFailed
from contactfpga_hdl.sizes import DESIGNS, DEVICES, SEEDS, Device, Netlists, Registered, Size, square
from contactfpga_hdl.synthesis import FAMILIES, NO_COLLISIONS
from contactfpga_sim import native, shapes, size
from contactfpga_sim.cells import to_words
from contactfpga_sim.figures import update
from contactfpga_sim.golden import all_departures
from contactfpga_sim.label_bench import LabelBench

__all__ = [
    "DESIGNS",
    "DEVICES",
    "FAMILIES",
    "NO_COLLISIONS",
    "SEEDS",
    "ContactFPGAError",
    "Derived",
    "Device",
    "LabelBench",
    "Netlists",
    "PlacementFailed",
    "Registered",
    "Size",
    "Skin",
    "all_departures",
    "guarded",
    "native",
    "shapes",
    "size",
    "square",
    "to_words",
    "update",
]
