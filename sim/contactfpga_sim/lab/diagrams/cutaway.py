"""A cutaway of the starter kit's skin, to scale."""

from __future__ import annotations

from pathlib import Path

from contactfpga import picture_style as style
from contactfpga.design.cover import load_cover
from contactfpga.design.cover.felt import WIDTH_M
from contactfpga.design.kits import Kit
from contactfpga.design.sheet.caps import PLATE_MM, caps
from contactfpga.design.sheet.drawn import BOARDS
from contactfpga.design.sheet.parts import DIODE, DOME
from contactfpga_sim.lab.diagrams.canvas import Canvas

PX_PER_MM = 17.0
CELLS = 4
LEFT = 62.0
TOP = 190.0
DIODE_HEIGHT_MM = 1.0
"""Height of a SOD-323 above its board."""
SKIN_COLOR = "#e8c4a8"


def draw(kit: Kit, path: Path) -> Path:
    """A fingertip as wide as in docs/cover.md closes two switches; the foam does not compress."""
    canvas = Canvas(404)
    cover = load_cover(kit.skin_path)
    assert cover is not None
    assert cover.cap is not None
    pitch, foam, side = kit.skin.pitch_x_mm, 1e3 * cover.thickness_m, 1e3 * cover.cap.side_m
    layer = caps(kit.skin, DOME, side)
    foot = DOME.height_mm
    heights = {
        "foam": foam,
        "plate": PLATE_MM,
        "plunger": layer.plunger_height_mm,
        "dome": foot,
        "board": BOARDS["plane"][0],
        "diode": DIODE_HEIGHT_MM,
    }
    tops, y = {}, TOP
    for name, mm in heights.items():
        tops[name] = y
        y += mm * PX_PER_MM
    bottom = y + 4
    width = CELLS * pitch * PX_PER_MM
    for cell in range(CELLS):
        x = LEFT + (cell + 0.5) * pitch * PX_PER_MM
        sunk = DOME.travel_mm * PX_PER_MM if cell in (1, 2) else 0.0
        _cell(canvas, x, sunk, side, tops, layer.plunger_mm)
    canvas.box(LEFT, tops["board"], width, heights["board"] * PX_PER_MM, style.GREEN, lw=0.8)
    canvas.box(LEFT, bottom, width, 46, style.GRAY, ec=style.SOFT)
    _finger(canvas, LEFT + width / 2)
    _lengths(canvas, tops, bottom, width, pitch, side)
    _names(canvas, kit, tops, bottom, width, heights)
    return canvas.save(path)


def _cell(canvas: Canvas, x: float, sunk: float, side: float, tops: dict[str, float], plunger: float) -> None:
    half, inner, dome = (PX_PER_MM * mm / 2 for mm in (side, plunger, DOME.part.width))
    canvas.box(x - half, tops["foam"] + sunk, 2 * half, tops["plate"] - tops["foam"], style.ORANGE, lw=0.8)
    canvas.box(x - half, tops["plate"] + sunk, 2 * half, tops["plunger"] - tops["plate"], style.BLUE, lw=0.8)
    canvas.box(x - inner, tops["plunger"] + sunk, 2 * inner, tops["dome"] - tops["plunger"], style.BLUE, lw=0.8)
    crown, foot = tops["dome"] + sunk, tops["board"]
    shape = [(x - dome, foot), (x - 0.7 * dome, crown), (x + 0.7 * dome, crown), (x + dome, foot)]
    canvas.line(*shape, color=style.VERMILLION if sunk else style.INK, lw=2)
    length, height = DIODE.width * PX_PER_MM / 2, DIODE_HEIGHT_MM * PX_PER_MM
    canvas.box(x - 0.6 * length, tops["diode"], 1.2 * length, height, style.INK, fc=style.INK)


def _finger(canvas: Canvas, x: float) -> None:
    half, sunk = 1e3 * WIDTH_M * PX_PER_MM / 2, DOME.travel_mm * PX_PER_MM
    out = half + 22
    points = [(x - out, 34), (x - out, 118), (x - half - 8, TOP - 22), (x - half + 14, TOP + sunk - 1)]
    mirrored = [(2 * x - px, py) for px, py in reversed(points)]
    canvas.area([*points, *mirrored], SKIN_COLOR)
    canvas.text(x, 80, "fingertip", ha="center")
    canvas.arrow((x, 96), (x, 140), color=style.INK)


def _lengths(canvas: Canvas, tops: dict[str, float], bottom: float, width: float, pitch: float, side: float) -> None:
    first, step, half = LEFT + 0.5 * pitch * PX_PER_MM, pitch * PX_PER_MM, side * PX_PER_MM / 2
    low = bottom + 66
    for x in (first, first + step):
        canvas.line((x, bottom + 48), (x, low + 4), lw=0.8)
    canvas.arrow((first, low), (first + step, low), both=True)
    canvas.small(first + step / 2, low + 16, f"pitch {pitch:g} mm", ha="center", color=style.INK)
    last = LEFT + width - step / 2
    for x in (last - half, last + half):
        canvas.line((x, TOP - 22), (x, TOP - 3), lw=0.8)
    canvas.arrow((last - half, TOP - 18), (last + half, TOP - 18), both=True)
    canvas.small(last, TOP - 32, f"cap {side:g} mm", ha="center", color=style.INK)
    canvas.arrow((LEFT - 16, TOP), (LEFT - 16, bottom), both=True)
    whole = (bottom - 4 - TOP) / PX_PER_MM
    canvas.small(LEFT - 30, (TOP + bottom) / 2, f"{whole:.1f} mm", rotation=90, ha="center", color=style.INK)
    scale = LEFT + width - 10 * PX_PER_MM
    canvas.line((scale, low), (scale + 10 * PX_PER_MM, low), color=style.INK, lw=3, solid_capstyle="butt")
    canvas.small(scale + 5 * PX_PER_MM, low + 16, "10 mm", ha="center", color=style.INK)


def _names(
    canvas: Canvas, kit: Kit, tops: dict[str, float], bottom: float, width: float, heights: dict[str, float]
) -> None:
    right, words = LEFT + width, LEFT + width + 24
    named = [
        (tops["foam"] + 8, TOP - 36, f"foam of {heights['foam']:g} mm,", "cut between the caps"),
        (tops["plate"] + 10, TOP + 6, f"printed cap, {PLATE_MM:g} mm,", f"on a plunger of {DOME.closed_by:g} mm"),
        (tops["dome"] + 2, TOP + 48, f"metal dome of {DOME.part.width:g} mm,", _travel()),
        (tops["board"] + 13, TOP + 90, f"circuit board, {heights['board']:g} mm", ""),
        (tops["diode"] + 9, TOP + 116, "a diode per switch", ""),
        (bottom + 24, TOP + 158, "link of the robot", ""),
    ]
    for y, at, first, second in named:
        canvas.line((right - 6, y), (right + 8, y), (words - 4, at), lw=0.8)
        canvas.text(words, at, first)
        canvas.small(words, at + 15, second)
    canvas.small(LEFT, 18, f"{kit.title}. To scale. The two switches under the finger are closed.")


def _travel() -> str:
    return f"{DOME.force_n:g} N, {DOME.travel_mm:g} mm of travel"
