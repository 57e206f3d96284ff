"""Watches frames for switches that are stuck, loose or dead."""

from __future__ import annotations

import json
import math

import numpy as np

from contactfpga.errors import SkinMismatch
from contactfpga.skin import Skin
from contactfpga.skin.sheet import Sheet
from contactfpga.zones.cell_history import CellHistory
from contactfpga.zones.suspicion import Cell, Limits, Suspicion, places
from contactfpga.zones.zone import Zones
from contactfpga.zones.zone_history import ZoneHistory

LOOKS = 100
"""Within the time after which a switch is stuck; between them frames are only taken down."""


class Watch:
    """Finds switches that are stuck, loose or dead in a history of frames. It reads no port and waits for nothing, and
    its time is the frames' time.

    A cell, or a zone if the board sends zones, is suspected once it has stayed pressed without a change for ``stuck_s``
    seconds while at least ``others`` cells elsewhere came and went since its last change. If nothing else changes, the
    watch says nothing: an arm may rest on a table. A cell is loose if it changes more than ``flutter_hz`` times per
    second; changes within 10 ms count once, because a switch that bounces is not loose. Cells of ``skin.mask`` are left
    out.

    Raises ValueError for limits that are not positive, and :class:`SkinMismatch` for frames of another Skin's sheet.
    """

    def __init__(
        self, skin: Skin | None = None, *, stuck_s: float = 10.0, others: int = 8, flutter_hz: float = 40.0
    ) -> None:
        for name, value in (("stuck_s", stuck_s), ("others", others), ("flutter_hz", flutter_hz)):
            if not (math.isfinite(value) and value > 0):
                raise ValueError(f"{name} is {value!r}; it must be above 0")
        self._skin = skin
        self._mask = set(skin.mask) if skin else set()
        self._limits = Limits(round(stuck_s * 1e6), others, flutter_hz)
        self._sheet: Sheet | None = None
        self._present = self._seen = np.zeros((0, 0), bool)
        self._history: CellHistory | ZoneHistory
        self._last_us = self._look_us = -1

    def update(self, zones: Zones) -> tuple[Suspicion, ...]:
        """Take the next frame; returns what is newly suspected, each thing once. A board that restarts, or has another
        sheet, begins a new history."""
        time_us = zones.time_us
        if zones.sheet != self._sheet:
            self._meet(zones.sheet)
            self._begin(zones)
        elif time_us < self._last_us:
            self._begin(zones)
        self._last_us = time_us
        self._history.take(zones)
        if zones.cells is not None:
            real = ~zones.ghost_cells if zones.sheet.ghosts and zones.ghost_cells is not None else True
            self._seen |= zones.cells & real
        if time_us < self._look_us:
            return ()
        self._look_us = time_us + self._limits.stuck_us // LOOKS
        return tuple(self._history.suspicions(time_us))

    def _meet(self, sheet: Sheet) -> None:
        if self._skin is not None and self._skin.sheet != sheet:
            raise SkinMismatch("the frames are of another Skin than the one whose mask is watched; give their own Skin")
        self._sheet = sheet
        self._present = np.ones((sheet.rows, sheet.columns), bool)
        for row, column in self._mask:
            self._present[row, column] = False
        self._seen = np.zeros_like(self._present)

    def _begin(self, zones: Zones) -> None:
        make = ZoneHistory if zones.cells is None else CellHistory
        self._history = make(zones, self._limits, self._present)
        self._look_us = zones.time_us

    @property
    def seen(self) -> np.ndarray | None:
        """(rows, columns) bool: cells that read pressed at least once; None where the board sends no cells, or before
        the first frame."""
        return self._seen.copy() if self._sheet is not None and self._sheet.report == "cells" else None

    @property
    def never(self) -> tuple[Cell, ...]:
        """(row, column) of the switches that never read pressed: those that nobody touched, and dead ones. () where the
        board sends no cells."""
        return () if self.seen is None else places(self._present & ~self._seen)

    @property
    def stuck(self) -> tuple[Cell, ...]:
        """(row, column) of the switches that were reported as ``stuck`` and have not changed since."""
        return () if self._sheet is None else tuple(sorted(self._history.stuck))

    @property
    def fluttering(self) -> tuple[Cell, ...]:
        """(row, column) of the switches that were reported to ``flutter``."""
        return () if self._sheet is None else tuple(sorted(self._history.flutters))

    @property
    def mask(self) -> tuple[Cell, ...]:
        """The Skin's mask with the stuck switches added, for ``skin.replace(mask=watch.mask)``."""
        return tuple(sorted(self._mask.union(self.stuck)))

    @property
    def mask_line(self) -> str:
        """The same as the line of a Skin's TOML file; "" where no switch is stuck."""
        return f"mask = {json.dumps(self.mask)}" if self.stuck else ""
