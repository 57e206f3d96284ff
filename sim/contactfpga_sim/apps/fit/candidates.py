"""Skins to try: every method, pitch and cover, on sheets of one size."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Sequence
from typing import Any

from contactfpga.choices.labellers import LABELLERS, Labeller
from contactfpga.choices.scans import SCANS
from contactfpga.design.cover import Cover
from contactfpga.skin import Skin, SkinError
from contactfpga_sim.apps import light
from contactfpga_sim.apps.fit.faces import BARE, Faces, Protection, refusal
from contactfpga_sim.apps.fit.sources import RecordingSource, Size, Source


def by(labeller: Labeller) -> list[dict[str, Any]]:
    """Methods of a labeller; connectivity matters to exact ones."""
    settings = {"labeller": labeller.name, "report": "moments"}
    return [settings | {"connectivity": c} for c in (8, 4)] if labeller.exact else [settings]


ON_HOST: dict[str, Any] = {"report": "cells"}

LEVELS: dict[str, Any] = ON_HOST | {"levels": 3, "connectivity": 4}
"""Three levels of light cells, from which the host finds the contacts."""

METHODS = (*(method for labeller in reversed(LABELLERS.values()) for method in by(labeller)), LEVELS)
"""Methods to try, the smallest first. On-board division costs more LUT4 and saves only microseconds per zone."""

COARSEST_MM, FINEST_MM = 32.0, 4.0
"""Range of pitches, by whole columns."""


SHEET = ("rows", "columns", "pitch_x_mm", "pitch_y_mm")


@dataclasses.dataclass(frozen=True)
class Candidate:
    """A Skin to try, or the reason for its refusal."""

    settings: tuple[tuple[str, Any], ...]
    """Differences from the requested Skin, sorted by name."""
    skin: Skin | None
    refusal: str = ""
    cover: Cover | None = None
    rank: tuple[int, ...] = ()
    """Order among sheets with as many wires: domes, light cells and several levels; then methods, scans and baud rates
    as asked."""

    @property
    def wires(self) -> int:
        """Rows and columns."""
        settings = dict(self.settings)
        return int(settings["rows"] + settings["columns"])

    @property
    def cost(self) -> tuple[int, ...]:
        return (self.wires, *self.rank)


def candidates(
    base: Skin,
    pitches_mm: Sequence[tuple[float, float]],
    size_mm: Size,
    methods: Sequence[dict[str, Any]] = METHODS,
    scans: Sequence[str] | None = None,
    bauds: Sequence[int] | None = None,
    covers: Faces = BARE,
    protection: Protection | None = None,
) -> list[Candidate]:
    """``base`` with each near pitch (x, y) that divides the sheet, cover, method, scan and baud rate. Default
    ``scans``: those that fit its columns. Raises ValueError if no cover keeps the limits of ``protection``."""
    if scans is None:
        scans = [name for name, scan in SCANS.items() if not scan.waits or base.precharge_us]
    found: dict[Any, Candidate] = {}
    hard: list[str] = []
    for pitch, cover in itertools.product(pitches_mm, covers):
        sheet = _sheet(pitch, size_mm)
        made = covers[cover](min(sheet["pitch_x_mm"], sheet["pitch_y_mm"]))
        named = {} if made is None else {"cover": cover}
        at = sheet["pitch_x_mm"], sheet["pitch_y_mm"]
        wide = refusal(made, at)
        if protection and not wide:
            wide = protection.refusal(made, at)
            hard.append(wide)
        ways = itertools.product(enumerate(methods), enumerate(scans), enumerate(bauds or (base.baud,)))
        for (rank, method), (scan_rank, scan), (baud_rank, baud) in ways:
            if "levels" in method and not (made and made.cell):
                continue
            settings = sheet | named | method | {"scan": scan, "baud": baud}
            one = _candidate(base, settings, made, wide)
            kind = bool(made and made.cell) + ("levels" in method)
            found[one.settings] = dataclasses.replace(one, rank=(kind, rank, scan_rank, baud_rank))
    if hard and all(hard):
        raise ValueError(
            f"no cover protects; the last one gives {hard[-1]}: take thicker foam with --foam-mm or a cover with a bed"
        )
    return list(found.values())


def _sheet(pitch_mm: tuple[float, float], size_mm: Size) -> dict[str, Any]:
    columns, rows = (max(1, round(size / pitch)) for size, pitch in zip(size_mm, pitch_mm, strict=True))
    return {
        "rows": rows,
        "columns": columns,
        "pitch_x_mm": size_mm[0] / columns,
        "pitch_y_mm": size_mm[1] / rows,
    }


def _candidate(base: Skin, settings: dict[str, Any], cover: Cover | None, wide: str) -> Candidate:
    key = tuple(sorted(settings.items()))
    if wide:
        return Candidate(key, None, f"Cover refuses: {wide}", cover)
    changes = {name: value for name, value in settings.items() if name not in ("cover", "levels")}
    if (base.rows, base.columns) != (settings["rows"], settings["columns"]):
        changes["mask"] = ()  # it tells switches of the other sheet
    try:
        skin = base.replace(**changes)
        if cover and cover.cell and not base.ruler:
            skin = light.with_cells(skin, cover, settings.get("levels", 1))
        return Candidate(key, skin, "", cover)
    except SkinError as error:
        return Candidate(key, None, f"Skin refuses: {error}", cover)


def size_for(base: Skin | None, sources: Sequence[Source]) -> Size:
    """Size of the sheet: the requested Skin's, else the sources', else the reference Skin's. Raises ValueError if
    two disagree."""
    asked = {one: size for one in sources if (size := one.size_mm())}
    if base is not None:
        asked = {one: size for one, size in asked.items() if isinstance(one, RecordingSource)}
    sizes = list(asked.values())
    given = base or Skin()
    size = (given.columns * given.pitch_x_mm, given.rows * given.pitch_y_mm)
    if base is not None or not sizes:
        sizes.insert(0, size)
    for other in sizes[1:]:
        if not all(math.isclose(one, two) for one, two in zip(sizes[0], other, strict=True)):
            raise ValueError(
                f"one sheet is {sizes[0][0]:g} x {sizes[0][1]:g} mm, another one {other[0]:g} x {other[1]:g} mm; "
                "a Skin is fitted to one sheet"
            )
    return sizes[0]


def pitches_for(base: Skin | None, sources: Sequence[Source], asked: Sequence[float] | None) -> list[Size]:
    """Pitches (x, y) in mm: those requested, else every whole number of columns from :data:`COARSEST_MM` to
    :data:`FINEST_MM` and the requested Skin's; a recording's own."""
    for pitch in asked or ():
        if not 0 < pitch < math.inf:
            raise ValueError(f"--pitch-mm is {pitch}; it must be above 0")
    recorded = [one.recording for one in sources if isinstance(one, RecordingSource)]
    if recorded:
        pitch = recorded[0].pitch_mm or Skin().pitch_x_mm
        if asked and list(asked) != [pitch]:
            raise ValueError(f"--pitch-mm is {asked}; a recording has one pitch, here {pitch:g} mm")
        return [(pitch, pitch)]
    if asked:
        return [(pitch, pitch) for pitch in asked]
    width, _ = size_for(base, sources)
    columns = range(max(1, math.ceil(width / COARSEST_MM)), max(1, math.floor(width / FINEST_MM)) + 1)
    own = [(base.pitch_x_mm, base.pitch_y_mm)] if base is not None else []
    return own + [(width / each, width / each) for each in columns]
