"""Areas and sums of a frame's zones, as they came or from its cells."""

from __future__ import annotations

import numpy as np

from contactfpga.skin.sheet import Sheet
from contactfpga.wire.protocol import Frame
from contactfpga.zones import around, labels


def records_of(frame: Frame, sheet: Sheet) -> np.ndarray:
    """(n, 3) int64: area and sums, or barycenters, of each zone of a frame, in no particular order."""
    if sheet.closed:
        return around.flat(closed_records(frame, sheet), sheet.columns)
    if frame.bitmap is not None:
        return labels.moments(labels.label(frame.bitmap, sheet.connectivity))
    return frame.moments if frame.barycenters is None else frame.barycenters


def closed_records(frame: Frame, sheet: Sheet) -> np.ndarray:
    """(n, 4) int64: as they came, of a sheet whose ends meet."""
    return frame.moments if frame.bitmap is None else around.label(frame.bitmap, sheet.connectivity)[1]
