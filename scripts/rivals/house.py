"""All that is taken of contactfpga, in one place."""

from contactfpga.errors import ContactFPGAError
from contactfpga.skin import Skin
from contactfpga.skin.derived import Derived
from contactfpga.tools.console.interrupt import guarded
from contactfpga_hdl.board.sizes import DEVICES, SEEDS, Device, Netlists, Registered, Size
from contactfpga_hdl.board.synthesis import FAMILIES, NO_COLLISIONS
from contactfpga_hdl.board.tools import BitstreamFailed
from contactfpga_sim.lab import size
from contactfpga_sim.lab.size import DESIGNS, square
from contactfpga_sim.lab.writer import table_of
from contactfpga_sim.model.board import native
from contactfpga_sim.model.golden import all_departures
from contactfpga_sim.model.scenes import shapes
from contactfpga_sim.model.scenes.cells import to_words
from contactfpga_sim.verify.cosim.bench_labeller import LabelBench

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
]
