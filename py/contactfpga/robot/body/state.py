"""The state of a link, and a body's errors."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping

from contactfpga.errors import ContactFPGAError, NoData
from contactfpga.tracking.tracks import Tracks
from contactfpga.zones.zone import Zones


class BodyError(ContactFPGAError, ValueError):
    """An impossible robot, link, joint or place."""


class NoJoints(ContactFPGAError):
    """Unknown joint angles at a frame's time, so that its contacts have no place in the base frame."""


class NoLinkData(NoData):
    """Links whose contacts were requested have no data: touches are unknown."""

    def __init__(self, links: Mapping[str, LinkState]):
        listed = "; ".join(f"{name}: {state}" for name, state in links.items())
        super().__init__(
            f"no data of {listed}; ask for the links that have data: contacts(links=snapshot.answering)", None
        )
        self.links = dict(links)
        """The links without data."""


@dataclasses.dataclass(frozen=True)
class LinkState:
    """The knowledge of a link at one moment."""

    zones: Zones | None
    """The link's newest frame; None unless the link is ok or late."""
    age_s: float | None
    """Time since the link's newest frame ever was scanned; None without one."""
    status: str
    """``ok``; ``late``: the newest frame is older than ``late_s``; ``silent``: no frame for ``silent_s``, with the port
    open; ``lost``: no such port, or it is gone; ``mismatch``: a board of another Skin, name or version."""
    reason: str = ""
    """Reason why the link is not ok."""
    frame_s: float | None = None
    """Scan time of the frame, on the body's clock."""
    tracks: Tracks | None = None
    """Contacts over the frames read, as :class:`~contactfpga.Tracker` follows them."""

    def __str__(self) -> str:
        age = "no frame yet" if self.age_s is None else f"{self.age_s:.3f} s old"
        return f"{self.status} ({age}{'; ' if self.reason else ''}{self.reason})"
