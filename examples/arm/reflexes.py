"""Three reflexes for one joint at 1 kHz: stop, back off, follow. Each takes a snapshot and says how fast to turn.

The snapshot is of :class:`contactfpga.mujoco.Sheets`, or of an open :class:`contactfpga.body.Body` on a real robot. "No
data" is never "no contact": where the newest frame is older than SILENCE_S, or tells of a fault, each of them stops.
"""

import numpy as np

import contactfpga
from contactfpga.body import NoLinkData

SILENCE_S = 0.005
LINK = "arm"
AXIS = np.array([0.0, 0.0, 1.0])


def felt(snapshot):
    """Return the contacts on the link, in its frame. Raise NoLinkData where the newest frame is old or may be wrong."""
    state = snapshot.links[LINK]
    if state.status != "ok" or state.age_s > SILENCE_S or {"fault", "mismatch"} & state.zones.flags:
        raise NoLinkData({LINK: state})
    return [one for one in snapshot.contacts("link", [LINK]) if one.point_m is not None]


def away(contact):
    """+1 or -1: the direction of turning that leads away from what touches there, along the normal."""
    return -float(np.sign(np.cross(AXIS, contact.point_m) @ contact.normal))


class Stop:
    """Turns until something touches; then it stays."""

    def __init__(self, speed):
        self.speed = speed

    def __call__(self, snapshot, angle):
        try:
            if felt(snapshot):
                self.speed = 0.0
        except contactfpga.NoData:
            self.speed = 0.0
        return self.speed


class BackOff(Stop):
    """Turns until something touches; then it goes back by an angle, along the contact's normal, and stays."""

    def __init__(self, speed, back=0.05):
        super().__init__(speed)
        self.back, self.goal = back, None

    def __call__(self, snapshot, angle):
        try:
            contacts = felt(snapshot)
            if contacts and self.goal is None:
                turn = away(contacts[0])
                self.goal, self.speed = angle + turn * self.back, turn * abs(self.speed)
        except contactfpga.NoData:
            self.goal, self.speed = angle, 0.0
        if self.goal is not None and (self.goal - angle) * self.speed <= 0:
            self.speed = 0.0
        return self.speed


class Follow:
    """Rests, and gives way to a hand for as long as it pushes."""

    def __init__(self, speed):
        self.speed = speed

    def __call__(self, snapshot, angle):
        try:
            return self.speed * float(np.sign(sum(away(one) for one in felt(snapshot))))
        except contactfpga.NoData:
            self.speed = 0.0  # for good: whoever mends the sheet starts it again
            return 0.0
