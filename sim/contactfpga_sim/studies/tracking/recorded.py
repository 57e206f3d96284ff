"""Recordings of real sheets. Who touched them is not known, but zones of two frames that share most cells are one
contact; trackers see barycenters and areas only."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from contactfpga.skin import Skin
from contactfpga_sim.scenes import array_file
from contactfpga_sim.scenes.recordings import Recording
from contactfpga_sim.studies.tracking.frames import Place, Shown, zones_of

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
    """Each zone goes on as the one of the frame before that it shares most cells with, the largest share first."""
    before, names, fresh = np.zeros(frames.shape[1:], int), {}, 0
    for number, cells in enumerate(frames):
        zones, labels = zones_of(cells, round(number * step_us), skin)
        both = (before > 0) & (labels > 0)
        shares, counts = np.unique(np.stack([before[both], labels[both]]), axis=1, return_counts=True)
        now: dict[int, int] = {}
        for old, new in shares.T[np.argsort(-counts, kind="stable")].tolist():
            if new not in now and names[old] not in now.values():
                now[new] = names[old]
        for new in range(1, labels.max(initial=0) + 1):
            if new not in now:
                now[new], fresh = fresh, fresh + 1
        truth: dict[int, Place] = {}
        for new, name in now.items():
            y, x = np.nonzero(labels == new)
            truth[name] = float(x.mean() * skin.pitch_x_mm), float(y.mean() * skin.pitch_y_mm)
        yield Shown(zones, truth, ())
        before, names = labels, now
