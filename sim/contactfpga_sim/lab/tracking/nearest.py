"""The baseline: each zone takes the id of the nearest zone of the frame before, the closest pairs first."""

from __future__ import annotations

import math

from contactfpga.zones.zone import Zones


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
