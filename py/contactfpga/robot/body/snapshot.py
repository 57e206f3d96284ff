"""All links of a body at one moment, and their contacts."""

from __future__ import annotations

import dataclasses
import functools
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Protocol, overload

import numpy as np

from contactfpga import notebook
from contactfpga.driver.stats import Stats, total
from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.values import shown
from contactfpga.robot import haptics
from contactfpga.robot.body.joints import Joints
from contactfpga.robot.body.kinematics import Kinematics, Pose
from contactfpga.robot.body.plan import Plan
from contactfpga.robot.body.state import BodyError, LinkState, NoJoints, NoLinkData
from contactfpga.robot.body.support import Support
from contactfpga.robot.haptics.cover_bias import CoverBias
from contactfpga.surfaces.shapes import Floats, Vector, vector
from contactfpga.tracking.tracks import Tracks
from contactfpga.zones.batch import Batch
from contactfpga.zones.zone import Zone, Zones


@dataclasses.dataclass(frozen=True, eq=False)
class LinkContact:
    """A zone of a link, in a frame of the robot."""

    link: str
    """Name of the link in `robot.toml`."""
    frame: str
    """Frame of point, normal and force: ``base``, or the link's."""
    time_us: int
    """Device time of the frame."""
    host_time_s: float
    """Time of the frame on the body's clock."""
    time_sigma_s: float | None
    """Standard deviation of ``host_time_s``; None if unknown."""
    point_m: Vector | None
    """Place of the contact; None for a zone all the way round a closed sheet, or in a frame flagged ``mismatch``."""
    normal: Vector | None
    """Outward unit normal; None as ``point_m``."""
    covariance_m2: Floats | None
    """(3, 3) covariance of the point, from the size of a cell and in the base frame also from the joints' motion within
    ``time_sigma_s``. None as ``point_m``, and for unknown angles around the frame's time."""
    zone: Zone
    flags: frozenset[str]
    """Flags of the frame."""
    force_n: Vector | None = None
    """Force on the link; None without units, or before their readings arrive."""
    normal_n: float | None = None
    """Push, 0 or above; None as ``force_n``."""
    track: int | None = None
    """Id that stays with the contact, unique on this link; None without a place or tracking."""
    fold: float | None = None
    """Share of the zone's cells, 0 to 1, that the folding cover presses at the joint's angle as hard as they are
    pressed; at 1 the fold alone may explain the zone. None if unknown."""

    _felt: haptics.Contact | None = dataclasses.field(default=None, repr=False)

    @property
    def interval_n(self) -> tuple[float, float | None] | None:
        """Least and largest push, which contain the push in at least 95 of 100 cases; the second is None if unbounded.
        None as ``force_n``. Raises :class:`~contactfpga.MissingExtra` if three contacts or more need ``haptics``."""
        return None if self._felt is None else self._felt.interval_n

    def moved(self, pose: Pose, frame: str) -> LinkContact:
        """The contact in an outer frame in which its own has this ``pose``."""
        return dataclasses.replace(
            self,
            frame=frame,
            point_m=None if self.point_m is None else vector(pose.apply(np.array(self.point_m))),
            normal=None if self.normal is None else vector(pose.turn(np.array(self.normal))),
            covariance_m2=None if self.covariance_m2 is None else pose.rotation @ self.covariance_m2 @ pose.rotation.T,
            force_n=None if self.force_n is None else vector(pose.turn(np.array(self.force_n))),
        )

    def less_certain(self, other: Pose | None, pose: Pose) -> LinkContact:
        """The contact with the uncertainty of a point between ``pose`` and ``other``; None: unknown."""
        if other is None or self.point_m is None or self.covariance_m2 is None:
            return dataclasses.replace(self, covariance_m2=None)
        own = (np.array(self.point_m) - pose.point_m) @ pose.rotation
        way = other.apply(own) - np.array(self.point_m)
        return dataclasses.replace(self, covariance_m2=self.covariance_m2 + np.outer(way, way))

    def to_dict(self) -> dict[str, object]:
        """All fields as plain Python values, ready for JSON."""
        names = [field.name for field in dataclasses.fields(self) if field.name != "_felt"]
        values = {name: getattr(self, name) for name in (*names, "interval_n")}
        spread = None if self.covariance_m2 is None else self.covariance_m2.tolist()
        values |= {"covariance_m2": spread, "flags": sorted(self.flags)}
        return values | {"zone": dataclasses.asdict(self.zone)}


def on_link(plan: Plan, state: LinkState, angles: Mapping[str, float] | None = None) -> list[LinkContact]:
    """The contacts in the link's frame, one per zone; with joint angles, also their fold shares."""
    zones = state.zones
    assert zones is not None
    assert state.frame_s is not None
    sigma_m = 1e-3 * plan.sigma_mm
    tracks = () if state.tracks is None else state.tracks.active
    ids = {id(track.zone): track.id for track in tracks if not track.held}
    found = []
    for zone in zones:
        point = normal = spread = None
        if zone.x_mm is not None and zone.y_mm is not None:
            point, normal = plan.place(zone.x_mm, zone.y_mm)
            spread = sigma_m**2 * (np.eye(3) - np.outer(normal, normal))
        when = zones.time_us, state.frame_s, zones.host_sigma_s
        fold = _fold(plan, zones, zone, angles)
        made = LinkContact(plan.name, plan.frame, *when, point, normal, spread, zone, zones.flags)
        found.append(dataclasses.replace(made, track=ids.get(id(zone)), fold=fold))
    return _felt(plan, zones, found)


def _felt(plan: Plan, zones: Zones, found: list[LinkContact]) -> list[LinkContact]:
    forces = forces_of(plan, zones) if found else None
    if forces is None:
        return found
    return [
        dataclasses.replace(one, force_n=force.force_n, normal_n=force.normal_n, _felt=force)
        for one, force in zip(found, forces)
    ]


def forces_of(plan: Plan, zones: Zones, tracks: Tracks | None = None) -> haptics.Contacts | None:
    """Forces at the zones of a frame; None without readings, or if a zone has no place."""
    if plan.units is None or zones.units is None:
        return None
    touches = []
    for zone in zones:
        if zone.x_mm is None or zone.y_mm is None:
            return None
        touches.append(haptics.Touch(*plan.place(zone.x_mm, zone.y_mm), plan.friction, 1e-3 * plan.sigma_mm))
    wrench = plan.units.wrench(zones.units.readings)
    found = haptics.contacts(wrench, touches)
    if plan.bias is not None:
        found = haptics.contacts(wrench, [_sharper(plan.bias, *one) for one in zip(zones, found)])
    ids = {} if tracks is None else {id(track.zone): track.id for track in tracks.active}
    for one, zone in zip(found, zones):
        one.track = ids.get(id(zone))
    return found


def _sharper(bias: CoverBias, zone: Zone, found: haptics.Contact) -> haptics.Touch:
    sigma_m = bias.sigma_m(zone.area_cells, found.normal_n or 0.0)
    return found.touch if sigma_m is None else dataclasses.replace(found.touch, point_sigma_m=sigma_m)


def _fold(plan: Plan, zones: Zones, zone: Zone, angles: Mapping[str, float] | None) -> float | None:
    if plan.folds is None or angles is None or plan.folds.joint not in angles:
        return None
    cells = zones.cells_of(zone)
    if cells is None:
        return None
    return plan.folds.share(angles[plan.folds.joint], cells if zones.levels is None else cells * zones.levels)


BASE, LINK = "base", "link"
LINK_PX = 200
Angles = Mapping[str, float] | ContactFPGAError
"""Joint angles, or the reason for their absence."""


class Structure(Protocol):
    """The part of a :class:`~contactfpga.robot.body.Body` that a snapshot needs."""

    @property
    def links(self) -> Mapping[str, Plan]:
        """The links with a sheet."""

    @property
    def kinematics(self) -> Kinematics | None:
        """Kinematics of the links; None without a URDF."""


class Snapshot:
    """Every link's newest frame with its age, and the contacts."""

    def __init__(
        self, body: Structure, host_time_s: float, links: Mapping[str, LinkState], joints: Joints | None = None
    ):
        self.host_time_s = host_time_s
        """Time of the snapshot, on the body's clock."""
        self._links = links
        self._body = body
        self._angles: dict[str, Angles] = {}
        self._beside: dict[str, Angles] = {}  # a standard deviation of the frame's time earlier or later
        if joints is not None:  # looked up now, as a history is short
            for name in self.answering:
                self._look_up(name, joints)

    @functools.cached_property
    def links(self) -> dict[str, LinkState]:
        """State of each link by name."""
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
        """Links that are ok, whose contacts are known."""
        return tuple(name for name, state in self.links.items() if state.status == "ok")

    def contacts(self, frame: str = BASE, links: Collection[str] | None = None) -> list[LinkContact]:
        """The contacts on all links, or on these.

        Raises :class:`NoLinkData` if one of them is not ok, because no data is never no contact;
        ``links=snapshot.answering`` takes only the others. In the base frame it raises :class:`NoJoints` for unknown
        angles.

        Args:
            frame: ``base``, or ``link`` for each in the frame of its own link.
        """
        found: list[LinkContact] = []
        for name in self._asked(frame, links):
            known = self._angles.get(name)
            angles = None if isinstance(known, ContactFPGAError) else known
            mine = on_link(self._body.links[name], self.links[name], angles)
            if frame == BASE and mine:
                mine = self._in_base(name, mine)
            found += mine
        return found

    def supports(self, frame: str = BASE, links: Collection[str] | None = None) -> list[Support]:
        """The contact surface of each zone, with what presses there; arguments and errors as of :meth:`contacts`. Also
        raises :class:`BodyError` for a board that sends neither cells nor extents."""
        found: list[Support] = []
        for name in self._asked(frame, links):
            plan, zones = self._body.links[name], self.links[name].zones
            assert zones is not None
            outside = None if plan.units is None else plan.units.surface
            mine = plan.contact_surfaces.supports(zones, forces_of(plan, zones) if len(zones) else None, outside)
            if frame == BASE and mine:
                pose = self._kinematics.pose(plan.frame, self._angles_of(name))
                mine = [one.moved(pose, BASE) for one in mine]
            found += mine
        return found

    def _asked(self, frame: str, links: Collection[str] | None) -> list[str]:
        if frame not in (BASE, LINK):
            raise BodyError(f"frame is {shown(frame)}; it must be 'base' or 'link'")
        asked = list(self.links) if links is None else list(links)
        for name in asked:
            if name not in self.links:
                raise BodyError(f"link {shown(name)} is not known; there are {', '.join(self.links)}")
        missing = {name: self.links[name] for name in asked if self.links[name].status != "ok"}
        if missing:
            raise NoLinkData(missing)
        return asked

    def _in_base(self, name: str, contacts: list[LinkContact]) -> list[LinkContact]:
        frame, beside = self._body.links[name].frame, self._beside.get(name)
        pose = self._kinematics.pose(frame, self._angles_of(name))
        moved = [one.moved(pose, BASE) for one in contacts]
        if beside is None or not self._kinematics.needed(frame):
            return moved
        other = None if isinstance(beside, ContactFPGAError) else self._kinematics.pose(frame, beside)
        return [one.less_certain(other, pose) for one in moved]

    def jacobian(self, one: LinkContact) -> Floats:
        """(6, n): velocity, then angular velocity, of the contact's point with each of :attr:`joint_names`, in the base
        frame. Raises :class:`NoJoints`."""
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


@dataclasses.dataclass
class BodyStats(Stats):
    """Counters of all links together since opening; they continue over a board's return."""

    links: dict[str, Stats] = dataclasses.field(default_factory=dict)
    """Counters of each link."""

    @classmethod
    def of(cls, links: Mapping[str, Stats]) -> BodyStats:
        """The sum of these counters."""
        return cls(**vars(total(links.values())), links=dict(links))

    def to_dict(self) -> dict[str, object]:
        return super().to_dict() | {"links": {name: one.to_dict() for name, one in self.links.items()}}


class SnapshotBatch(Sequence["Snapshot"]):
    """Consecutive snapshots, and the frames in them as arrays."""

    def __init__(self, snapshots: Iterable[Snapshot]):
        self._snapshots = tuple(snapshots)
        self.links: dict[str, Batch] = {}
        """Every frame of each link once, in order, as :class:`~contactfpga.Batch`; links without frames are absent."""
        for name in self._snapshots[0].links:
            frames = _frames(name, self._snapshots)
            if frames:
                self.links[name] = Batch.of(frames)

    def continue_from(self, before: Counter[str]) -> None:
        """Number each link's frames on from those of earlier batches, and count these."""
        for name, batch in self.links.items():
            self.links[name] = dataclasses.replace(batch, first=before[name])
            before[name] += len(batch)

    @overload
    def __getitem__(self, index: int) -> Snapshot: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Snapshot]: ...
    def __getitem__(self, index: int | slice) -> Snapshot | Sequence[Snapshot]:
        return self._snapshots[index]

    def __len__(self) -> int:
        return len(self._snapshots)


def _frames(link: str, snapshots: Iterable[Snapshot]) -> list[Zones]:
    found: list[Zones] = []
    for snapshot in snapshots:
        zones = snapshot.links[link].zones
        if zones is not None and (not found or zones is not found[-1]):
            found.append(zones)
    return found
