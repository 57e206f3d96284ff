"""The state of a link: its newest frame, and whether it still says what touches the link; and the errors of a body."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from contactfpga.errors import ContactFPGAError, NoData
from contactfpga.tracking.tracks import Tracks
from contactfpga.zones.zone import Zones


class BodyError(ContactFPGAError, ValueError):
    """A robot, link, joint or place that cannot be; the message names the value and the limit."""


class NoJoints(ContactFPGAError):
    """The joint angles at a frame's time are not known, so its contacts have no place in the base frame."""


class NoLinkData(NoData):
    """Links that were asked for contacts have no data: nobody knows whether something touches them."""

    def __init__(self, links: Mapping[str, LinkState]):
        listed = "; ".join(f"{name}: {state}" for name, state in links.items())
        super().__init__(
            f"no data of {listed}; ask for the links that have data: contacts(links=snapshot.answering)", None
        )
        self.links = dict(links)
        """Those without data."""


@dataclasses.dataclass(frozen=True)
class LinkState:
    """What is known about a link at one moment."""

    zones: Zones | None
    """Its newest frame; None unless it is ok or late, because older frames say nothing about the present."""
    age_s: float | None
    """How long ago, on the body's clock, its newest frame ever was scanned; None if none ever came."""
    status: str
    """``ok``; ``late``: the newest frame is older than ``late_s``; ``silent``: no frame for ``silent_s``, with the port
    open; ``lost``: no such port, or it is gone; ``mismatch``: a board of another Skin, name or version is
    there."""
    reason: str = ""
    """Why it is not ok."""
    frame_s: float | None = None
    """When the frame was scanned, on the body's clock."""
    tracks: Tracks | None = None
    """Its contacts over the frames that were taken, as :class:`~contactfpga.Tracker` follows them."""

    def __str__(self) -> str:
        age = "no frame yet" if self.age_s is None else f"{self.age_s:.3f} s old"
        return f"{self.status} ({age}{'; ' if self.reason else ''}{self.reason})"
