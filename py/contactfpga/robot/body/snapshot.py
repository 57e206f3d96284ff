"""All links of a body at one moment, and their contacts."""

from __future__ import annotations

import functools
from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING

import numpy as np

from contactfpga import notebook
from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.values import shown
from contactfpga.robot.body import contact
from contactfpga.robot.body.answer import BodyError, NoJoints, NoLinkData
from contactfpga.robot.body.contact import Contact
from contactfpga.robot.body.joints import Joints
from contactfpga.robot.body.kinematics import Kinematics
from contactfpga.robot.body.state import LinkState
from contactfpga.surfaces.shapes import Floats

if TYPE_CHECKING:
    from contactfpga.robot.body.body import Body

BASE, LINK = "base", "link"
LINK_PX = 200
Angles = Mapping[str, float] | ContactFPGAError
"""Joint angles, or why there are none."""


class Snapshot:
    """Every link's newest frame with its age, and the contacts on them."""

    def __init__(self, body: Body, host_time_s: float, links: Mapping[str, LinkState], joints: Joints | None = None):
        self.host_time_s = host_time_s
        """When it was taken, on the body's clock."""
        self._links = links
        self._body = body
        self._angles: dict[str, Angles] = {}
        self._beside: dict[str, Angles] = {}  # a standard deviation of the frame's time earlier or later
        if joints is not None:  # looked up now, as a history is short
            for name in self.answering:
                self._look_up(name, joints)

    @functools.cached_property
    def links(self) -> dict[str, LinkState]:
        """The state of each link, by its name."""
        return dict(self._links)

    def _look_up(self, name: str, joints: Joints) -> None:
        state = self.links[name]
        assert state.frame_s is not None
        assert state.zones is not None
        self._angles[name] = _angles(joints, state.frame_s)
        sigma_s = state.zones.host_sigma_s
        if sigma_s and not isinstance(self._angles[name], ContactFPGAError):
            before = _angles(joints, state.frame_s - sigma_s)
            found = _angles(joints, state.frame_s + sigma_s) if isinstance(before, ContactFPGAError) else before
            self._beside[name] = found

    @property
    def answering(self) -> tuple[str, ...]:
        """Links that are ok, so that it is known what touches them."""
        return tuple(name for name, state in self.links.items() if state.status == "ok")

    def contacts(self, frame: str = BASE, links: Collection[str] | None = None) -> list[Contact]:
        """The contacts on all links, or on these.

        Raises :class:`NoLinkData` if one of them is not ok, because no data is never no contact;
        ``links=snapshot.answering`` asks only the others. In the base frame it raises :class:`NoJoints` if the angles
        at a frame's time are not known.

        Args:
            frame: ``base``, or ``link`` for each in the frame of its own link.
        """
        if frame not in (BASE, LINK):
            raise BodyError(f"frame is {shown(frame)}; it must be 'base' or 'link'")
        asked = list(self.links) if links is None else list(links)
        for name in asked:
            if name not in self.links:
                raise BodyError(f"link {shown(name)} is not known; there are {', '.join(self.links)}")
        missing = {name: self.links[name] for name in asked if self.links[name].status != "ok"}
        if missing:
            raise NoLinkData(missing)
        found: list[Contact] = []
        for name in asked:
            known = self._angles.get(name)
            angles = None if isinstance(known, ContactFPGAError) else known
            mine = contact.on_link(self._body.links[name], self.links[name], angles)
            if frame == BASE and mine:
                mine = self._in_base(name, mine)
            found += mine
        return found

    def _in_base(self, name: str, contacts: list[Contact]) -> list[Contact]:
        frame, beside = self._body.links[name].frame, self._beside.get(name)
        pose = self._kinematics.pose(frame, self._angles_of(name))
        moved = [one.moved(pose, BASE) for one in contacts]
        if beside is None or not self._kinematics.needed(frame):
            return moved
        other = None if isinstance(beside, ContactFPGAError) else self._kinematics.pose(frame, beside)
        return [one.less_certain(other, pose) for one in moved]

    def jacobian(self, one: Contact) -> Floats:
        """(6, n): how the contact's point, as part of its link, moves with each of :attr:`joint_names`, in the base
        frame: three rows of its velocity, three of the link's angular velocity. Raises :class:`NoJoints`."""
        frame, angles = self._body.links[one.link].frame, self._angles_of(one.link)
        if one.point_m is None:
            raise BodyError(f"a contact on link {shown(one.link)} has no place, so nothing says how it moves")
        point = np.array(one.point_m)
        if one.frame != BASE:
            point = self._kinematics.pose(frame, angles).apply(point)
        return self._kinematics.jacobian(frame, point, angles)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """The columns of a Jacobian."""
        return self._kinematics.joint_names

    @property
    def _kinematics(self) -> Kinematics:
        if self._body.kinematics is None:
            raise BodyError("the base frame is not known; give robot.toml a urdf")
        return self._body.kinematics

    def _angles_of(self, name: str) -> Mapping[str, float]:
        found = self._angles.get(name)
        if found is None:
            raise NoJoints(f"link {shown(name)}: no joint angles are known; give them to Body.open(joints)")
        if isinstance(found, ContactFPGAError):
            raise NoJoints(f"link {shown(name)}: {found}") from found.__cause__
        return found

    def _repr_html_(self) -> str:
        """Every link's sheet in a notebook, with its state."""
        rows = [[name, str(state)] for name, state in self.links.items()]
        drawn = [(name, state.zones.svg(LINK_PX)) for name, state in self.links.items() if state.zones is not None]
        return notebook.table(["link", "state"], rows, f"At {self.host_time_s:.3f} s") + notebook.beside(drawn)

    def __repr__(self) -> str:
        states = ", ".join(f"{name} {state.status}" for name, state in self.links.items())
        return f"<Snapshot at {self.host_time_s:.3f} s: {states}>"


def _angles(joints: Joints, host_time_s: float) -> Angles:
    try:
        return joints(host_time_s)
    except ContactFPGAError as error:  # said to whoever asks for what needs them
        return error
    except Exception as error:  # of a program's own code: the threads that read the links go on
        failed = NoJoints(f"the joints given to the body failed: {error!r}")
        failed.__cause__ = error
        return failed
