"""MOTA, IDF1 and id switches, by py-motmetrics, of the tracker, two baselines and a published tracker."""

from __future__ import annotations

import dataclasses
import functools
import importlib
import itertools
import math
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from contactfpga.errors import MissingExtra
from contactfpga.inputs import array_file
from contactfpga.skin import Skin
from contactfpga.tracking.tracker import Tracker
from contactfpga.zones.zone import Zones
from contactfpga_sim.apps import pool, result_cache, stats
from contactfpga_sim.lab.tracking import scenes
from contactfpga_sim.lab.tracking.scenes import FrameTruth, Place, zones_of
from contactfpga_sim.model.scenes.recordings import Recording


class Nearest:
    """Baseline without speed or memory: an id ends with the first frame without it."""

    def __init__(self, gate_mm: float = 20.0):
        self._gate_mm = gate_mm
        self._before: dict[int, tuple[float, float]] = {}
        self._next_id = 1

    def update(self, zones: Zones) -> dict[int, tuple[float, float]]:
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


class ConstantVelocity:
    """Baseline that extrapolates speed for 0.1 s, at least one frame, and matches zones by least total distance."""

    def __init__(self, gate_mm: float = 20.0, coast_s: float = 0.1, smooth_s: float = 0.02):
        self._gate_mm, self._coast_s, self._smooth_s = gate_mm, coast_s, smooth_s
        self._seen: dict[int, tuple[float, np.ndarray, np.ndarray]] = {}
        """Time, place and speed of each id when last seen."""
        self._before = -math.inf  # time of the last frame
        self._next_id = 1

    def update(self, zones: Zones) -> dict[int, Place]:
        now = zones.time_us / 1e6
        since = max(self._coast_s, now - self._before)
        self._seen = {name: one for name, one in self._seen.items() if now - one[0] <= since}
        self._before = now
        places = np.array([(zone.x_mm, zone.y_mm) for zone in zones if zone.x_mm is not None]).reshape(-1, 2)
        ahead = np.array([place + speed * (now - then) for then, place, speed in self._seen.values()]).reshape(-1, 2)
        names = dict(zip(places_of(ahead, places, self._gate_mm), self._seen))
        found = {}
        for number, place in enumerate(places):
            name, speed = names.get(number), np.zeros(2)
            if name is None:
                name, self._next_id = self._next_id, self._next_id + 1
            else:
                then, before, speed = self._seen[name]
                if now > then:
                    fresh = -math.expm1((then - now) / self._smooth_s)
                    speed = speed + fresh * ((place - before) / (now - then) - speed)
            self._seen[name] = now, place, speed
            found[name] = (float(place[0]), float(place[1]))
        return found


def places_of(ahead: np.ndarray, places: np.ndarray, gate_mm: float) -> list[int]:
    """Place number of each of (n, 2) expected places, -1 beyond the gate."""
    from scipy.optimize import linear_sum_assignment

    apart = np.linalg.norm(ahead[:, None] - places, axis=2)
    found = [-1] * len(ahead)
    for row, column in zip(*linear_sum_assignment(np.where(apart <= gate_mm, apart, 1e6))):
        found[row] = int(column) if apart[row, column] <= gate_mm else -1
    return found


NEAR_MM = 15.0

JUDGED_HZ = 200.0
"""Most judged frames per second; all are tracked."""

Update = Callable[[Zones], dict[int, Place]]


def ours() -> Update:
    """The tracker with default settings; ids of zones in the frame, as for others."""
    tracker = Tracker()

    def update(zones: Zones) -> dict[int, Place]:
        seen = [track for track in tracker.update(zones).active if not track.held]
        return {track.id: (track.zone.x_mm or 0.0, track.zone.y_mm or 0.0) for track in seen}

    return update


def constant_velocity() -> Update:
    return ConstantVelocity().update


NORFAIR_HOLD = 2
"""Frames for which Norfair keeps an unseen id: the best of 2 frames, 0.1 and 0.3 s on tuning scenes."""


def norfair() -> Update:
    """Norfair, a published tracker: Kalman filters of constant velocity, a gate of 20 mm. Raises ImportError.

    It requires numpy below 2 without need, so no extra has it (docs/tracking.md).
    """
    published: Any = importlib.import_module("norfair")
    tracker = published.Tracker("euclidean", 20.0, hit_counter_max=NORFAIR_HOLD, initialization_delay=0)

    def update(zones: Zones) -> dict[int, Place]:
        shown = [published.Detection(np.array([[zone.x_mm, zone.y_mm]])) for zone in zones if zone.x_mm is not None]
        tracked = [one for one in tracker.update(shown) if one.last_detection in shown]
        places = {one.id: one.last_detection.points[0] for one in tracked}
        return {name: (float(place[0]), float(place[1])) for name, place in places.items()}

    return update


TRACKERS: dict[str, Callable[[], Update]] = {
    "`Tracker`": ours,
    "nearest zone": lambda: Nearest().update,
    "constant velocity": constant_velocity,
    "Norfair": norfair,
}


@dataclasses.dataclass(frozen=True)
class Score:
    frames: int
    mota: float
    idf1: float
    switches: int
    idf1_each: tuple[float, ...] = ()
    """IDF1 by scene; nan if nothing could be distinguished."""
    counted: tuple[float, ...] = ()
    """Weight by scene: judged places of contacts and ids."""

    @property
    def switches_per_1000(self) -> float:
        return 1000 * self.switches / self.frames

    @property
    def half(self) -> float:
        """Half of IDF1's 95 % interval."""
        return half(self.pulls)

    @property
    def pulls(self) -> np.ndarray:
        """Effect of each scene on IDF1; the sum is 0."""
        share = np.array(self.counted) / np.sum(self.counted)
        return np.where(share > 0, share * (np.nan_to_num(self.idf1_each) - self.idf1), np.nan)

    @property
    def cells(self) -> tuple[str, str, str]:
        """MOTA and IDF1 in percent, switches per thousand frames."""
        return f"{100 * self.mota:.1f}", f"{100 * self.idf1:.1f}", f"{self.switches_per_1000:.1f}"


def half(pulls: np.ndarray) -> float:
    """Half of a weighted mean's 95 % interval, by Student's t; nan without any."""
    from scipy.stats import t

    pulls = pulls[~np.isnan(pulls)]
    count = len(pulls)
    return float(t.ppf(0.975, count - 1) * math.sqrt(count / (count - 1) * np.sum(pulls**2)))


Judged = tuple[dict[int, Place], dict[int, Place]]
"""Truth and a tracker's output."""


def followed(update: Update, frames: Iterable[FrameTruth], rate_hz: float) -> list[Judged]:
    """A tracker's output on judged frames."""
    every = max(1, round(rate_hz / JUDGED_HZ))
    found = []
    for number, shown in enumerate(frames):
        said = update(shown.zones)
        if number % every == 0:
            apart = {name: place for name, place in said.items() if place not in shown.shared}
            found.append((shown.truth, apart))
    return found


def score(histories: Sequence[Sequence[Judged]], near_mm: float = NEAR_MM) -> Score:
    """Score of several scenes. Raises :class:`MissingExtra` without py-motmetrics."""
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
    metrics = ["num_frames", "mota", "idf1", "num_switches", "num_objects", "num_predictions"]
    names = [str(number) for number in range(len(made))]
    table = motmetrics.metrics.create().compute_many(made, metrics=metrics, names=names, generate_overall=True)
    total = table.loc["OVERALL"]
    each = tuple(float(value) for value in table.loc[names, "idf1"])
    counted = tuple(float(value) for value in table.loc[names, "num_objects"] + table.loc[names, "num_predictions"])
    sums = int(total["num_frames"]), float(total["mota"]), float(total["idf1"]), int(total["num_switches"])
    return Score(*sums, each, counted)


def _near(distance: float, limit: float) -> float:
    return distance if distance <= limit else math.nan


MOST = 1500


def skin_of(recording: Recording) -> Skin:
    pitch = recording.pitch_mm or Skin().pitch_x_mm
    _, rows, columns = recording.pressed.shape
    return Skin(rows=rows, columns=columns, pitch_x_mm=pitch, pitch_y_mm=pitch, settle_us=100.0)


def histories(path: Path, every: int) -> list[list[FrameTruth]]:
    """Stretches of a recording between jumps, one of ``every`` frames, with the truth from all."""
    recording = Recording.load(path)
    skin = skin_of(recording)
    pressed = recording.pressed[:MOST]
    held = array_file.read(path, ("pressed", "segment"))
    segments = held["segment"][: len(pressed)] if "segment" in held else np.zeros(len(pressed), int)
    jumps = [0, *(np.flatnonzero(np.diff(segments)) + 1).tolist(), len(pressed)]
    step_us = 1e6 / recording.rate_hz
    return [list(_linked(pressed[start:end], skin, step_us))[::every] for start, end in itertools.pairwise(jumps)]


def _linked(frames: np.ndarray, skin: Skin, step_us: float) -> Iterator[FrameTruth]:
    linker = _Linker(frames.shape[1:])
    for number, cells in enumerate(frames):
        zones, labels = zones_of(cells, round(number * step_us), skin)
        truth: dict[int, Place] = {}
        for new, name in linker.take(labels).items():
            y, x = np.nonzero(labels == new)
            truth[name] = float(x.mean() * skin.pitch_x_mm), float(y.mean() * skin.pitch_y_mm)
        yield FrameTruth(zones, truth, ())


class _Linker:
    def __init__(self, size: tuple[int, ...]):
        self._before = np.zeros(size, int)
        self._names: dict[int, int] = {}
        self._inside: dict[int, dict[int, np.ndarray]] = {}
        """Zones merged into this one, by name, with last cells."""
        self._fresh = 0

    def take(self, labels: np.ndarray) -> dict[int, int]:
        """Name of each label: the previous zone with most shared cells, largest share first; or a merged zone's old
        name."""
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


RATES_HZ = (25.0, 100.0, 10_000.0)

JUDGED_RATES = RATES_HZ[1:]
"""Rates at which the tracker must not be worse."""

MOST_FRAMES = 6_000

FIRST, SCENES = 6, 12
"""Scenes per family at the first look, and at most; the tracker was tuned on those from 1000 on."""

NARROW = 0.05
"""Half of our IDF1's interval at which a family has enough scenes."""

OURS = "`Tracker`"

EVERY = (1, 4)

Scores = dict[str, Score]


@functools.cache
def of_family(family: str, rate_hz: float, count: int = SCENES, names: tuple[str, ...] = tuple(TRACKERS)) -> Scores:
    """Scores on random scenes, the same at every rate; cached."""
    key = repr((result_cache.made_by(__name__), family, rate_hz, count, names))
    found = result_cache.cached("tracking", key, lambda: _scored(family, rate_hz, count, names))
    return {name: Score(**one) for name, one in found.items()}


def _scored(family: str, rate_hz: float, count: int, names: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Scores on as many scenes as our tracker's interval needs, whatever the other trackers."""
    seed, seconds = zlib.crc32(family.encode()), min(scenes.SECONDS, MOST_FRAMES / rate_hz)
    numbers = itertools.count()

    def one() -> dict[str, list[Judged]]:
        fingers = scenes.FAMILIES[family](np.random.default_rng([seed, next(numbers)]))
        frames = list(scenes.played(fingers, rate_hz, seconds=seconds))
        return {name: followed(TRACKERS[name](), frames, rate_hz) for name in names}

    def enough(found: Sequence[dict[str, list[Judged]]]) -> bool | None:
        return score([scene[OURS] for scene in found]).half <= NARROW or None

    found, _ = stats.drawn(lambda more: [one() for _ in range(more)], stats.looks(FIRST, count), enough)
    return {name: dataclasses.asdict(score([scene[name] for scene in found])) for name in names}


def ahead(ours: Score, other: Score) -> tuple[float, float]:
    """Excess of the first IDF1, and half of its 95 % interval."""
    return ours.idf1 - other.idf1, half(ours.pulls - other.pulls)


@functools.cache
def of_recording(path: Path, every: int) -> Scores:
    stretches = histories(path, every)
    return {
        tracker: score([followed(make(), stretch, JUDGED_HZ) for stretch in stretches])
        for tracker, make in TRACKERS.items()
    }


def all_scenes() -> dict[tuple[str, float], Scores]:
    keys = list(itertools.product(scenes.FAMILIES, RATES_HZ))
    with pool.executor() as workers, pool.progress() as step:
        for one in [workers.submit(of_family, *key) for key in keys]:
            one.result()
            step("scores", len(keys))
    return {key: of_family(*key) for key in keys}
