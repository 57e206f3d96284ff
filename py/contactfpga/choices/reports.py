"""Reports: what a frame carries. Each is a kind of packet in docs/protocol.md, so the set is closed."""

from __future__ import annotations

import dataclasses
from typing import Literal


@dataclasses.dataclass(frozen=True, kw_only=True)
class Report:
    """What a frame carries, and where it is made."""

    name: str
    """What a Skin calls it."""
    title: str
    """Its label in charts and tables."""
    kind: int
    """Of its packets."""
    code: int
    """In a hello."""
    zones: bool
    """The board finds zones. Otherwise a frame carries the rows as they are."""
    divided: bool
    """The board divides: zones carry barycenters."""


ReportName = Literal["moments", "barycenter", "cells"]

REPORTS: dict[str, Report] = {
    report.name: report
    for report in (
        Report(name="moments", title="moments", kind=5, code=0, zones=True, divided=False),
        Report(name="barycenter", title="barycenter", kind=7, code=2, zones=True, divided=True),
        Report(name="cells", title="cells", kind=6, code=1, zones=False, divided=False),
    )
}
"""All of them, by name."""
