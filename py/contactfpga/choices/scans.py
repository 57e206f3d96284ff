"""Scans: orders of driven rows."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any, Literal

from contactfpga.choices.choice import Bound, Choice
from contactfpga.choices.choice import find as find_choice
from contactfpga.errors import SkinError


@dataclasses.dataclass(frozen=True, kw_only=True)
class Scan(Choice):
    """A scan that drives rows and samples columns.

    ``gateware``: a component with the ports of :func:`contactfpga_hdl.scan.pins.scan_ports`; a scan that ``waits`` also
    has those of :class:`contactfpga_hdl.scan.reversal.ReversalScanner`. ``golden``: a
    :class:`contactfpga_sim.model.golden.scan.ScanRule`.
    """

    reads_rows: bool
    """Whether rows are released and read while columns are driven, by bidirectional pins."""
    waits: bool
    """Whether the scan waits until the next stage takes a row, and begins a frame only when the last is packed, so that
    no stage is too slow. With zones it passes on only driven rows, with their numbers. Times are then counted in us.
    Otherwise every row is sampled once per frame, all frames take the same time, and times are counted in frames."""
    check: Callable[[Any], None]
    """Raises SkinError if the scan cannot serve a Skin, such as one with ``guard`` if it checks no guard lines; called
    before anything is derived from the Skin."""
    max_frame_clocks: Bound
    """The most clocks of a frame, from first to last sample."""
    min_row_clocks: Bound
    """The least clocks of a row time with which later stages keep up; the scanner keeps its tag until the frame before
    is packed."""


def _check_reversal(skin: Any) -> None:
    if skin.row_drive != "direct":
        raise SkinError(
            f"row_drive is {skin.row_drive!r}; scan = 'reversal' needs row_drive = 'direct', as it reads the rows"
        )
    if not skin.precharge_us:
        raise SkinError("precharge_us is 0; scan = 'reversal' drives the columns, and needs a time for it")


def _reversal_frame_clocks(derived: Any) -> int:
    """Clocks of a frame with all rows touched, waiting for debounce, labeller and count, with the guard check."""
    handed = derived.debounce_clocks + 2 * (derived.label_row_clocks + derived.open_zones) + 16
    checked = max(derived.project_clocks, derived.row_clocks) + 1 if derived.skin.guard else 0
    clocks: int = derived.project_clocks + 4 + derived.skin.rows * (derived.row_clocks + handed) + checked
    return clocks


def _raster_min_row_clocks(derived: Any) -> int:
    packed = derived.packed_clocks + derived.items_clocks(derived.max_items)
    least: int = max(derived.skin.columns + 6, 10, derived.label_clocks + 1, math.ceil(packed / derived.skin.row_lines))
    return least


ScanName = Literal["raster", "reversal"]

SCANS: dict[str, Scan] = {
    scan.name: scan
    for scan in (
        Scan(
            name="raster",
            title="raster",
            gateware="contactfpga_hdl.scan.raster:Scanner",
            golden="contactfpga_sim.model.golden.raster:RASTER",
            reads_rows=False,
            waits=False,
            check=lambda skin: None,
            max_frame_clocks=lambda derived: derived.frame_clocks,
            min_row_clocks=_raster_min_row_clocks,
        ),
        Scan(
            name="reversal",
            title="reversal",
            gateware="contactfpga_hdl.scan.reversal:ReversalScanner",
            golden="contactfpga_sim.model.golden.reversal:REVERSAL",
            reads_rows=True,
            waits=True,
            check=_check_reversal,
            max_frame_clocks=_reversal_frame_clocks,
            min_row_clocks=lambda derived: 1,
        ),
    )
}


def find(value: object) -> Scan:
    if isinstance(value, str) and value == "adaptive":
        raise SkinError(
            "scan is 'adaptive', which no longer exists; use 'reversal' with precharge_us if the pins can drive and "
            "read both rows and columns, otherwise 'raster'"
        )
    return find_choice(Scan, SCANS, value)
