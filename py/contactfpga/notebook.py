"""SVG and HTML of frames, contacts and recordings in a notebook, without further imports."""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Sequence

import numpy as np

from contactfpga import picture_style as style

WIDTH_PX = 320
LINE_PX = 16
Circle = tuple[float, float, float]
"""x, y and radius of a zone in mm."""

SMALLEST_PX = 3.0
"""Smallest side of a cell in pixels that is drawn with lines between cells."""


def sheet(
    shape: tuple[int, int],
    pitch_mm: tuple[float, float],
    caption: str,
    circles: Iterable[Circle] = (),
    cells: np.ndarray | None = None,
    width_px: int = WIDTH_PX,
) -> str:
    """SVG of a sheet laid flat, row 0 at the bottom. ``shape``: rows and columns; ``cells``: (rows, columns) bool, the
    pressed cells if known.
    """
    (rows, columns), (pitch_x, pitch_y) = shape, pitch_mm
    width_mm, height_mm = columns * pitch_x, rows * pitch_y
    scale = width_px / width_mm
    below_px = height_mm * scale
    height_px = below_px + LINE_PX * (caption.count("\n") + 1) + LINE_PX / 2
    origin = f"translate({pitch_x * scale / 2:.2f} {(height_mm - pitch_y / 2) * scale:.2f})"
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width_px}" height="{height_px:.0f}" font-family="sans-serif">'
    )
    parts = [
        head,
        f"<title>{html.escape(caption)}</title>",
        f'<rect width="{width_px}" height="{height_px:.0f}" rx="6" fill="{style.CARD}"/>',
        f'<g transform="{origin} scale({scale:.5f} {-scale:.5f})">',
        _box(-0.5, -0.5, columns, rows, pitch_mm, style.SHEET),
    ]
    if cells is not None:
        parts += [_box(x - 0.5, y - 0.5, 1, 1, pitch_mm, style.PRESSED) for y, x in np.argwhere(cells).tolist()]
    if min(pitch_x, pitch_y) * scale >= SMALLEST_PX:
        parts.append(_grid(rows, columns, pitch_x, pitch_y, 1 / scale))
    for x, y, radius in circles:
        rim = f'r="{radius:.3f}" fill="none" stroke="{style.VERMILLION}" stroke-width="{2 / scale:.3f}"'
        middle = f'r="{3 / scale:.3f}" fill="{style.VERMILLION}"'
        parts += [f'<circle cx="{x:.3f}" cy="{y:.3f}" {each}/>' for each in (rim, middle)]
    parts.append("</g>")
    for number, line in enumerate(caption.split("\n"), 1):
        place = f'x="6" y="{below_px + LINE_PX * number:.0f}"'
        parts.append(f'<text {place} font-size="12" fill="{style.INK}">{html.escape(line)}</text>')
    return "\n".join([*parts, "</svg>"])


def _box(x: float, y: float, columns: int, rows: int, pitch_mm: tuple[float, float], color: str) -> str:
    pitch_x, pitch_y = pitch_mm
    place = f'x="{x * pitch_x:g}" y="{y * pitch_y:g}"'
    return f'<rect {place} width="{columns * pitch_x:g}" height="{rows * pitch_y:g}" fill="{color}"/>'


def _grid(rows: int, columns: int, pitch_x: float, pitch_y: float, width: float) -> str:
    left, right = -pitch_x / 2, (columns - 0.5) * pitch_x
    low, high = -pitch_y / 2, (rows - 0.5) * pitch_y
    upright = "".join(f"M{left + column * pitch_x:g} {low:g}V{high:g}" for column in range(1, columns))
    across = "".join(f"M{left:g} {low + row * pitch_y:g}H{right:g}" for row in range(1, rows))
    return f'<path d="{upright}{across}" stroke="{style.CARD}" stroke-width="{width:.3f}" fill="none"/>'


def over_the_seam(circles: Iterable[Circle], around_mm: float, pitch_mm: float) -> list[Circle]:
    """Circles of a closed sheet: one that crosses the seam is also drawn at the other end."""
    left, right = -pitch_mm / 2, around_mm - pitch_mm / 2
    return [
        (x + shift, y, radius)
        for x, y, radius in circles
        for shift in (-around_mm, 0.0, around_mm)
        if left - radius < x + shift < right + radius
    ]


def radius_mm(area_mm2: float) -> float:
    return math.sqrt(area_mm2 / math.pi)


def table(head: Sequence[str], rows: Iterable[Sequence[str]], caption: str = "") -> str:
    """HTML table; cells are plain text."""
    lines = [f"<caption>{html.escape(caption)}</caption>"] if caption else []
    lines.append(_row(head, "th"))
    lines += [_row(row, "td") for row in rows]
    return "<table>\n" + "\n".join(lines) + "\n</table>"


def _row(cells: Sequence[str], tag: str) -> str:
    return "<tr>" + "".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in cells) + "</tr>"


def beside(pictures: Iterable[tuple[str, str]]) -> str:
    """HTML of pictures with titles, side by side as far as there is room."""
    shown = (f"<figure><figcaption>{html.escape(title)}</figcaption>{svg}</figure>" for title, svg in pictures)
    return f'<div style="display:flex;flex-wrap:wrap">{"".join(shown)}</div>'
