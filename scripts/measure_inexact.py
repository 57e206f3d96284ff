"""Finds the faults of four public labellers again, in models of them: the study ``inexact``. See docs/rivals.md."""

from __future__ import annotations

import collections
import dataclasses
import itertools
from collections.abc import Iterator

import numpy as np
from rivals import exactness
from rivals.campaign import OURS
from rivals.house import all_departures, table_of
from rivals.inexact import INEXACT, Inexact, Zone

CELLS = 10
"""Every frame is tried on sheets of at most this many cells."""
SIDE = 32
"""Rows and columns of the sheets of the others, and the most of the larger frames that are tried."""
NOISE = 100


@dataclasses.dataclass(frozen=True)
class Fault:
    """The smallest frame that a labeller gives wrong zones for."""

    labeller: Inexact
    cells: np.ndarray
    got: list[Zone]
    right: list[Zone]


def compute() -> list[Fault]:
    """A fault of each."""
    return [fault(one) for one in INEXACT]


def fault(labeller: Inexact) -> Fault:
    """The first frame that is wrong: by cells of the sheet, then rows, then as :func:`small` and :func:`large` go."""
    for frames in itertools.chain(small(), large()):
        for cells, right in zip(frames, exact(frames), strict=True):
            if (got := sorted(labeller.model(cells))) != right:
                return Fault(labeller, cells, got, right)
    raise LookupError(f"{labeller.name} is right in every frame that was tried; its model lost its fault")


def small() -> Iterator[np.ndarray]:
    """(N, R, C) bool: every frame of each sheet of at most :data:`CELLS` cells."""
    for rows, columns in sheets(CELLS, CELLS):
        places = np.arange(rows * columns)
        yield (np.arange(1 << len(places))[:, None] >> places & 1).astype(bool).reshape(-1, rows, columns)


def large() -> Iterator[np.ndarray]:
    """(2, R, C) bool: a sheet pressed all over, and lone cells in every second row and column."""
    for rows, columns in sheets(SIDE, SIDE * SIDE):
        frames = np.ones((2, rows, columns), bool)
        frames[1, 1::2] = frames[1, :, 1::2] = False
        yield frames


def sheets(side: int, cells: int) -> list[tuple[int, int]]:
    """Rows and columns of each sheet with at most ``side`` of either and at most ``cells`` cells, small ones first."""
    every = [(rows, columns) for rows in range(1, side + 1) for columns in range(1, side + 1)]
    return sorted((one for one in every if one[0] * one[1] <= cells), key=lambda one: (one[0] * one[1], one))


def exact(frames: np.ndarray) -> list[list[Zone]]:
    """Zones of each of (N, R, C) bool frames by the golden model, sorted."""
    found = all_departures(frames, 8)
    return [sorted(map(tuple, part.tolist())) for part in np.split(found.moments, found.offsets[1:-1])]


def inexact_table(faults: list[Fault]) -> str:
    """How many frames of 32x32 are wrong. Ours are given the same frames."""
    frames = np.concatenate([exactness.frames_for(SIDE, NOISE), embedded(faults)])
    right = exact(frames)
    rows = [("labeller", "what ran", f"wrong of {len(frames)} frames of {SIDE}x{SIDE}", "smallest wrong frame")]
    for one in faults:
        wrong = sum(sorted(one.labeller.model(cells)) != zones for cells, zones in zip(frames, right, strict=True))
        rows.append((one.labeller.name, "model", str(wrong), "x".join(map(str, one.cells.shape))))
    rows += [(f"`{one}`", "gateware", str(exactness.check_ours(one, SIDE, frames).wrong), "") for one in OURS]
    return table_of(rows)


def embedded(faults: list[Fault]) -> np.ndarray:
    """(N, 32, 32) bool: each fault's frame in the first rows and columns."""
    frames = np.zeros((len(faults), SIDE, SIDE), bool)
    for whole, one in zip(frames, faults, strict=True):
        whole[: one.cells.shape[0], : one.cells.shape[1]] = one.cells
    return frames


def pictures(faults: list[Fault]) -> str:
    """The frame of each fault as text."""
    return "\n\n".join(f"{_said(one)}\n\n```text\n{drawn(one.cells)}\n```" for one in faults)


def sample() -> str:
    """The part of the pictures that takes a second."""
    return pictures([fault(INEXACT[0])])


def _said(one: Fault) -> str:
    return f"{one.labeller.name}: areas {areas(one.got)}; right is {areas(one.right)}."


def areas(zones: list[Zone]) -> str:
    """Each area, and how many zones have it if there are several."""
    counted = collections.Counter(zone[0] for zone in zones)
    return ", ".join(f"{number} x {area}" if number > 1 else f"{area}" for area, number in sorted(counted.items()))


def drawn(cells: np.ndarray) -> str:
    """``#`` is pressed."""
    return "\n".join("".join(".#"[cell] for cell in row) for row in cells.astype(int).tolist())
