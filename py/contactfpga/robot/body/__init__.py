"""A robot with a sheet on each of several links: contacts in one frame, on one clock."""

from contactfpga.body.answer import BodyError, NoJoints, NoLinkData
from contactfpga.body.body import Body
from contactfpga.body.contact import Contact
from contactfpga.body.joints import JointHistory
from contactfpga.body.open_body import OpenBody
from contactfpga.body.queue import SnapshotQueue
from contactfpga.body.snapshot import Snapshot
from contactfpga.body.state import LinkState
from contactfpga.body.totals import BodyStats, SnapshotBatch

__all__ = [
    "Body",
    "BodyError",
    "BodyStats",
    "Contact",
    "JointHistory",
    "LinkState",
    "NoJoints",
    "NoLinkData",
    "OpenBody",
    "Snapshot",
    "SnapshotBatch",
    "SnapshotQueue",
]
