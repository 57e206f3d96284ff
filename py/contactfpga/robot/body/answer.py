"""What a body cannot be, and what it cannot answer."""

from __future__ import annotations

from collections.abc import Mapping

from contactfpga.errors import ContactFPGAError, NoData
from contactfpga.robot.body.state import LinkState


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
