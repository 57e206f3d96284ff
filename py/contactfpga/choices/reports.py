"""Reports: the content of frames. Each is a kind of packet in docs/protocol.md, so the set is closed."""

from __future__ import annotations

import dataclasses
from typing import Literal


@dataclasses.dataclass(frozen=True, kw_only=True)
class Report:
    """The content of a frame, and where it is computed."""

    name: str
    """Name in a Skin."""
    title: str
    """Its label in charts and tables."""
    kind: int
    """Kind of its packets."""
    code: int
    """Code in a hello."""
    zones: bool
    """Whether the board finds zones; otherwise a frame has the plain rows."""
    divided: bool
    """Whether the board divides: zones have barycenters."""


ReportName = Literal["moments", "barycenter", "cells"]

REPORTS: dict[str, Report] = {
    report.name: report
    for report in (
        Report(name="moments", title="moments", kind=5, code=0, zones=True, divided=False),
        Report(name="barycenter", title="barycenter", kind=7, code=2, zones=True, divided=True),
        Report(name="cells", title="cells", kind=6, code=1, zones=False, divided=False),
    )
}
"""All reports by name."""
