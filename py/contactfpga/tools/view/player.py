"""A recording of one board that plays."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

from contactfpga.driver.stats import Stats
from contactfpga.robot.haptics import LoadCells
from contactfpga.tools.view.meter import Meter
from contactfpga.tools.view.playback import Playback
from contactfpga.tools.view.replayed import Recorded
from contactfpga.tools.view.sources import Moment
from contactfpga.tracking.tracker import Tracker
from contactfpga.tracking.tracks import Tracks
from contactfpga.zones.batch import Batch
from contactfpga.zones.zone import Zones


class Player(Playback[Zones]):
    """Plays one board."""

    cells: LoadCells | None = None

    def __init__(self, recording: Recorded, clock: Callable[[], float] = time.monotonic):
        super().__init__(recording.duration_s, clock)
        self.title, self.sheet, self.meter = recording.title, recording.sheet, Meter()
        self._recording = recording
        self._tracker = Tracker()
        self._taken: list[Zones] = []
        self._tracks: Tracks | None = None

    def turn(self) -> Moment | None:
        """The frame that is to be shown now, after those before it have been counted and followed."""
        self._taken = []
        self.step()
        if not self._taken or self._tracks is None:
            return None
        self.meter.take(Batch.of(self._taken), Stats(), 0)
        return Moment(self._taken[-1], self._tracks)

    def told(self) -> list[tuple[str, str]]:
        return [("moment", f"{self.position_s:.3f} of {self.duration_s:.3f} s")]

    def begin(self, start_s: float) -> Iterator[tuple[float, Zones]]:
        self.meter, self._tracker = Meter(), Tracker()
        return ((when, zones) for when, zones in self._recording.frames(start_s) if zones.sheet == self.sheet)

    def follow(self, seconds: float, item: Zones) -> None:
        self._taken.append(item)
        self._tracks = self._tracker.update(item)
