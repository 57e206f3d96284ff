"""Output of a tracker after a frame: the present contacts, and their events."""

from __future__ import annotations

import dataclasses
from typing import Literal

from contactfpga import notebook
from contactfpga.zones.zone import Zone

Kind = Literal["down", "move", "merge", "split", "up"]


@dataclasses.dataclass(frozen=True, slots=True)
class Track:
    """One present contact, as of the frame in which it was last seen.

    >>> zones = contactfpga.read_zones("sim://?scene=two_fingers")
    >>> tracks = contactfpga.Tracker().update(zones)
    >>> [(track.id, track.zone.x_mm) for track in tracks.active]
    [(1, 55.0), (2, 95.0)]
    """

    id: int
    """Stays with the contact; no other contact ever has it."""
    zone: Zone
    """Where it was last seen."""
    since_us: int
    """When it came, in device time in us."""
    seen_us: int
    """Device time of the frame in which it was last seen, in us."""
    vx_mm_s: float
    """Its speed along x in mm/s, smoothed over a few milliseconds."""
    vy_mm_s: float
    held: bool = False
    """This frame does not show it. It bounces, the frame leaves zones out (``overflow``, ``mismatch``), or a zone that
    winds around the sheet may hide it."""
    merged: tuple[int, ...] = ()
    """Ids of smaller contacts in the same zone; each gets its own zone again when they part."""

    def to_dict(self) -> dict[str, object]:
        """Everything in plain Python values, ready for JSON."""
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
        }


@dataclasses.dataclass(frozen=True, slots=True)
class Event:
    """Something that happened to a contact.

    >>> zones = contactfpga.read_zones("sim://?scene=two_fingers")
    >>> tracks = contactfpga.Tracker().update(zones)
    >>> [(event.kind, event.id) for event in tracks.events]
    [('down', 1), ('down', 2)]
    """

    kind: Kind
    """``down``: it begins, and ``up``: it ends, once each. ``move``: it is ``move_mm`` from where the last event saw
    it. ``merge``: from now on it has one zone with the ``parents``. ``split``: it has a zone of its own, apart from
    the ``parents``."""
    id: int
    time_us: int
    """Device time of the frame that showed it, in us."""
    parents: tuple[int, ...]
    """Ids of the other contacts in a ``merge`` or ``split``, or in a ``down`` that began as a contact parted in two."""
    zone: Zone
    """Its zone then; for ``up``, its last zone."""
    seen_us: int
    """When it was last seen, in us: ``time_us``, except for ``up``, which may come up to ``hold_ms`` later."""

    def to_dict(self) -> dict[str, object]:
        """Everything in plain Python values, ready for JSON."""
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
    """What :meth:`Tracker.update` returns.

    >>> zones = contactfpga.read_zones("sim://?scene=two_fingers")
    >>> tracks = contactfpga.Tracker().update(zones)
    >>> len(tracks.active), len(tracks.events)
    (2, 2)
    """

    time_us: int
    """Device time of the frame, in us."""
    active: tuple[Track, ...]
    """The present contacts, one for each zone, in order of their ids."""
    events: tuple[Event, ...]
    """What happened since the frame before, in order."""
    unsure: tuple[Zone, ...] = ()
    """Zones without a contact, because other pressed switches may have made them (:attr:`Zone.ghost`), or because they
    go around a closed sheet and have no x (:attr:`Zone.winding`). They begin no contact. A present contact goes on in a
    ghost, and is held while a zone winds."""
    restarted: bool = False
    """The board's time ran backward, or its sheet changed. All contacts ended, and new ones began."""

    def _repr_html_(self) -> str:
        """The contacts as a table in a notebook."""
        rows = [
            [f"#{track.id}", *(_mm(each) for each in (track.zone.x_mm, track.zone.y_mm)), f"{track.zone.area_cells}"]
            + [f"{track.vx_mm_s:.0f}, {track.vy_mm_s:.0f}", f"{(self.time_us - track.since_us) / 1e6:.3f}"]
            for track in self.active
        ]
        head = ["contact", "x, mm", "y, mm", "cells", "speed, mm/s", "for, s"]
        return notebook.table(head, rows, f"At {self.time_us / 1e6:.6f} s")

    def to_dict(self) -> dict[str, object]:
        """Everything in plain Python values, ready for JSON."""
        return {
            "tracks": [track.to_dict() for track in self.active],
            "events": [event.to_dict() for event in self.events],
            "unsure": len(self.unsure),
            "restarted": self.restarted,
        }


def _mm(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"
