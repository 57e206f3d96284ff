"""What a link's thread learned last; the link's state is made from it when somebody asks."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping

from contactfpga.robot.body.plan import Plan
from contactfpga.robot.body.state import LinkState
from contactfpga.tracking.tracks import Tracks
from contactfpga.zones.zone import Zones

NO_TRACKS = Tracks(0, (), ())


@dataclasses.dataclass(frozen=True, slots=True)
class Known:
    """What holds from one event of a link to the next."""

    opened: bool = False
    """There is an open board."""
    open_s: float = -math.inf
    """When it was opened."""
    zones: Zones | None = None
    tracks: Tracks = NO_TRACKS
    frame_s: float = -math.inf
    """When the newest frame was scanned that ever came, on the body's clock."""
    came_s: float = -math.inf
    """The same on that board's own clock."""
    down: str = "lost"
    """Its status where no board is open."""
    reason: str = "it was not tried yet"
    """Why none is."""

    def state(self, plan: Plan, now: float, board_s: float | None) -> LinkState:
        """The state at that moment; ``board_s``: the same on the clock of a virtual board, None for any other."""
        age_s = None if self.frame_s == -math.inf else now - self.frame_s
        if not self.opened:
            return LinkState(None, age_s, self.down, self.reason)
        waited_s = now - max(self.frame_s, self.open_s)
        if board_s is not None:  # nothing happens on the sheet while its time does not pass
            waited_s = board_s - self.came_s
            age_s = None if self.zones is None else waited_s
        if waited_s > plan.silent_s:
            return LinkState(None, age_s, "silent", f"no frame for {waited_s:.3f} s")
        if self.zones is None or age_s is None:
            return LinkState(None, age_s, "late", "no frame since the port was opened")
        status = "ok" if age_s <= plan.late_s else "late"
        return LinkState(self.zones, age_s, status, "", self.frame_s, self.tracks)


Seen = tuple[Known, float | None]
"""And what a virtual board's clock said then."""


class States(Mapping[str, LinkState]):
    """The states of all links at a moment."""

    def __init__(self, plans: Mapping[str, Plan], seen: Mapping[str, Seen], now: float):
        self._plans, self._seen, self._now = plans, seen, now

    def __getitem__(self, name: str) -> LinkState:
        known, board_s = self._seen[name]
        return known.state(self._plans[name], self._now, board_s)

    def __iter__(self) -> Iterator[str]:
        return iter(self._seen)

    def __len__(self) -> int:
        return len(self._seen)
