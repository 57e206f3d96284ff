"""Judges ids as trackers are judged, by py-motmetrics: MOTA, IDF1, id switches."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterable, Sequence

from contactfpga.errors import MissingExtra
from contactfpga.tracking.tracker import Tracker
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab.tracking.frames import Place, Shown
from contactfpga_sim.lab.tracking.nearest import Nearest

NEAR_MM = 15.0
"""How far from a contact an id may lie to be its own."""

JUDGED_HZ = 200.0
"""Frames per second that are judged at most; all of them are tracked."""

Update = Callable[[Zones], dict[int, Place]]
"""The place of each id after a frame."""


def ours() -> Update:
    """The tracker with its default settings."""
    tracker = Tracker()

    def update(zones: Zones) -> dict[int, Place]:
        active = tracker.update(zones).active
        return {track.id: (track.zone.x_mm or 0.0, track.zone.y_mm or 0.0) for track in active}

    return update


TRACKERS: dict[str, Callable[[], Update]] = {"`Tracker`": ours, "nearest zone": lambda: Nearest().update}
"""What is compared."""


@dataclasses.dataclass(frozen=True)
class Score:
    """What came out."""

    frames: int
    mota: float
    idf1: float
    switches: int

    @property
    def switches_per_1000(self) -> float:
        """Id switches per thousand judged frames."""
        return 1000 * self.switches / self.frames

    @property
    def cells(self) -> tuple[str, str, str]:
        """For a table: MOTA and IDF1 in percent, switches per thousand frames."""
        return f"{100 * self.mota:.1f}", f"{100 * self.idf1:.1f}", f"{self.switches_per_1000:.1f}"


Judged = tuple[dict[int, Place], dict[int, Place]]
"""Truth, and what a tracker said."""


def followed(update: Update, frames: Iterable[Shown], rate_hz: float) -> list[Judged]:
    """What a tracker says of these frames, where it is judged."""
    every = max(1, round(rate_hz / JUDGED_HZ))
    found = []
    for number, shown in enumerate(frames):
        said = update(shown.zones)
        if number % every == 0:
            apart = {name: place for name, place in said.items() if place not in shown.shared}
            found.append((shown.truth, apart))
    return found


def score(histories: Sequence[Sequence[Judged]], near_mm: float = NEAR_MM) -> Score:
    """Of several scenes together. Raises :class:`MissingExtra` without py-motmetrics."""
    try:
        import motmetrics
    except ModuleNotFoundError as error:
        raise MissingExtra(f"judging the tracker ({error})", "test") from None
    made = []
    for history in histories:
        made.append(motmetrics.MOTAccumulator(auto_id=True))
        for truth, said in history:
            distances = [[_near(math.dist(one, other), near_mm) for other in said.values()] for one in truth.values()]
            made[-1].update(list(truth), list(said), distances)
    metrics = ["num_frames", "mota", "idf1", "num_switches"]
    names = [str(number) for number in range(len(made))]
    table = motmetrics.metrics.create().compute_many(made, metrics=metrics, names=names, generate_overall=True)
    total = table.loc["OVERALL"]
    return Score(int(total["num_frames"]), float(total["mota"]), float(total["idf1"]), int(total["num_switches"]))


def _near(distance: float, limit: float) -> float:
    return distance if distance <= limit else math.nan
