"""Contact zones of a switch-matrix skin, from an FPGA to Python.

>>> import contactfpga
>>> zones = contactfpga.read_zones("sim://?scene=two_fingers")
>>> for zone in zones:
...     print(zone.area_mm2, zone.x_mm, zone.y_mm)
400.0 55.0 75.0
400.0 95.0 75.0

``read_zones()`` reads the board that is plugged in; ``open()`` gives its frames. ``help(contactfpga.Zone)`` lists a
zone's fields.
"""

# What it offers is imported when it is used first: so the command `contactfpga` takes Ctrl-C before numpy is loaded.

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from contactfpga.driver.board import AsyncBoard, Board
    from contactfpga.driver.driver import open, read_zones
    from contactfpga.driver.events import Silence
    from contactfpga.driver.stats import Stats
    from contactfpga.driver.subscription import Events, Subscription
    from contactfpga.errors import (
        AddressError,
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
    from contactfpga.instruments.self_test import SelfTest
    from contactfpga.instruments.watch import Suspicion, Watch
    from contactfpga.shipped import examples
    from contactfpga.skin import Skin, SkinError
    from contactfpga.skin.sheet import Sheet
    from contactfpga.tracking.places import Places
    from contactfpga.tracking.tracker import Tracker
    from contactfpga.tracking.tracks import Event, Track, Tracks
    from contactfpga.wire.faults import Faults, SelfTestSlot
    from contactfpga.wire.hello import Hello
    from contactfpga.zones.batch import Batch
    from contactfpga.zones.box import Box, BoxMm
    from contactfpga.zones.units import UnitHistory, UnitSamples
    from contactfpga.zones.zone import Zone, Zones

# The one place of the version; the build reads it from here. Metadata of an installed package would be absent in a
# source tree that was never installed, and out of date in an editable install made before the last release.
__version__ = "0.3.0"

__all__ = [
    "AddressError",
    "AsyncBoard",
    "Batch",
    "Board",
    "BoardClosed",
    "BoardSilent",
    "Box",
    "BoxMm",
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
    "Places",
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

_NAMES = {
    "driver.board": "AsyncBoard Board",
    "driver.driver": "open read_zones",
    "driver.events": "Silence",
    "driver.stats": "Stats",
    "driver.subscription": "Events Subscription",
    "errors": (
        "AddressError BoardClosed BoardSilent ContactFPGAError MissingExtra MissingTool NoData NoSuchCommand OnlyNoise "
        "PortBusy PortLost PortNotFound ReadTimeout ReplayEnded SkinMismatch VersionMismatch"
    ),
    "instruments.self_test": "SelfTest",
    "instruments.watch": "Suspicion Watch",
    "shipped": "examples",
    "skin": "Skin SkinError",
    "skin.sheet": "Sheet",
    "tracking.places": "Places",
    "tracking.tracker": "Tracker",
    "tracking.tracks": "Event Track Tracks",
    "wire.faults": "Faults SelfTestSlot",
    "wire.hello": "Hello",
    "zones.batch": "Batch",
    "zones.box": "Box BoxMm",
    "zones.units": "UnitHistory UnitSamples",
    "zones.zone": "Zone Zones",
}
_PLACES = {name: module for module, names in _NAMES.items() for name in names.split()}


def __getattr__(name: str) -> Any:
    if name in _PLACES:
        found = getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)
        if isinstance(found, type):
            import_module(f"{__name__}.helptext").complete(found)
    elif not name.startswith("_") and find_spec(f"{__name__}.{name}") is not None:
        found = import_module(f"{__name__}.{name}")
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__} - {"TYPE_CHECKING", "Any", "find_spec", "import_module"})
