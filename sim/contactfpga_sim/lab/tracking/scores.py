"""Scores of the tracker and a baseline on random scenes and on recordings, at several frame rates.

Ids are judged as trackers are judged, by py-motmetrics: MOTA, IDF1, id switches.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from contactfpga.errors import MissingExtra
from contactfpga.inputs import array_file
from contactfpga.skin import Skin
from contactfpga.tracking.tracker import Tracker
from contactfpga.zones.zone import Zones
from contactfpga_sim.lab.tracking import scenes
from contactfpga_sim.lab.tracking.scenes import FrameTruth, Place, zones_of
from contactfpga_sim.model.scenes.recordings import Recording


class Nearest:
    """Neither speed nor memory: an id ends with the first frame that does not show it."""

    def __init__(self, gate_mm: float = 20.0):
        self._gate_mm = gate_mm
        self._before: dict[int, tuple[float, float]] = {}
        self._next_id = 1

    def update(self, zones: Zones) -> dict[int, tuple[float, float]]:
        """The place of each id."""
        places = [(zone.x_mm, zone.y_mm) for zone in zones if zone.x_mm is not None and zone.y_mm is not None]
        pairs = sorted(
            (math.dist(place, old), index, name)
            for index, place in enumerate(places)
            for name, old in self._before.items()
        )
        names: dict[int, int] = {}
        for distance, index, name in pairs:
            if distance <= self._gate_mm and index not in names and name not in names.values():
                names[index] = name
        for index in range(len(places)):
            if index not in names:
                names[index] = self._next_id
                self._next_id += 1
        self._before = {name: places[index] for index, name in names.items()}
        return self._before


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


def followed(update: Update, frames: Iterable[FrameTruth], rate_hz: float) -> list[Judged]:
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


MOST = 1500
"""Frames of a recording that are taken."""


def skin_of(recording: Recording) -> Skin:
    """A Skin of its size."""
    pitch = recording.pitch_mm or Skin().pitch_x_mm
    _, rows, columns = recording.pressed.shape
    return Skin(rows=rows, columns=columns, pitch_x_mm=pitch, pitch_y_mm=pitch, settle_us=100.0)


def histories(path: Path, every: int) -> list[list[FrameTruth]]:
    """The frames of each stretch of a recording between which the scene jumps, one of ``every`` frames, with the truth
    of all of them."""
    recording = Recording.load(path)
    skin = skin_of(recording)
    pressed = recording.pressed[:MOST]
    held = array_file.read(path, ("pressed", "segment"))
    segments = held["segment"][: len(pressed)] if "segment" in held else np.zeros(len(pressed), int)
    jumps = [0, *(np.flatnonzero(np.diff(segments)) + 1).tolist(), len(pressed)]
    step_us = 1e6 / recording.rate_hz
    return [list(_linked(pressed[start:end], skin, step_us))[::every] for start, end in itertools.pairwise(jumps)]


def _linked(frames: np.ndarray, skin: Skin, step_us: float) -> Iterator[FrameTruth]:
    """The frames, with a name for each zone."""
    linker = _Linker(frames.shape[1:])
    for number, cells in enumerate(frames):
        zones, labels = zones_of(cells, round(number * step_us), skin)
        truth: dict[int, Place] = {}
        for new, name in linker.take(labels).items():
            y, x = np.nonzero(labels == new)
            truth[name] = float(x.mean() * skin.pitch_x_mm), float(y.mean() * skin.pitch_y_mm)
        yield FrameTruth(zones, truth, ())


class _Linker:
    """Names zones by the cells they share."""

    def __init__(self, size: tuple[int, ...]):
        self._before = np.zeros(size, int)
        self._names: dict[int, int] = {}
        self._inside: dict[int, dict[int, np.ndarray]] = {}
        """By a name: the zones that went into its own, with their last cells."""
        self._fresh = 0

    def take(self, labels: np.ndarray) -> dict[int, int]:
        """The name of each label: that of the zone of the frame before that it shares most cells with, the largest
        share first; of a zone that went into another one, when it comes out again where it was; or a new one."""
        before, both = self._before, (self._before > 0) & (labels > 0)
        shares, counts = np.unique(np.stack([before[both], labels[both]]), axis=1, return_counts=True)
        ranked = shares.T[np.argsort(-counts, kind="stable")].tolist()
        now: dict[int, int] = {}
        for old, new in ranked:
            if new not in now and self._names[old] not in now.values():
                now[new] = self._names[old]
        self._remember(ranked, now)
        for new in range(1, labels.max(initial=0) + 1):
            if new not in now:
                now[new] = self._again(labels == new, {self._names[old] for old, other in ranked if other == new})
        self._before, self._names = labels, now
        return now

    def _remember(self, ranked: list[list[int]], now: dict[int, int]) -> None:
        kept = {name: self._inside.get(name, {}) for name in now.values()}
        for old, new in ranked:
            name = self._names[old]
            if name not in kept:  # its zone is another one's now, and so are those that went into it
                kept[now[new]] |= {name: self._before == old, **self._inside.get(name, {})}
        self._inside = kept

    def _again(self, cells: np.ndarray, of: set[int]) -> int:
        places = {(outer, name): int((cells & was).sum()) for outer in of for name, was in self._inside[outer].items()}
        best = max(places, key=places.__getitem__, default=None)
        if best is not None and places[best]:
            del self._inside[best[0]][best[1]]
            return best[1]
        self._fresh += 1
        return self._fresh - 1


RATES_HZ = (25.0, 50.0, 100.0, 200.0, 1000.0)
"""Frames per second of a scene."""

SCENES = 6
"""Of each family."""

EVERY = (1, 4)
"""Of a recording one frame of so many is taken."""

Scores = dict[str, Score]
"""By the tracker's name."""


@functools.cache
def of_family(family: str, rate_hz: float, count: int = SCENES) -> Scores:
    """On random scenes; the same ones at every rate."""
    name = zlib.crc32(family.encode())
    made = [
        list(scenes.played(scenes.FAMILIES[family](np.random.default_rng([name, number])), rate_hz))
        for number in range(count)
    ]
    return {tracker: score([followed(make(), one, rate_hz) for one in made]) for tracker, make in TRACKERS.items()}


@functools.cache
def of_recording(path: Path, every: int) -> Scores:
    """On the stretches of a recording between which the scene jumps."""
    stretches = histories(path, every)
    return {
        tracker: score([followed(make(), stretch, JUDGED_HZ) for stretch in stretches])
        for tracker, make in TRACKERS.items()
    }


def all_scenes() -> dict[tuple[str, float], Scores]:
    """Every family at every rate."""
    return {key: of_family(*key) for key in itertools.product(scenes.FAMILIES, RATES_HZ)}
