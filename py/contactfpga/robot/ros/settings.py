"""Topics, names and rates of publishing."""

from __future__ import annotations

import dataclasses
import re

from contactfpga.inputs.values import is_finite, shown

MOST_HZ = 100_000.0


@dataclasses.dataclass(frozen=True)
class Topic:
    """A topic with its type."""

    name: str
    """Name below the namespace; absolute with a slash."""
    type: str
    depth: int
    latched: bool = False
    """Whether late subscribers get the last message."""

    def resolved(self, namespace: str) -> str:
        """Full name of the topic."""
        return self.name if self.name.startswith("/") else f"/{namespace.strip('/')}/{self.name}"


TOPICS = {
    topic.name: topic
    for topic in (
        Topic("skin", "contactfpga_msgs/Skin", 1, latched=True),
        Topic("zones", "contactfpga_msgs/Zones", 100),
        Topic("tracks", "contactfpga_msgs/Tracks", 100),
        Topic("contacts", "contactfpga_msgs/Contacts", 100),
        Topic("wrench", "geometry_msgs/WrenchStamped", 100),
        Topic("markers", "visualization_msgs/MarkerArray", 1),
        Topic("/tf_static", "tf2_msgs/TFMessage", 1, latched=True),
        Topic("/diagnostics", "diagnostic_msgs/DiagnosticArray", 10),
    )
}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Settings:
    """Settings of a feed. Raises ValueError for impossible values."""

    frame: str = ""
    """Name of the link's frame; "": the board's name, or ``skin`` if unnamed."""
    parent: str = ""
    """Frame in which the sheet's is published; "" for none."""
    place_m: tuple[float, ...] = (0.0, 0.0, 0.0)
    """Position of the sheet's frame in its parent."""
    turn_rad: tuple[float, ...] = (0.0, 0.0, 0.0)
    """Rotation of the sheet's frame about the fixed x, y and z axes in turn."""
    zones_hz: float = 1000.0
    """Largest rate of frames; a frame with another number of zones is always published."""
    markers_hz: float = 30.0
    diagnostics_hz: float = 1.0
    silence_s: float = 0.5
    """Time without a frame after which diagnostics report a silent board."""

    def __post_init__(self) -> None:
        for name in ("frame", "parent"):
            if not re.fullmatch(r"(?!/)[A-Za-z0-9_/~.-]*", text := getattr(self, name)):
                what = "a frame's name has letters, digits, and _ / ~ . -, and begins with no slash, which tf2 refuses"
                raise ValueError(f"{name} is {shown(text)}; {what}")
        for name in ("place_m", "turn_rad"):
            values = getattr(self, name)
            if len(values) != 3 or not all(is_finite(one) for one in values):
                raise ValueError(f"{name} is {shown(values)}; it must be three finite numbers")
        for name in ("zones_hz", "markers_hz", "diagnostics_hz"):
            rate = getattr(self, name)
            if not (is_finite(rate) and 0 < rate <= MOST_HZ):
                raise ValueError(f"{name} is {shown(rate)}; it must be above 0 and at most {MOST_HZ:g}")
        if not (is_finite(self.silence_s) and self.silence_s > 0):
            raise ValueError(f"silence_s is {shown(self.silence_s)}; it must be a positive number of seconds")
