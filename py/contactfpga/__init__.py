"""Contact zones of a switch-matrix skin, from an FPGA to Python."""

from contactfpga.driver.board import Board
from contactfpga.driver.driver import open, read_zones
from contactfpga.driver.silence import Silence
from contactfpga.driver.stats import Stats
from contactfpga.driver.subscription import Events, Subscription
from contactfpga.errors import (
    BoardClosed,
    BoardSilent,
    ContactFPGAError,
    MissingExtra,
    MissingTool,
    NoData,
    NoSuchCommand,
    OnlyNoise,
    PortBusy,
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
from contactfpga.wire.faults import Faults, SelfTestSlot
from contactfpga.wire.hello import Hello
from contactfpga.zones.batch import Batch
from contactfpga.zones.self_test import SelfTest
from contactfpga.zones.suspicion import Suspicion
from contactfpga.zones.units import UnitHistory, UnitSamples
from contactfpga.zones.watch import Watch
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
    "Events",
    "Faults",
    "Hello",
    "MissingExtra",
    "MissingTool",
    "NoData",
    "NoSuchCommand",
    "OnlyNoise",
    "PortBusy",
    "PortLost",
    "PortNotFound",
    "ReadTimeout",
    "ReplayEnded",
    "SelfTest",
    "SelfTestSlot",
    "Sheet",
    "Silence",
    "Skin",
    "SkinError",
    "SkinMismatch",
    "Stats",
    "Subscription",
    "Suspicion",
    "Track",
    "Tracker",
    "Tracks",
    "UnitHistory",
    "UnitSamples",
    "VersionMismatch",
    "Watch",
    "Zone",
    "Zones",
    "__version__",
    "examples",
    "open",
    "read_zones",
]
