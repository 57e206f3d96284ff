"""Light fingers on foam over switches, for docs/cover.md: foam, faces and caps differ."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.patches import Rectangle

from contactfpga import picture_style as style
from contactfpga.design.cover import Cap, Cells, Cover, Ellipse, Load, NoSolution, Sheet, Switch, feel, medium
from contactfpga.design.cover.felt import LENGTH_M, WIDTH_M, Force
from contactfpga.design.cover.press import SHEAR
from contactfpga_sim.apps import covers
from contactfpga_sim.lab import writer

PITCHES_MM = (10.0, 6.4)
FORCES_N = (1.0, 0.4)
LINES = 16

PLACES = 1000

PROUD_MM = 0.5

FLUSH = 0.8


def _flush_face(pitch_mm: float, force_n: float) -> Cover:
    return Cover("foam", 5e-3, Switch(force_n))


def _flush_cap(pitch_mm: float, force_n: float) -> Cover:
    return Cover("foam", 5e-3, Switch(force_n), cap=Cap(FLUSH * pitch_mm * 1e-3, proud=False))


def _button(pitch_mm: float, force_n: float) -> Cover:
    return Cover("foam", 5e-3, Switch(force_n), cap=Cap(4e-3))


def _caps(pitch_mm: float, force_n: float) -> Cover:
    return covers.capped(pitch_mm, _dome(force_n))


def _tiles(pitch_mm: float, force_n: float) -> Cover:
    return covers.tiled(pitch_mm, _dome(force_n))


def _dome(force_n: float) -> Switch:
    return Switch(force_n, travel_m=covers.DOME.travel_m)


KINDS = {
    "flush face of 12.6 mm², 5 mm of foam (the paper)": _flush_face,
    f"flush cap, {FLUSH:g} of the pitch, 5 mm": _flush_cap,
    "proud button of 4 mm, rigid, 5 mm": _button,
    f"proud caps, gaps of {covers.GAP_MM:g} mm, whole foam of {1e3 * covers.FOAM_M:g} mm": _caps,
    f"tiles: the same, foam cut, {1e3 * covers.FOAM_M:g} mm": _tiles,
}


def felt_table() -> writer.Table:
    head = ["pitch", "what the foam presses", "one switch takes, least"]
    head += [f"{force:g} N switch: {what}" for force in FORCES_N for what in ("50 %", "99 %", "worst")]
    rows = [_row(pitch, name) for pitch, name in itertools.product(PITCHES_MM, KINDS)]
    columns = [name for name in head if not name.endswith(("least", "worst"))]
    paper, *_, caps, tiles = KINDS
    fine = f"{PITCHES_MM[-1]:g} mm"
    return writer.Table(
        head, rows, lambda row: row[1] == paper or (row[0] == fine and row[1] in (caps, tiles)), columns
    )


def felt_sample() -> str:
    return writer.line(_row(PITCHES_MM[-1], list(KINDS)[-1]))


def _row(pitch_mm: float, name: str) -> list[str]:
    sheet = Sheet(LINES, LINES, pitch_mm * 1e-3, pitch_mm * 1e-3)
    found = [feel(KINDS[name](pitch_mm, force), sheet, places=PLACES) for force in FORCES_N]
    forces = [_newtons(one) for each in found for one in (each.half, each.most, each.worst)]
    return [f"{pitch_mm:g} mm", name, f"{100 * found[0].least_share:.1f} %", *forces]


def _newtons(force: Force | NoSolution) -> str:
    return "none" if isinstance(force, NoSolution) else f"{force.value_n:.2g} N"


# ---- foam that sags between proud caps


def sagging_n(cover: Cover, pitch_m: float, proud_m: float = PROUD_MM * 1e-3) -> float:
    """Force in N of the finger at which foam sags by ``proud_m`` midway between two caps.

    A strip clamped at both caps (Timoshenko) under the finger's mean pressure: w/p = 6/5 g^2/(8 G h) + (1 - nu^2)
    g^4/(32 E h^3).
    """
    gap, thick = pitch_m - cover.side_m, cover.thickness_m
    shear = cover.modulus_pa / (2 * (1 + medium.POISSON))
    plate = cover.modulus_pa / (1 - medium.POISSON**2)
    per_pascal = SHEAR * gap**2 / (8 * shear * thick) + gap**4 / (32 * plate * thick**3)
    return proud_m / per_pascal * math.pi / 4 * LENGTH_M * WIDTH_M


def sagging_table() -> str:
    rows = [["pitch", "caps", "foam", f"sags by {PROUD_MM:g} mm from"]]
    for pitch, kind in itertools.product(PITCHES_MM, (_button, _caps)):
        cover = kind(pitch, 1.0)
        force = sagging_n(cover, pitch * 1e-3)
        sides = f"{1e3 * cover.side_m:.1f} mm", f"{1e3 * cover.thickness_m:g} mm"
        rows.append([f"{pitch:g} mm", *sides, f"{float(f'{force:.2g}'):g} N"])
    return writer.table_of(rows)


# ---- the picture

_LOOKS = dict(
    zip(KINDS, zip((style.VERMILLION, style.ORANGE, style.PURPLE, style.GREEN, style.BLUE), style.DASHES * 2))
)
_SHORT = ("flush face", "flush cap", "proud button", "proud caps, whole foam", "tiles: foam cut")


def draw(path: Path) -> Path:
    with matplotlib.rc_context(style.SETTINGS):
        figure = style.new(4.4)
        left, right = figure.subplots(1, 2, width_ratios=(1, 1.5))
        _sections(left)
        _diagonal(right)
        return style.save(figure, path)


def _sections(place: Any) -> None:
    for number, (name, proud, cut) in enumerate(
        (
            ("flush: the base carries most", False, False),
            ("proud: the caps carry all", True, False),
            ("cut: each its own", True, True),
        )
    ):
        _section(place, -14.0 * number, name, proud, cut)
    place.set(xlim=(-0.5, 30.5), ylim=(-32, 11), xticks=[], yticks=[])
    place.spines[["left", "bottom"]].set_visible(False)
    place.set_title("what lies on the switches", loc="left")


def _section(place: Any, at: float, name: str, proud: bool, cut: bool) -> None:
    def block(x: float, y: float, wide: float, high: float, color: str) -> None:
        place.add_patch(Rectangle((x, at + y), wide, high, fc=color, ec=style.CARD, lw=1))

    block(0, -4, 30, 1.2, style.SOFT)
    for middle in (5, 15, 25):
        block(middle - 1.2, -2.8, 2.4, 1.8, style.VERMILLION)
        block(middle - (4.6 if proud else 2.2), -1, 9.2 if proud else 4.4, 1, style.INK)
        if cut:
            block(middle - 4.6, 0, 9.2, 3, style.PRESSED)
    if not cut:
        block(0, 0, 30, 3, style.PRESSED)
    if not proud:
        for x, wide in ((0, 2.8), (7.2, 5.6), (17.2, 5.6), (27.2, 2.8)):
            block(x, -2.8, wide, 2.8, style.GRID)
    place.text(0, at + 4.2, name, fontsize=style.SMALL, va="bottom")


def _diagonal(place: Any) -> None:
    pitch_mm, far = PITCHES_MM[0], math.sqrt(2) * PITCHES_MM[0]
    along = np.linspace(0, far, 61)
    for (name, kind), short in zip(KINDS.items(), _SHORT, strict=True):
        color, dashes = _LOOKS[name]
        forces = list(_felt_along(kind(pitch_mm, 1.0), pitch_mm, along))
        place.plot(along, forces, color=color, linestyle=dashes, lw=1.8, label=short)
    place.set(yscale="log", xlim=(0, far), ylim=(0.8, 80))
    ticks = (1, 2, 5, 10, 20, 50)
    place.set_yticks(ticks, [f"{tick}" for tick in ticks])
    place.minorticks_off()
    place.set_xticks([0, far / 2, far], ["on a switch", "between four", "on the next"])
    for label, side in zip(place.get_xticklabels(), ("left", "center", "right"), strict=True):
        label.set_horizontalalignment(side)
    place.grid(axis="y")
    place.set_ylabel("force from which a finger is felt, N")
    place.set_title("switches of 1 N, 10 mm apart", loc="left")
    place.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=2)


def _felt_along(cover: Cover, pitch_mm: float, along_mm: np.ndarray) -> Iterator[float]:
    cells = Cells(cover, 10, 10, pitch_mm * 1e-3, pitch_mm * 1e-3)
    for away in along_mm:
        place = 4 * pitch_mm * 1e-3 + away * 1e-3 / math.sqrt(2)
        finger = Ellipse(LENGTH_M / 2, WIDTH_M / 2, place, place, math.pi / 4)
        yield cover.switch.force_n / float(cells.forces_n([Load((finger,), 1.0)]).max())
