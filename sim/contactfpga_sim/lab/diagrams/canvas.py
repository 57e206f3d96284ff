"""A canvas for a diagram in page pixels, y down."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from contactfpga import picture_style as style

TINTS = {
    style.BLUE: "#d3e6f3",
    style.VERMILLION: "#f8dfcf",
    style.GREEN: "#d0ece3",
    style.ORANGE: "#fbecc8",
    style.GRAY: style.SHEET,
    style.PURPLE: "#f4e1ec",
}
"""Fill of a box in each color, light enough for text."""


class Canvas:
    """A diagram of the page's width, created under :data:`contactfpga.picture_style.SETTINGS`."""

    def __init__(self, height_px: float):
        self.figure = style.new(height_px / 96)
        self.figure.set_layout_engine("none")
        self.axes: Any = self.figure.add_axes((0, 0, 1, 1))
        self.axes.set(xlim=(0, style.WIDTH_PX), ylim=(height_px, 0))
        self.axes.axis("off")

    def text(self, x: float, y: float, words: str, **how: Any) -> None:
        self.axes.text(x, y, words, **{"va": "center", "fontsize": style.NORMAL, "color": style.INK} | how)

    def small(self, x: float, y: float, words: str, **how: Any) -> None:
        self.text(x, y, words, **{"fontsize": style.SMALL, "color": style.SOFT} | how)

    def box(self, x: float, y: float, w: float, h: float, color: str, **how: Any) -> None:
        from matplotlib.patches import Rectangle

        look: dict[str, Any] = {"fc": TINTS.get(color, color), "ec": color, "lw": 1} | how
        self.axes.add_patch(Rectangle((x, y), w, h, **look))

    def area(self, points: Sequence[tuple[float, float]], color: str, **how: Any) -> None:
        self.axes.fill(*zip(*points, strict=True), **{"fc": color, "ec": "none", "lw": 0.8} | how)

    def line(self, *points: tuple[float, float], color: str = style.SOFT, **how: Any) -> None:
        self.axes.plot(*zip(*points, strict=True), **{"color": color, "lw": 1, "solid_capstyle": "round"} | how)

    def arrow(self, *points: tuple[float, float], color: str = style.SOFT, both: bool = False) -> None:
        self.line(*points, color=color, lw=1.6, solid_capstyle="butt")
        ends = [(points[-2], points[-1])] + ([(points[1], points[0])] if both else [])
        for start, end in ends:
            self.axes.annotate(
                "", end, start, arrowprops={"arrowstyle": "-|>", "color": color, "lw": 0.1, "shrinkA": 0, "shrinkB": 0}
            )

    def save(self, path: Path) -> Path:
        return style.save(self.figure, path)
