"""Contacts that move faster than the scan follows, told from two frames."""

from __future__ import annotations

import numpy as np

from contactfpga.skin.sheet import Sheet
from contactfpga.wire.protocol import Frame

LIMIT = 1.0
"""Pitches from one scan to the next that are told: the rows of a frame are sampled one after the other, so that a zone
may be off by about as much as its contact moves meanwhile."""

_SEQUENCES = 256


def adjacent(frame: Frame, before: Frame) -> bool:
    """Whether no frame was lost or overwritten between these two. With ``send = "on_change"`` the first one holds until
    the scan before the second."""
    return (frame.sequence - before.sequence) % _SEQUENCES == 1 and frame.overwritten == before.overwritten


def moved(records: np.ndarray, earlier: np.ndarray, sheet: Sheet) -> bool:
    """Whether a zone lies farther than :data:`LIMIT` pitches from each zone of an adjacent frame that has as many.

    Both as :attr:`contactfpga.Zones.records`.
    """
    if len(records) != len(earlier) or np.array_equal(records, earlier):
        return False
    old = _places(earlier, sheet)
    columns = sheet.columns if sheet.closed else None
    return any(
        all(_across(x - a, columns) ** 2 + (y - b) ** 2 > LIMIT**2 for a, b in old) for x, y in _places(records, sheet)
    )


def _across(distance: float, columns: int | None) -> float:
    """Where the ends of the sheet meet the shorter way."""
    return distance if columns is None else (distance + columns / 2) % columns - columns / 2


def _places(records: np.ndarray, sheet: Sheet) -> list[tuple[float, float]]:
    """x and y in pitches of the zones that lie somewhere."""
    steps = 1 << sheet.barycenter_bits if sheet.report == "barycenter" else None
    return [(x / (steps or area), y / (steps or area)) for area, x, y in records.tolist() if area]
