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
from contactfpga.skin import Skin, SkinError
from contactfpga.skin.sheet import Sheet
from contactfpga.wire.hello import Hello
from contactfpga.zones.batch import Batch
from contactfpga.zones.zone import Zone, Zones

__all__ = [
    "Batch",
    "Board",
    "BoardClosed",
    "BoardSilent",
    "ContactFPGAError",
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
    "VersionMismatch",
    "Zone",
    "Zones",
    "open",
    "read_zones",
]
