"""Scores of the tracker and the baseline on random scenes and on recordings, at several frame rates."""

from __future__ import annotations

import functools
import itertools
import zlib
from pathlib import Path

import numpy as np

from contactfpga_sim.lab.tracking import frames, judge, recorded, scenes
from contactfpga_sim.lab.tracking.judge import Score

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
    stretches = recorded.histories(path, every)
    return {
        tracker: judge.score([judge.followed(make(), stretch, judge.JUDGED_HZ) for stretch in stretches])
        for tracker, make in judge.TRACKERS.items()
    }


def all_scenes() -> dict[tuple[str, float], Scores]:
    """Every family at every rate."""
    return {key: of_family(*key) for key in itertools.product(scenes.FAMILIES, RATES_HZ)}
