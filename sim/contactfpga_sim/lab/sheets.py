"""Sheets shared by studies and pages."""

from __future__ import annotations

import contextlib
import math

from contactfpga.skin import Skin, SkinError


def adaptive_skin(rows: int, columns: int) -> Skin:
    """A sheet with 5 us settle, 1 us release and the slowest clock of its adaptive scan."""
    zones = min(64, math.ceil(rows / 2) * math.ceil(columns / 2))
    for megahertz in (12, 24, 36, 48):
        with contextlib.suppress(SkinError):
            return Skin(
                rows=rows, columns=columns, scan="adaptive", zone_capacity=zones, clock_hz=megahertz * 1_000_000
            )
    raise AssertionError("no clock is fast enough")
