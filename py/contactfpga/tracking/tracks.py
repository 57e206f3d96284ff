"""Contacts and events after a frame."""

from __future__ import annotations

import dataclasses
from typing import Literal

from contactfpga import notebook
from contactfpga.zones.zone import Zone

Kind = Literal["down", "move", "merge", "split", "up"]


@dataclasses.dataclass(frozen=True, slots=True)
class Track:
    """A present contact, as of the frame in which it was last seen.

    >>> zones = contactfpga.read_zones("sim://?scene=two_fingers")
    >>> tracks = contactfpga.Tracker().update(zones)
    >>> [(track.id, track.zone.x_mm) for track in tracks.active]
    [(1, 55.0), (2, 95.0)]
    """

    id: int
    """Id that no other contact ever has."""
    zone: Zone
    """Zone in which the contact was last seen."""
    since_us: int
    """Device time at which the contact began, in us."""
    seen_us: int
    """Device time of the frame in which the contact was last seen, in us."""
    vx_mm_s: float
    """Speed along x in mm/s, smoothed over a few milliseconds."""
    vy_mm_s: float
    held: bool = False
    """Whether this frame lacks the contact: it bounces, the frame may leave zones out (``overflow``, ``mismatch``), or
    a zone that winds around the sheet may hide it."""
    merged: tuple[int, ...] = ()
    """Ids of smaller contacts in the same zone; each gets its own zone when they part."""
    place_mm: tuple[float, float] | None = None
    """Place by the order and times in which the cells closed (docs/tracking.md); the zone's barycenter where these say
    nothing. None without a table of places."""
    place_cov_mm2: tuple[tuple[float, float], tuple[float, float]] | None = None
    """Covariance of :attr:`place_mm`."""
    moved: bool = False
    """With a table of places: whether the contact slid, rolled or parted, so that :attr:`place_mm` is the
    barycenter."""
    missed: int = 0
    """With a table of places: frames since the contact began that were lost or left out, as by ``latest()``, by their
    numbers. Each may have put several closings into one."""

    def to_dict(self) -> dict[str, object]:
        """All values as plain Python objects for JSON."""
        return {
            "id": self.id,
            "x_mm": self.zone.x_mm,
            "y_mm": self.zone.y_mm,
            "vx_mm_s": self.vx_mm_s,
            "vy_mm_s": self.vy_mm_s,
            "area_cells": self.zone.area_cells,
            "since_us": self.since_us,
            "seen_us": self.seen_us,
            "held": self.held,
            "merged": list(self.merged),
        } | ({} if self.place_mm is None else self._place())

    def _place(self) -> dict[str, object]:
        return {name: getattr(self, name) for name in ("place_mm", "place_cov_mm2", "moved", "missed")}


@dataclasses.dataclass(frozen=True, slots=True)
class Event:
    """A change of a contact.

    >>> zones = contactfpga.read_zones("sim://?scene=two_fingers")
    >>> tracks = contactfpga.Tracker().update(zones)
    >>> [(event.kind, event.id) for event in tracks.events]
    [('down', 1), ('down', 2)]
    """

    kind: Kind
    """``down`` and ``up``: the contact begins and ends, once each. ``move``: it is ``move_mm`` from its place at the
    last event. ``merge``: it shares one zone with the ``parents`` from now on. ``split``: it has a zone of its own
    again."""
    id: int
    time_us: int
    """Device time of the frame that showed the event, in us."""
    parents: tuple[int, ...]
    """Ids of the other contacts in a ``merge`` or ``split``, or of the contact that parted in a ``down``."""
    zone: Zone
    """Zone of the contact; its last zone for ``up``."""
    seen_us: int
    """Device time at which the contact was last seen, in us; up to ``hold_ms`` before ``time_us`` for ``up``."""

    def to_dict(self) -> dict[str, object]:
        """All values as plain Python objects for JSON."""
        return {
            "kind": self.kind,
            "id": self.id,
            "time_us": self.time_us,
            "parents": list(self.parents),
            "x_mm": self.zone.x_mm,
            "y_mm": self.zone.y_mm,
            "seen_us": self.seen_us,
        }


@dataclasses.dataclass(frozen=True, slots=True)
class Tracks:
    """Contacts and events of one frame, from :meth:`Tracker.update`.

    >>> zones = contactfpga.read_zones("sim://?scene=two_fingers")
    >>> tracks = contactfpga.Tracker().update(zones)
    >>> len(tracks.active), len(tracks.events)
    (2, 2)
    """

    time_us: int
    """Device time of the frame, in us."""
    active: tuple[Track, ...]
    """Present contacts, one per zone, in order of their ids."""
    events: tuple[Event, ...]
    """Events since the frame before, in order."""
    unsure: tuple[Zone, ...] = ()
    """Zones that begin no contact: possible ghosts (:attr:`Zone.ghost`), in which a present contact continues, and
    zones around a closed sheet (:attr:`Zone.winding`), which hold present contacts."""
    restarted: bool = False
    """Whether the board's time ran backward, or its sheet changed: all contacts ended, and new ones began."""

    def _repr_html_(self) -> str:
        rows = [
            [f"#{track.id}", *(_mm(each) for each in (track.zone.x_mm, track.zone.y_mm)), f"{track.zone.area_cells}"]
            + [f"{track.vx_mm_s:.0f}, {track.vy_mm_s:.0f}", f"{(self.time_us - track.since_us) / 1e6:.3f}"]
            for track in self.active
        ]
        head = ["contact", "x, mm", "y, mm", "cells", "speed, mm/s", "for, s"]
        return notebook.table(head, rows, f"At {self.time_us / 1e6:.6f} s")

    def to_dict(self) -> dict[str, object]:
        """All values as plain Python objects for JSON."""
        return {
            "tracks": [track.to_dict() for track in self.active],
            "events": [event.to_dict() for event in self.events],
            "unsure": len(self.unsure),
            "restarted": self.restarted,
        }


def _mm(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"
