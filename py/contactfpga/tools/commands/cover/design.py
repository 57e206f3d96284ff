"""The command `contactfpga cover design`."""

from __future__ import annotations

import argparse
import math
from typing import Any

from contactfpga.design.cover.answer import NoSolution
from contactfpga.design.cover.design import Design, FoamDesign, Thin, design, margin
from contactfpga.design.cover.region import RegionLimits
from contactfpga.design.cover.sense import Sense
from contactfpga.design.cover.task import Task
from contactfpga.errors import UNSOLVED
from contactfpga.tools.commands.cover import KPA, MM, notes
from contactfpga.tools.console import flags, results

EXTRA = "sim"

HEADS = ("foam", "E kPa", "pressed mm", "for ms", "peak N", "thick mm", "kg/m2", "least N", "pitch mm", "binds")
REGION_HEADS = (
    "body region",
    "free N",
    "free m/s",
    "clamped N",
    "clamped m/s",
    "reaction ms",
    "both m/s",
    "binds",
)
THIN_HEADS = (
    "reaction after ms",
    "E kPa",
    "pressed mm",
    "peak N",
    "same foam by (8) mm",
    "by then mm",
    "stopped at mm",
)


def add_flags(flag: flags.Flags) -> None:
    flag("FILE.toml", "Arm, impact, switch and limits; see examples/.")
    flags.json(flag, flags.SI)


def run(args: argparse.Namespace) -> int:
    found = design(Task.load(args.file))
    results.show(args, _plain(found), lambda: _show(found))
    return 0 if found.best else UNSOLVED


def _show(found: Design) -> None:
    columns([HEADS, *(_row(one) for one in found.candidates)])
    print()
    first = found.candidates[0]
    if found.best:
        assert first.thickness_m is not None
        assert first.pitch_m is not None
        assert first.binding is not None
        force = first.sure.value if first.sure else None
        results.table(
            ("fits", first.foam.name),
            ("thickness", f"{MM * first.thickness_m:.4g} mm"),
            ("pitch", f"{MM * first.pitch_m:.4g} mm"),
            ("force felt everywhere", f"{force:.4g} N" if isinstance(force, float) else "none"),
            ("closest limit", f"{first.binding.name}, {margin(first.binding)}"),
            ("model of sensitivity", str(first.least.model) if first.least else ""),
        )
    else:
        print(f"nothing fits; nearest is {first.foam.name}. It would take:")
        for one in found.relax:
            print(f"  {one}")
    notes(first.notes)
    if first.regions:
        print()
        columns([REGION_HEADS, *map(region_row, first.regions)])
    print()
    columns([THIN_HEADS, *(_thin_row(one) for one in found.thinning)])
    print(f"the sheet itself: {MM * found.sheet_s:.4g} ms at worst from touch to last byte")


def _row(one: FoamDesign) -> tuple[str, ...]:
    hit, bound = one.hit, one.binding
    return (
        one.foam.name,
        f"{KPA * one.foam.modulus_pa:.4g}" if hit else "",
        f"{MM * hit.compression_m:.4g}" if hit else "",
        f"{MM * hit.time_s:.4g}" if hit else "",
        f"{hit.force_n:.4g}" if hit else "",
        f"{MM * one.thickness_m:.4g}" if one.thickness_m else "",
        f"{one.mass_kg_m2:.4g}" if one.mass_kg_m2 else "",
        f"{one.least.value:.4g}" if one.least and isinstance(one.least.value, float) else "",
        f"{MM * one.pitch_m:.4g}" if one.pitch_m else "",
        one.no_solution or (f"{bound.name}, {margin(bound)}" if bound else ""),
    )


def region_row(one: RegionLimits) -> tuple[str, ...]:
    reaction = "any" if math.isinf(one.reaction_s) else f"{MM * one.reaction_s:.4g}" if one.reaction_s else "none"
    clamped = "none" if isinstance(one.clamped_m_s, NoSolution) else f"{one.clamped_m_s:.4g}"
    return (
        one.region.name,
        f"{one.transient_n:.4g}",
        f"{one.transient_m_s:.4g}",
        f"{one.quasistatic_n:.4g}",
        clamped,
        reaction,
        f"{one.speed_m_s:.4g}",
        one.binding,
    )


def region_plain(one: RegionLimits) -> dict[str, Any]:
    """A body region for JSON; null: no such speed, or any reaction time."""
    return {
        "region": one.region.name,
        "transient_n": one.transient_n,
        "transient_m_s": one.transient_m_s,
        "quasistatic_n": one.quasistatic_n,
        "clamped_m_s": None if isinstance(one.clamped_m_s, NoSolution) else one.clamped_m_s,
        "reaction_s": None if math.isinf(one.reaction_s) else one.reaction_s,
        "speed_m_s": one.speed_m_s,
        "binding": one.binding,
    }


def _thin_row(one: Thin) -> tuple[str, ...]:
    def cell(value: float | None, scale: float) -> str:
        return "" if value is None else f"{scale * value:.4g}"

    return (
        cell(one.latency_s, MM),
        cell(one.modulus_pa, KPA),
        cell(one.compression_m, MM),
        cell(one.force_n, 1),
        cell(one.by_energy_m, MM),
        cell(one.pressed_m, MM),
        cell(one.stopped_m, MM),
    )


def columns(rows: list[tuple[str, ...]]) -> None:
    wide = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    for row in rows:
        print("  ".join(f"{cell:<{w}}" if not i else f"{cell:>{w}}" for i, (cell, w) in enumerate(zip(row, wide))))


def _plain(found: Design) -> dict[str, Any]:
    return {
        "fits": found.best is not None,
        "best": None if found.best is None else _candidate(found.best),
        "relax": found.relax,
        "candidates": [_candidate(one) for one in found.candidates],
        "thinning": found.thinning,
        "sheet_s": found.sheet_s,
    }


def _candidate(one: FoamDesign) -> dict[str, Any]:
    hit, bound = one.hit, one.binding
    return {
        "foam": one.foam.name,
        "source": one.foam.source,
        "modulus_pa": one.foam.modulus_pa if hit else None,
        "density_kg_m3": one.foam.density_kg_m3,
        "compression_m": hit.compression_m if hit else None,
        "time_s": hit.time_s if hit else None,
        "peak_n": hit.force_n if hit else None,
        "by_energy_m": one.by_energy_m,
        "thickness_m": one.thickness_m,
        "mass_kg_m2": one.mass_kg_m2,
        "least_force_n": _number(one.least),
        "pitch_m": one.pitch_m,
        "force_n": _number(one.sure),
        "model": str(one.least.model) if one.least else None,
        "fits": one.fits,
        "binding": bound.name if bound else None,
        "regions": [region_plain(region) for region in one.regions],
        "checks": [
            {"name": check.name, "value": check.value, "limit": check.limit, "used": check.used, "holds": check.holds}
            for check in one.checks
        ],
        "no_solution": one.no_solution,
        "notes": one.notes,
    }


def _number(sensed: Sense | None) -> float | None:
    return None if sensed is None or isinstance(sensed.value, NoSolution) else sensed.value
