"""Contacts: touched places, and the forces there."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections import deque
from collections.abc import Callable, Sequence
from typing import overload

import numpy as np

from contactfpga import notebook
from contactfpga.inputs.values import shown
from contactfpga.robot.haptics.units import LoadCells
from contactfpga.robot.haptics.values import HapticsError, within
from contactfpga.robot.haptics.wrench import ALARM, Center, Motion, Wrench
from contactfpga.surfaces.shapes import Floats, Vector
from contactfpga.zones.zone import Zone, Zones

FULL_WRENCH = "FULL_WRENCH"
"""Force at an unknown place: the center of pressure."""
PURE_FORCE = "PURE_FORCE"
"""At each contact a force of any direction within friction's cone."""
PURE_FORCE_WITH_KNOWN_DIRECTION = "PURE_FORCE_WITH_KNOWN_DIRECTION"
"""At each contact a push along the normal."""

Interval = tuple[float, float | None]

LEAST_FRICTION = 1e-6
"""Least friction whose inverse is finite."""


@dataclasses.dataclass(frozen=True, slots=True)
class Touch:
    """A touched place from the sheet, whose force is to be found."""

    point_m: Vector
    normal: Vector
    """Outward unit normal."""
    friction: float = 0.5
    """Largest force along the surface over the push."""
    point_sigma_m: float = 0.0
    """Standard deviation of each coordinate of the point."""

    def __post_init__(self) -> None:
        length = math.hypot(*self.normal)
        if not abs(length - 1) < 1e-6:
            raise HapticsError(f"normal is {shown(self.normal)}; its length must be 1, and is {length:g}")
        within("point_m", self.point_m, "m")
        if not (0 <= self.friction < 1e3 and 0 <= self.point_sigma_m < 1e3):
            name = "point_sigma_m" if 0 <= self.friction < 1e3 else "friction"
            raise HapticsError(f"{name} is {shown(getattr(self, name))}; it must be a number from 0 to 1000")
        if 0 < self.friction < LEAST_FRICTION:
            raise HapticsError(f"friction is {self.friction:g}; it must be 0, or at least {LEAST_FRICTION:g}")


@dataclasses.dataclass(frozen=True, slots=True)
class Context:
    """Knowledge of a frame's contacts besides forces."""

    link: str = ""
    time_us: int | None = None
    tracks: Sequence[int | None] = ()
    """Track of each contact; shorter if the rest is not followed."""


NO_CONTEXT = Context()


class Contact:
    """A touch with its force."""

    __slots__ = ("_intervals", "_number", "force_n", "frame", "link", "normal_n", "time_us", "touch", "track")

    def __init__(
        self,
        touch: Touch,
        force_n: Vector | None,
        normal_n: float | None,
        frame: str,
        intervals: Callable[[], list[Interval]] | None = None,
        number: int = 0,
        context: Context = NO_CONTEXT,
    ):
        self.touch = touch
        self.force_n = force_n
        """Force on the link; None if no unit measures it."""
        self.normal_n = normal_n
        """Push, at least 0; None as ``force_n``."""
        self.frame = frame
        """Name of the frame of point, normal and force."""
        self.link = context.link
        """Name of the touched link."""
        self.time_us = context.time_us
        """Device time of the frame since power-up; None without a frame."""
        self.track = context.tracks[number] if number < len(context.tracks) else None
        """Id that stays from frame to frame (:class:`~contactfpga.tracking.tracker.Tracker`); None: not tracked."""
        self._intervals = intervals
        self._number = number

    @property
    def point_m(self) -> Vector:
        """Point in the link's frame."""
        return self.touch.point_m

    @property
    def normal(self) -> Vector:
        """Outward unit normal."""
        return self.touch.normal

    @property
    def covariance_m2(self) -> Floats:
        """(3, 3) covariance of the point, along the surface only."""
        normal = np.array(self.touch.normal)
        return np.asarray(self.touch.point_sigma_m**2 * (np.eye(3) - np.outer(normal, normal)))

    @property
    def interval_n(self) -> Interval | None:
        """Least and largest push; the second is None if unbounded. None as ``force_n``.

        With the units' noise it contains the push in at least 95 of 100 cases
        (:mod:`contactfpga.robot.haptics.cones`); without (:attr:`Wrench.noise` None) it is the range of all forces
        that friction allows and that exert exactly this wrench.
        """
        return None if self._intervals is None else self._intervals()[self._number]

    def to_dict(self) -> dict[str, object]:
        """All fields as plain Python values, ready for JSON."""
        interval, force = self.interval_n, self.force_n
        return {
            "link": self.link,
            "frame": self.frame,
            "time_us": self.time_us,
            "track": self.track,
            "point_m": list(self.point_m),
            "covariance_m2": self.covariance_m2.tolist(),
            "normal": list(self.normal),
            "force_n": None if force is None else list(force),
            "normal_n": self.normal_n,
            "interval_n": None if interval is None else list(interval),
        }

    def __repr__(self) -> str:
        x, y, z = (1e3 * one for one in self.point_m)
        push = "" if self.normal_n is None else f"{self.normal_n:.3f} N "
        return f"<Contact: {push}at ({x:.2f}, {y:.2f}, {z:.2f}) mm>"


@dataclasses.dataclass(slots=True)
class Solution:
    """Forces at all contacts of one frame, and their uncertainty."""

    model: str
    forces_n: list[Vector]
    intervals: Callable[[], list[Interval]]
    rank: int
    null_space: list[list[float]]
    """Changes of the forces that leave the wrench unchanged: x, y and z of each contact, or one push each with known
    directions."""
    chi2: float | None
    freedom: int
    """Degrees of freedom of ``chi2``: components of the wrench not used up by the forces."""
    touches: Sequence[Touch]
    wrench: Wrench
    covariance: Callable[[], Floats | None]
    """(3k, 3k) covariance of the forces without the null space."""
    beyond_friction: bool = False

    @property
    def residual(self) -> tuple[float, float, float, float, float, float]:
        """The wrench minus that of the forces."""
        (fx, fy, fz), (mx, my, mz) = self.wrench.force_n, self.wrench.moment_nm
        for touch, (px, py, pz) in zip(self.touches, self.forces_n):
            x, y, z = touch.point_m
            fx, fy, fz = fx - px, fy - py, fz - pz
            mx, my, mz = mx - (y * pz - z * py), my - (z * px - x * pz), mz - (x * py - y * px)
        return fx, fy, fz, mx, my, mz


class Contacts(Sequence[Contact]):
    """The contacts of one frame, in the given order."""

    def __init__(
        self,
        wrench: Wrench,
        touches: Sequence[Touch],
        solution: Solution,
        center: Center | None = None,
        context: Context = NO_CONTEXT,
    ):
        self.wrench = wrench
        self.center = center
        """Without a zone, the contact that the wrench alone shows, or None."""
        self._solution = solution
        self.model = solution.model
        """The chosen contact model: :data:`PURE_FORCE`, :data:`PURE_FORCE_WITH_KNOWN_DIRECTION` or
        :data:`FULL_WRENCH`."""
        self.rank = solution.rank
        """Rank of the matrix from forces to wrench."""
        self.null_space = solution.null_space
        self.chi2 = solution.chi2
        """Distance of the wrench from those that these contacts can exert, in squares of its noise; None without
        noise."""
        self.freedom = solution.freedom
        self.beyond_friction = solution.beyond_friction
        """Whether no forces within friction's limits exert this wrench: a contact drags at the limit, friction is
        larger than given, or a contact is unseen. Intervals then hold for any friction."""
        if wrench.frame and not context.link:
            context = Context(wrench.frame, context.time_us, context.tracks)
        made = []
        for number, (touch, force) in enumerate(zip(touches, solution.forces_n)):
            nx, ny, nz = touch.normal
            push = -(nx * force[0] + ny * force[1] + nz * force[2])
            push = push if push > 0 else 0.0
            made.append(Contact(touch, force, push, wrench.frame, self._intervals, number, context))
        self._contacts = tuple(made)

    def _intervals(self) -> list[Interval]:
        return self._kept_intervals

    @functools.cached_property
    def _kept_intervals(self) -> list[Interval]:
        return self._solution.intervals()

    @functools.cached_property
    def covariance_n2(self) -> Floats | None:
        """(3k, 3k) covariance of all forces without the :attr:`null_space`; None without noise."""
        return self._solution.covariance()

    @property
    def alarm(self) -> bool:
        """Whether these contacts would exert the wrench by chance only once in a thousand times."""
        return self.chi2 is not None and self.freedom > 0 and self.chi2 > ALARM[self.freedom - 1]

    @property
    def unexplained(self) -> Wrench | None:
        """The residual wrench, which only the units see; None unless :attr:`alarm` is set."""
        if not self.alarm:
            return None
        rest = self._solution.residual
        return dataclasses.replace(self.wrench, force_n=rest[:3], moment_nm=rest[3:])

    @property
    def unfelt(self) -> list[Contact]:
        """Contacts that may push without force (:attr:`Contact.interval_n`), as two fingers that squeeze the link
        do."""
        return [one for one, (least, _) in zip(self._contacts, self._kept_intervals) if least <= 1e-9]

    @overload
    def __getitem__(self, index: int) -> Contact: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Contact, ...]: ...

    def __getitem__(self, index: int | slice) -> Contact | tuple[Contact, ...]:
        return self._contacts[index]

    def __len__(self) -> int:
        return len(self._contacts)

    def _repr_html_(self) -> str:
        head = ["contact", "x, mm", "y, mm", "z, mm", "push, N", "between, N"]
        rows = [
            [_name(number, one), *(f"{1e3 * each:.2f}" for each in one.point_m), *_push(one)]
            for number, one in enumerate(self)
        ]
        return notebook.table(head, rows, f"{self.model}: {len(self)} contact{'' if len(self) == 1 else 's'}")

    def __repr__(self) -> str:
        chi2 = "" if self.chi2 is None else f", chi2 {self.chi2:.2f}"
        return "\n".join([f"<Contacts: {len(self)}, {self.model}, rank {self.rank}{chi2}", *map(str, self)]) + ">"


def _name(number: int, contact: Contact) -> str:
    return f"{number}" if contact.track is None else f"#{contact.track}"


def _push(contact: Contact) -> list[str]:
    if contact.normal_n is None:
        return ["not measured", ""]
    interval = contact.interval_n
    if interval is None:
        return [f"{contact.normal_n:.3f}", ""]
    least, most = interval
    return [f"{contact.normal_n:.3f}", f"{least:.3f} and {'any' if most is None else f'{most:.3f}'}"]


EARLIER_US = 20_000
"""Device time by which a place must precede the next contact's zone, which presses the units before it closes a
switch."""

Key = tuple[int, tuple[float, float, float] | None]


@dataclasses.dataclass(frozen=True, slots=True)
class _Alone:
    time_us: int
    center_m: tuple[float, float, float]
    sigma_m: float


class AloneWatch:
    """Reads every frame with its readings, and remembers the place of a contact that was alone, for
    :func:`~contactfpga.robot.haptics.felt`.

    With two contacts the units do not show where each is along the line through both, and a barycenter of one to three
    cells is off by a quarter of the pitch. A single contact's center of pressure is known to less than a millimeter; it
    remains its place while its zone keeps its cells.
    """

    def __init__(self, cells: LoadCells):
        """Raises :class:`HapticsError` if the cells have no surface."""
        if cells.surface is None:
            raise HapticsError("surface is missing; give units.toml a table [surface] with the bumper's outside")
        self._cells, self._surface = cells, cells.surface
        self._key: Key | None = None
        self._recent: deque[_Alone] = deque()
        self._kept: dict[Key, _Alone] = {}

    def take(self, zones: Zones, motion: Motion | None = None) -> None:
        """Add the next frame, with its readings (:class:`~contactfpga.robot.haptics.WithReadings`); ``motion`` is for
        :meth:`LoadCells.wrench <contactfpga.robot.haptics.LoadCells.wrench>`."""
        if len(zones) == 1:
            self._kept = {}
            self._alone(zones, motion)
            return
        if self._key is not None and self._recent and zones.time_us - self._recent[0].time_us >= EARLIER_US:
            self._kept[self._key] = self._recent[0]
        keys = {_key(zone) for zone in zones}
        self._key = None
        self._recent.clear()
        self._kept = {key: place for key, place in self._kept.items() if key in keys}

    def _alone(self, zones: Zones, motion: Motion | None) -> None:
        key = _key(zones[0])
        if key != self._key:
            self._key = key
            self._recent.clear()
        if zones.units is None:
            return
        center = self._surface.center(self._cells.wrench(zones.units.readings, motion))
        if center is not None and center.covariance_m2 is not None:
            sigma = math.sqrt(float(center.covariance_m2.trace()) / 2)
            self._recent.append(_Alone(zones.time_us, center.point_m, sigma))
        while len(self._recent) > 1 and zones.time_us - self._recent[1].time_us >= EARLIER_US:
            self._recent.popleft()

    def sharpened(self, zones: Zones, touches: Sequence[Touch]) -> list[Touch]:
        """The touches of a frame's zones with places, each at its single-contact place if that is better known."""
        placed = [zone for zone in zones if zone.point_mm is not None]
        return [self._sharper(zone, touch, zones.sheet.pitch_x_mm) for zone, touch in zip(placed, touches, strict=True)]

    def _sharper(self, zone: Zone, touch: Touch, pitch_mm: float) -> Touch:
        place = self._kept.get(_key(zone))
        if place is None or place.sigma_m >= touch.point_sigma_m:
            return touch
        if math.dist(place.center_m, touch.point_m) > 1e-3 * pitch_mm * math.sqrt(zone.area_cells):
            return touch  # something that the sheet does not show pressed as well
        return dataclasses.replace(touch, point_m=place.center_m, point_sigma_m=place.sigma_m)


def _key(zone: Zone) -> Key:
    return zone.area_cells, zone.point_mm
