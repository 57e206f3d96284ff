"""Contacts that move too fast for the scan, detected from two frames."""

from __future__ import annotations

import numpy as np

from contactfpga.skin.sheet import Sheet
from contactfpga.wire.protocol import Frame
from contactfpga.zones import around

LIMIT = 1.0
"""Least reported motion in pitches per scan. Rows are sampled in turn, so a zone may be off by about the motion of its
contact during a scan."""

_SEQUENCES = 256

Places = list[tuple[float, float]]


def adjacent(frame: Frame, before: Frame) -> bool:
    """Whether no frame was lost or overwritten between two frames. With ``send = "on_change"`` the first frame holds
    until the scan before the second."""
    return (frame.sequence - before.sequence) % _SEQUENCES == 1 and frame.overwritten == before.overwritten


def moved(records: np.ndarray, earlier: np.ndarray, sheet: Sheet) -> bool:
    """Whether a zone is more than :data:`LIMIT` pitches from each zone of an adjacent frame with as many.

    Records are :attr:`contactfpga.Zones.records`, or :attr:`contactfpga.Zones.closed_records` of a sheet whose ends
    meet, where zones without an x are compared by y, only with each other.
    """
    if len(records) != len(earlier) or np.array_equal(records, earlier):
        return False
    if not sheet.closed:
        return _far(_places(records, sheet), _places(earlier, sheet))
    here, there = (_around(each, sheet) for each in (records, earlier))
    return len(here[1]) == len(there[1]) and any(_far(*each, sheet.columns) for each in zip(here, there))


def _far(places: Places, old: Places, columns: int | None = None) -> bool:
    return any(all(around.across(x - a, columns) ** 2 + (y - b) ** 2 > LIMIT**2 for a, b in old) for x, y in places)


def _around(records: np.ndarray, sheet: Sheet) -> tuple[Places, Places]:
    """Places of zones with an x, and of zones without one, with x = 0."""
    winds = around.windings(records) > 0
    flat = around.flat(records, sheet.columns)
    return _places(flat[~winds], sheet), [(0.0, y) for _, y in _places(flat[winds], sheet)]


def _places(records: np.ndarray, sheet: Sheet) -> Places:
    steps = 1 << sheet.barycenter_bits if sheet.report == "barycenter" else None
    return [(x / (steps or area), y / (steps or area)) for area, x, y in records.tolist() if area]
