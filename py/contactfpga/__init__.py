"""Contact zones of a switch-matrix skin, from an FPGA to Python."""

from contactfpga.driver.board import Board
from contactfpga.driver.driver import open, read_zones
from contactfpga.driver.stats import Stats
from contactfpga.driver.subscription import Subscription
from contactfpga.errors import (
    BoardClosed,
    BoardSilent,
    ContactFPGAError,
    MissingExtra,
    MissingTool,
    OnlyNoise,
    PortLost,
    PortNotFound,
    ReadTimeout,
    ReplayEnded,
    SkinMismatch,
    VersionMismatch,
)
from contactfpga.shipped import examples
from contactfpga.skin import Skin, SkinError
from contactfpga.skin.sheet import Sheet
from contactfpga.tracking.tracker import Tracker
from contactfpga.tracking.tracks import Event, Track, Tracks
from contactfpga.wire.hello import Hello
from contactfpga.zones.batch import Batch
from contactfpga.zones.zone import Zone, Zones

# The one place of the version; the build reads it from here. Metadata of an installed package would be absent in a
# source tree that was never installed, and out of date in an editable install made before the last release.
__version__ = "0.2.0"

__all__ = [
    "Batch",
    "Board",
    "BoardClosed",
    "BoardSilent",
    "ContactFPGAError",
    "Event",
    "Hello",
    "MissingExtra",
    "MissingTool",
    "OnlyNoise",
    "PortLost",
    "PortNotFound",
    "ReadTimeout",
    "ReplayEnded",
    "Sheet",
    "Skin",
    "SkinError",
    "SkinMismatch",
    "Stats",
    "Subscription",
    "Track",
    "Tracker",
    "Tracks",
    "VersionMismatch",
    "Zone",
    "Zones",
    "__version__",
    "examples",
    "open",
    "read_zones",
]
