"""All that is taken of contactfpga, in one place."""

from contactfpga.console.interrupt import guarded
from contactfpga.errors import ContactFPGAError
from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga_hdl.board.sizes import DEVICES, SEEDS, Device, Netlists, Registered, Size
from contactfpga_hdl.board.synthesis import FAMILIES, NO_COLLISIONS
from contactfpga_hdl.board.tools import BitstreamFailed
from contactfpga_sim.board import native
from contactfpga_sim.board.labeller import LabelBench
from contactfpga_sim.golden import all_departures
from contactfpga_sim.pages.writer import table_of, update
from contactfpga_sim.scenes import shapes
from contactfpga_sim.scenes.cells import to_words
from contactfpga_sim.studies import size
from contactfpga_sim.studies.size import DESIGNS, square

__all__ = [
    "DESIGNS",
    "DEVICES",
    "FAMILIES",
    "NO_COLLISIONS",
    "SEEDS",
    "BitstreamFailed",
    "ContactFPGAError",
    "Derived",
    "Device",
    "LabelBench",
    "Netlists",
    "Registered",
    "Size",
    "Skin",
    "all_departures",
    "guarded",
    "native",
    "shapes",
    "size",
    "square",
    "table_of",
    "to_words",
    "update",
]
