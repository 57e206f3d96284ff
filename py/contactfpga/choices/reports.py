"""Reports: contents of frames; each has a packet kind in docs/protocol.md, so users cannot add one."""

from __future__ import annotations

import dataclasses
from typing import Literal


@dataclasses.dataclass(frozen=True, kw_only=True)
class Report:
    name: str
    title: str
    kind: int
    code: int
    zones: bool
    """Whether the board finds zones; otherwise it sends a bitmap."""
    divided: bool
    """Whether the board divides, so that zones have barycenters."""


ReportName = Literal["moments", "barycenter", "cells"]

REPORTS: dict[str, Report] = {
    report.name: report
    for report in (
        Report(name="moments", title="moments", kind=5, code=0, zones=True, divided=False),
        Report(name="barycenter", title="barycenter", kind=7, code=2, zones=True, divided=True),
        Report(name="cells", title="cells", kind=6, code=1, zones=False, divided=False),
    )
}
