"""The methods and settings that the chart compares, all on sheets of one extent."""

from __future__ import annotations

from typing import Any

from contactfpga.choices.labellers import LABELLERS, Labeller
from contactfpga.skin import Skin

EXTENT_MM = 160.0
"""Width and height of every sheet."""

PITCHES_MM = (5.0, 10.0, 20.0)


def sheet(pitch_mm: float, **settings: Any) -> Skin:
    """A square sheet of :data:`EXTENT_MM` with switches ``pitch_mm`` apart."""
    lines = round(EXTENT_MM / pitch_mm)
    return Skin(rows=lines, columns=lines, pitch_x_mm=pitch_mm, pitch_y_mm=pitch_mm, **settings)


def by(labeller: Labeller) -> dict[str, Skin]:
    """A labeller at every pitch."""
    return {f"{labeller.title}, {pitch:g} mm": sheet(pitch, labeller=labeller) for pitch in PITCHES_MM}


def _methods() -> dict[str, Skin]:
    fast: dict[str, Any] = {
        "scan": "reversal", "precharge_us": 0.25, "release_us": 0.05, "send": "on_change",
        "clock_hz": 24_000_000, "baud": 12_000_000,
    }  # fmt: skip
    methods = {
        "reversal, 10 mm": sheet(10.0, settle_us=0.5, **fast),
        "reversal, 5 mm": sheet(5.0, settle_us=0.8, project_us=2.5, **fast),
    }
    for pitch in PITCHES_MM:
        for labeller in LABELLERS.values():
            methods[f"{labeller.title}, {pitch:g} mm"] = sheet(pitch, labeller=labeller)
        methods[f"cells, {pitch:g} mm"] = sheet(pitch, report="cells")
    for pitch, bits in ((5.0, 4), (10.0, 4), (10.0, 1)):
        name = f"barycenter, {pitch:g} mm" + (f", {bits} bit" if bits == 1 else "")
        methods[name] = sheet(pitch, report="barycenter", barycenter_bits=bits)
    for pitch in (10.0, 20.0):
        methods[f"adaptive, {pitch:g} mm"] = sheet(pitch, scan="adaptive")
    methods["adaptive, 5 mm, 24 MHz"] = sheet(5.0, scan="adaptive", clock_hz=24_000_000)
    methods["run, 10 mm, 4-connected"] = sheet(10.0, connectivity=4)
    methods["run, 10 mm, 1 Mbaud"] = sheet(10.0, baud=1_000_000)
    methods["run, 10 mm, debounced 0.5 ms"] = sheet(
        10.0, debounce="sym_defer_pk", debounce_press_us=500.0, debounce_release_us=500.0
    )
    return methods


METHODS: dict[str, Skin] = _methods()
"""By name; each one has gateware, and its time comes from the golden model of that gateware."""
