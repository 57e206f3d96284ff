"""What a recording holds of a board, beyond what :mod:`contactfpga.robot.ros` has messages for: its bytes, and all that
it says between frames."""

from __future__ import annotations

from contactfpga.robot.ros.cdr import encode
from contactfpga.robot.ros.convert import header
from contactfpga.robot.ros.types import PACKAGE
from contactfpga.zones.units import UnitSamples

BYTES, FAULTS, UNITS = (f"{PACKAGE}/{name}" for name in ("Bytes", "Faults", "Units"))
ZONES, TRACKS, CONTACTS = (f"{PACKAGE}/{name}" for name in ("Zones", "Tracks", "Contacts"))
TRANSFORMS, MARKERS, WRENCH = "tf2_msgs/TFMessage", "visualization_msgs/MarkerArray", "geometry_msgs/WrenchStamped"


def of_bytes(data: bytes, time_ns: int, frame: str) -> bytes:
    """Bytes of which the last one came then."""
    return encode(BYTES, {"header": header(time_ns, frame), "data": data})


def of_faults(names: tuple[str, ...], time_ns: int, frame: str) -> bytes:
    """Faults by name."""
    return encode(FAULTS, {"header": header(time_ns, frame), "names": names})


def of_units(samples: UnitSamples, time_ns: int, frame: str) -> bytes:
    """A sweep of the pressure units."""
    values = {name: getattr(samples, name) for name in ("readings", "sigma", "saturated")}
    return encode(UNITS, {"header": header(time_ns, frame), "device_time_us": samples.time_us} | values)
