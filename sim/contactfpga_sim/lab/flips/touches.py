"""Touches during a flip, and all truthful frames about them."""

from __future__ import annotations

import itertools

import numpy as np

from contactfpga.skin import Skin
from contactfpga.zones.zone import Zones
from contactfpga_sim.model import golden

STEP_S = 0.005
PERIOD, REST = 8, 3
"""The last ``REST`` of ``PERIOD`` sheets are empty for a waiting scan."""

Said = tuple[int, int, tuple[tuple[int, int, int], ...]]
"""Pressed cells, total zones, and moments of listed ones."""


def sheets(skin: Skin, count: int, seed: int = 7) -> np.ndarray:
    """(count, rows, columns) bool: three touches of different sizes that move a cell at a time, come and go. A
    waiting scan sometimes waits."""
    rng = np.random.default_rng(seed)
    cells = np.zeros((count, skin.rows, skin.columns), bool)
    for rows, columns in ((2, 2), (3, 3), (4, 2)):
        most = np.array([skin.rows - rows, skin.columns - columns])
        place, there = rng.integers(0, most + 1), True
        for sheet in cells:
            if rng.random() < 0.08:
                there, place = not there, rng.integers(0, most + 1)
            place = np.clip(place + rng.integers(-1, 2, 2), 0, most)
            if there:
                sheet[place[0] : place[0] + rows, place[1] : place[1] + columns] = True
    if skin.derived.scan.waits:
        cells[np.arange(count) % PERIOD >= PERIOD - REST] = False
    return cells


def said(zones: Zones) -> Said:
    moments = tuple(sorted((int(area), int(x), int(y)) for area, x, y in zones.frame.moments.tolist()))
    return zones.pressed, zones.total_zones, moments


class TruthWindow:
    """Possible frames at each step of (n, rows, columns) bool ``sheets``: any scan, during which the sheet may
    change between two rows. A scan that first selects touched rows skips the others."""

    def __init__(self, skin: Skin, sheets: np.ndarray):
        self._skin = skin
        self._known: dict[bytes, Said] = {}
        self.still = [self._says(cells) for cells in sheets]
        """Content of a scan of each sheet at rest."""
        self._changing = [self._between(*pair) for pair in itertools.pairwise(sheets)]

    def holds(self, what: Said, first: int, last: int) -> bool:
        """Whether a scan can report this from sheet ``first`` to ``last``."""
        last = min(last, len(self.still) - 1)
        return what in self.still[first : last + 1] or any(what in self._changing[step] for step in range(first, last))

    def _between(self, before: np.ndarray, after: np.ndarray) -> set[Said]:
        ends = [0, *(np.flatnonzero((before != after).any(axis=1)) + 1)]
        later = [after]
        if self._skin.reads_rows:
            later.append(after & before.any(axis=1, keepdims=True))
        return {self._says(np.concatenate([before[:row], one[row:]])) for row in ends for one in later}

    def _says(self, cells: np.ndarray) -> Said:
        key = cells.tobytes()
        if key not in self._known:
            zones = tuple(sorted(golden.zones(cells, self._skin.connectivity)))
            self._known[key] = int(cells.sum()), len(zones), zones
        return self._known[key]
