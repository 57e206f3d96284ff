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

    ``gateware``: a component with the ports of :func:`contactfpga_hdl.scan.pins.scan_ports`; a scan that is not
    ``even`` also has those of :class:`contactfpga_hdl.scan.adaptive.AdaptiveScanner`. ``golden``: a
    :class:`contactfpga_sim.model.golden.scan.ScanRule`.
    """

    even: bool
    """Whether every row is sampled once per frame and all frames take the same time. Otherwise times are counted in row
    times, whose number each frame reports, or in us if the scan ``waits``."""
    reads_rows: bool
    """Whether rows are released and read while columns are driven, by bidirectional pins."""
    waits: bool
    """Whether the scan waits until the next stage takes a row, and begins a frame only when the last is packed, so that
    no stage is too slow. With zones it passes on only driven rows, with their numbers."""
    guards: bool = False
    moves_sample: bool = False
    """Whether the scan obeys the command "sample at", by the ports of
    :func:`contactfpga_hdl.scan.pins.sample_at_ports`."""
    check: Callable[[Any], None]
    """Raises SkinError if the scan cannot serve a Skin; called before anything is derived from the Skin."""
    choice_clocks: Bound
    """Clocks from a strobe until the next rows are known; 0 if known beforehand."""
    max_frame_slots: Bound
    max_frame_clocks: Bound
    """The most clocks of a frame, from first to last sample."""
    min_row_clocks: Bound
    """The least clocks of a row time with which later stages keep up; the scanner keeps its tag until the frame before
    is packed."""


def _check_adaptive(skin: Any) -> None:
    if skin.rows < 2:
        raise SkinError(f"rows is {skin.rows}; scan = 'adaptive' needs at least 2")
    if skin.column_read != "direct":
        raise SkinError(
            f"column_read is {skin.column_read!r}; scan = 'adaptive' needs column_read = 'direct', as it looks at "
            "the columns of an untouched sheet in each clock"
        )
    if skin.precharge_us:
        raise SkinError(
            f"precharge_us is {skin.precharge_us}; scan = 'adaptive' keeps rows driven and cannot drive the columns, "
            "scan = 'reversal' can"
        )


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


def _adaptive_min_row_clocks(derived: Any) -> int:
    rows = derived.skin.rows
    handed = derived.debounce_clocks + 2 * derived.label_row_clocks + rows * derived.label_empty_row_clocks + 8
    least: int = max(handed, *(_adaptive_packing_clocks(derived, pressed) for pressed in range(rows + 1)))
    return least


def _adaptive_packing_clocks(derived: Any, pressed: int) -> int:
    skin = derived.skin
    if not derived.report.zones:
        items = skin.rows
    elif skin.connectivity == 8:
        items = min(pressed, math.ceil(skin.rows / 2)) * math.ceil(skin.columns / 2)
    else:
        items = math.ceil(pressed * skin.columns / 2)
    clocks = derived.packed_clocks + skin.rows + derived.items_clocks(min(items, derived.max_items))
    least: int = math.ceil(clocks / min(pressed + 1, skin.rows))
    return least


ScanName = Literal["raster", "adaptive", "reversal"]

SCANS: dict[str, Scan] = {
    scan.name: scan
    for scan in (
        Scan(
            name="raster",
            title="raster",
            gateware="contactfpga_hdl.scan.raster:Scanner",
            golden="contactfpga_sim.model.golden.raster:RASTER",
            even=True,
            reads_rows=False,
            waits=False,
            guards=True,
            moves_sample=True,
            check=lambda skin: None,
            choice_clocks=lambda derived: 0,
            max_frame_slots=lambda derived: derived.skin.row_lines,
            max_frame_clocks=lambda derived: derived.frame_clocks,
            min_row_clocks=_raster_min_row_clocks,
        ),
        Scan(
            name="adaptive",
            title="adaptive",
            gateware="contactfpga_hdl.scan.adaptive:AdaptiveScanner",
            golden="contactfpga_sim.model.golden.adaptive:ADAPTIVE",
            even=False,
            reads_rows=False,
            waits=False,
            check=_check_adaptive,
            choice_clocks=lambda derived: max(derived.row_levels, 2) + 4,
            max_frame_slots=lambda derived: derived.skin.rows + 2 * derived.row_levels + 2,
            max_frame_clocks=lambda derived: derived.max_frame_slots * derived.row_clocks,
            min_row_clocks=_adaptive_min_row_clocks,
        ),
        Scan(
            name="reversal",
            title="reversal",
            gateware="contactfpga_hdl.scan.reversal:ReversalScanner",
            golden="contactfpga_sim.model.golden.reversal:REVERSAL",
            even=False,
            reads_rows=True,
            waits=True,
            guards=True,
            moves_sample=True,
            check=_check_reversal,
            choice_clocks=lambda derived: 0,
            max_frame_slots=lambda derived: math.ceil(derived.max_frame_clocks / derived.row_clocks),
            max_frame_clocks=_reversal_frame_clocks,
            min_row_clocks=lambda derived: 1,
        ),
    )
}


def find(value: object) -> Scan:
    return find_choice(Scan, SCANS, value)
