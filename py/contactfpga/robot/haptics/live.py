"""Frames with the force at each of their zones, as soon as the readings that belong to a frame are known."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import Protocol

from contactfpga.errors import ReadTimeout, ReplayEnded
from contactfpga.robot.haptics.alone import AloneWatch
from contactfpga.robot.haptics.answer import HapticsError
from contactfpga.robot.haptics.contact import Contacts
from contactfpga.robot.haptics.solve import contacts
from contactfpga.robot.haptics.units import LoadCells
from contactfpga.robot.haptics.wrench import Motion
from contactfpga.tracking.tracks import Tracks
from contactfpga.zones.zone import Zones

WAIT_US = 20_000
"""How long a frame waits for the readings after it, in device time."""


def felt(
    cells: LoadCells,
    zones: Zones,
    friction: float = 0.5,
    *,
    motion: Motion | None = None,
    tracks: Tracks | None = None,
    alone: AloneWatch | None = None,
) -> Contacts | None:
    """The force at each zone of a frame, from the units' readings at its moment; None where these are not known (yet),
    and where a zone leads around the sheet (:attr:`Zone.winding <contactfpga.Zone.winding>`): it pushes as well, at no
    known place.

    Raises :class:`HapticsError` where the cells have no surface, or are not as many as the board's units.
    """
    if cells.surface is None:
        raise HapticsError("surface is missing; give units.toml a table [surface] with the bumper's outside")
    if zones.units is None or any(zones.windings):
        return None
    wrench = cells.wrench(zones.units.readings, motion)
    return contacts(wrench, zones, cells.surface, friction, sheet_m=cells.sheet_m, tracks=tracks, alone=alone)


class Source(Protocol):
    """A board, or what else gives frames in order."""

    def next(self, timeout: float = 1.0) -> Zones: ...


class WithReadings:
    """The frames of a board in the same order, each once its ``units`` are known: ``for zones in WithReadings(board)``.

    The sweep after a frame is on its way when the frame comes, so each is late by a sweep or two. A frame whose
    readings were lost comes without them ``wait_us`` of device time later.
    """

    def __init__(self, source: Source, wait_us: int = WAIT_US):
        self._source, self._wait_us = source, wait_us
        self._waiting: deque[Zones] = deque()
        self._ended = False

    def next(self, timeout: float = 1.0) -> Zones:
        """The next one. Raises as that of the source; what waits comes first."""
        while not (self._waiting and (self._ended or self._due(self._waiting[0]))):
            try:
                self._waiting.append(self._source.next(timeout))
            except (ReplayEnded, ReadTimeout) as error:
                if not self._waiting:
                    raise
                if isinstance(error, ReadTimeout):
                    break
                self._ended = True
        return self._waiting.popleft()

    def _due(self, zones: Zones) -> bool:
        return zones.units is not None or self._waiting[-1].time_us - zones.time_us > self._wait_us

    def __iter__(self) -> Iterator[Zones]:
        try:
            while True:
                yield self.next()
        except ReplayEnded:
            return
