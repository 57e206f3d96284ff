"""Scores of the tracker and the baseline on random scenes and on recordings, at several frame rates."""

from __future__ import annotations

import functools
import itertools
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from contactfpga.inputs import array_file
from contactfpga.skin import Skin
from contactfpga_sim.lab.tracking import frames, judge, scenes
from contactfpga_sim.lab.tracking.frames import Place, Shown, zones_of
from contactfpga_sim.lab.tracking.judge import Score
from contactfpga_sim.model.scenes.recordings import Recording

MOST = 1500
"""Frames of a recording that are taken."""


def skin_of(recording: Recording) -> Skin:
    """A Skin of its size."""
    pitch = recording.pitch_mm or Skin().pitch_x_mm
    _, rows, columns = recording.pressed.shape
    return Skin(rows=rows, columns=columns, pitch_x_mm=pitch, pitch_y_mm=pitch, settle_us=100.0)


def histories(path: Path, every: int) -> list[list[Shown]]:
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


def _linked(frames: np.ndarray, skin: Skin, step_us: float) -> Iterator[Shown]:
    """The frames, with a name for each zone."""
    linker = _Linker(frames.shape[1:])
    for number, cells in enumerate(frames):
        zones, labels = zones_of(cells, round(number * step_us), skin)
        truth: dict[int, Place] = {}
        for new, name in linker.take(labels).items():
            y, x = np.nonzero(labels == new)
            truth[name] = float(x.mean() * skin.pitch_x_mm), float(y.mean() * skin.pitch_y_mm)
        yield Shown(zones, truth, ())


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
        list(frames.played(scenes.FAMILIES[family](np.random.default_rng([name, number])), rate_hz))
        for number in range(count)
    ]
    return {
        tracker: judge.score([judge.followed(make(), one, rate_hz) for one in made])
        for tracker, make in judge.TRACKERS.items()
    }


@functools.cache
def of_recording(path: Path, every: int) -> Scores:
    """On the stretches of a recording between which the scene jumps."""
    stretches = histories(path, every)
    return {
        tracker: judge.score([judge.followed(make(), stretch, judge.JUDGED_HZ) for stretch in stretches])
        for tracker, make in judge.TRACKERS.items()
    }


def all_scenes() -> dict[tuple[str, float], Scores]:
    """Every family at every rate."""
    return {key: of_family(*key) for key in itertools.product(scenes.FAMILIES, RATES_HZ)}
