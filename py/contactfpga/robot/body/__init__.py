"""A robot with a sheet on each of several links: contacts in one frame, on one clock."""

from contactfpga.robot.body.body import Body, OpenBody, SnapshotQueue
from contactfpga.robot.body.joints import JointHistory
from contactfpga.robot.body.snapshot import BodyStats, LinkContact, Snapshot, SnapshotBatch
from contactfpga.robot.body.state import BodyError, LinkState, NoJoints, NoLinkData
from contactfpga.robot.body.support import ContactSurfaces, Support, margin_m

__all__ = [
    "Body",
    "BodyError",
    "BodyStats",
    "ContactSurfaces",
    "JointHistory",
    "LinkContact",
    "LinkState",
    "NoJoints",
    "NoLinkData",
    "OpenBody",
    "Snapshot",
    "SnapshotBatch",
    "SnapshotQueue",
    "Support",
    "margin_m",
]
