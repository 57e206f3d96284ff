"""The picture in docs/scenes.md, hand-written: equal scenes make equal files."""

from __future__ import annotations

import dataclasses
import html
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from contactfpga import picture_style as style
from contactfpga.design.cover import Cover, Ellipse, Part, Switch
from contactfpga.inputs.files import write_text
from contactfpga.skin import Skin
from contactfpga_sim.model.scenes import contacts
from contactfpga_sim.model.scenes.families import placements
from contactfpga_sim.model.scenes.scene import Scene, sheet

ACROSS = 4
PANEL, MARGIN, LINE, FOOT = 160, 16, 16, 24

HEAD = 4 * LINE
OUTLINE = style.VERMILLION
SCALES_MM = (10, 20, 50, 100)


@dataclasses.dataclass(frozen=True)
class Panel:
    """A scene at time 0 on a sheet, under a cover."""

    title: str
    detail: str
    scene: Scene
    skin: Skin
    cover: Cover


def panels() -> list[Panel]:
    """Some families' scenes with pressed switches; two fingers as they press every kind of cover."""
    hand, foot = (_square(size, pitch) for size, pitch in ((32, 5.0), (64, 5.0)))
    drawn = [
        Panel(name, f"pitch {skin.pitch_x_mm:g} mm", placements(name, 1, seed, skin)[0], skin, Cover())
        for name, skin, seed in (("fingers", hand, 6), ("palm", hand, 0), ("sole", foot, 3), ("edge", hand, 4))
    ]
    close = _square(18, 2.5)
    pair = Scene(contacts.pair(7.0, 6.0, 21.0, 21.5, 30.0, force_n=15.0))
    switch = Switch(0.32, 4e-6)  # closes at the stress of the paper's, whose face is wider than this pitch
    names = {"patch": "patch", "point": "point force", "foam": "foam, 5 mm"}
    return drawn + [
        Panel(text, "15 N each, pitch 2.5 mm", pair, close, Cover(model, switch=switch))
        for model, text in names.items()
    ]


def _square(size: int, pitch_mm: float) -> Skin:
    return Skin(rows=size, columns=size, pitch_x_mm=pitch_mm, pitch_y_mm=pitch_mm, settle_us=20.0)


def svg(drawn: Sequence[Panel]) -> str:
    down, step = -(-len(drawn) // ACROSS), HEAD + PANEL + FOOT + MARGIN
    width, height = style.WIDTH_PX, down * step + MARGIN
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        f'font-family="system-ui,sans-serif" font-size="12" fill="{style.INK}">',
        f'<rect width="{width}" height="{height}" rx="8" fill="{style.CARD}"/>',
    ]
    for index, panel in enumerate(drawn):
        x = MARGIN + index % ACROSS * (PANEL + MARGIN)
        y = MARGIN + HEAD + index // ACROSS * step
        lines += [f'<g transform="translate({x} {y})">', *_panel(panel), "</g>"]
    return style.for_dark_pages("\n".join([*lines, "</svg>"]) + "\n")


def _panel(panel: Panel) -> list[str]:
    scene = panel.scene.on_cover(panel.skin, panel.cover)
    truth = scene.truth(0.0, panel.skin)
    cells = panel.scene.pressed(0.0, panel.skin, panel.cover)
    left, right, top, bottom = (end / contacts.M for end in sheet(panel.skin))
    scale = PANEL / max(right - left, bottom - top)
    noun = "contact" if truth.count == 1 else "contacts"
    told = (panel.detail, f"{truth.count} {noun}, {truth.area_mm2:,.0f} mm²", f"{int(cells.sum())} switches closed")
    clip = f'<svg width="{PANEL}" height="{PANEL}" viewBox="0 0 {PANEL} {PANEL}">'
    wide, high = panel.skin.pitch_x_mm * scale, panel.skin.pitch_y_mm * scale
    gap = 0.08 * min(wide, high)
    square = f"h{wide - 2 * gap:.2f}v{high - 2 * gap:.2f}h-{wide - 2 * gap:.2f}z"
    squares = "".join(
        f"M{column * wide + gap:.2f} {row * high + gap:.2f}{square}"
        for row, column in zip(*(indices.tolist() for indices in np.nonzero(cells)))
    )
    crosses = [
        f'<path d="M{(one.x_mm - left) * scale - 5:.2f} {(one.y_mm - top) * scale:.2f}h10m-5-5v10" '
        f'stroke="{OUTLINE}" stroke-width="1.5"/>'
        for one in truth.contacts
    ]
    parts = [part for load in scene.loads(0.0) for part in load.parts]
    return [
        f'<text y="{LINE - 6 - HEAD}" font-weight="600">{html.escape(panel.title)}</text>',
        *(f'<text y="{(number + 2) * LINE - 6 - HEAD}">{line}</text>' for number, line in enumerate(told)),
        clip,
        f'<rect width="{(right - left) * scale:.2f}" height="{(bottom - top) * scale:.2f}" fill="{style.SHEET}"/>',
        f'<path d="{squares}" fill="{style.PRESSED}"/>',
        *(_outline(part, left, top, scale) for part in parts),
        *crosses,
        "</svg>",
        *_scale(right - left, scale),
    ]


def _scale(sheet_mm: float, scale: float) -> list[str]:
    long_mm = max((one for one in SCALES_MM if one <= 0.4 * sheet_mm), default=SCALES_MM[0])
    wide = long_mm * scale
    return [
        f'<rect y="{PANEL + 8}" width="{wide:.2f}" height="3" fill="{style.SOFT}"/>',
        f'<text x="{wide + 8:.2f}" y="{PANEL + 14}">{long_mm} mm</text>',
    ]


def _outline(part: Part, left_mm: float, top_mm: float, scale: float) -> str:
    x, y = (part.x_m / contacts.M - left_mm) * scale, (part.y_m / contacts.M - top_mm) * scale
    half_x, half_y = (half / contacts.M * scale for half in (part.half_x_m, part.half_y_m))
    if isinstance(part, Ellipse):
        shape = f'ellipse rx="{half_x:.2f}" ry="{half_y:.2f}"'
    else:
        shape = f'rect x="{-half_x:.2f}" y="{-half_y:.2f}" width="{2 * half_x:.2f}" height="{2 * half_y:.2f}"'
    place = f"translate({x:.2f} {y:.2f}) rotate({math.degrees(part.angle_rad):.2f})"
    return f'<{shape} transform="{place}" fill="none" stroke="{OUTLINE}" stroke-width="1.2"/>'


def draw(folder: Path) -> Path:
    write_text(folder / "scenes.svg", svg(panels()))
    return folder / "scenes.svg"
