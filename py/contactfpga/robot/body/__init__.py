"""A robot with a sheet on each of several links: contacts in one frame, on one clock."""

from contactfpga.robot.body.answer import BodyError, NoJoints, NoLinkData
from contactfpga.robot.body.body import Body
from contactfpga.robot.body.contact import Contact
from contactfpga.robot.body.joints import JointHistory
from contactfpga.robot.body.open_body import OpenBody
from contactfpga.robot.body.queue import SnapshotQueue
from contactfpga.robot.body.snapshot import Snapshot
from contactfpga.robot.body.state import LinkState
from contactfpga.robot.body.totals import BodyStats, SnapshotBatch

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
