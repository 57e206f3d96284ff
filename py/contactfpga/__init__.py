"""Contact zones of a switch-matrix skin, from an FPGA to Python."""

from contactfpga.driver import Board, open, read_zones
from contactfpga.errors import (
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
from contactfpga.receiver import Stats
from contactfpga.skin import Skin, SkinError
from contactfpga.zone import Zone, Zones

__all__ = [
    "Board",
    "BoardSilent",
    "ContactFPGAError",
    "MissingExtra",
    "MissingTool",
    "OnlyNoise",
    "PortLost",
    "PortNotFound",
    "ReadTimeout",
    "ReplayEnded",
    "Skin",
    "SkinError",
    "SkinMismatch",
    "Stats",
    "VersionMismatch",
    "Zone",
    "Zones",
    "open",
    "read_zones",
]
