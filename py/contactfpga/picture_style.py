"""The common style of all pictures, legible on a page 720 pixels wide.

matplotlib is imported only for drawing.
"""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from contactfpga.inputs.files import replaced

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CARD = "#f6f7f9"
"""Background: nearly white on a white page, and without a rim on a dark one."""

INK, SOFT, GRID = "#1d232b", "#545d68", "#d5d9df"
"""Colors of main words and axes, of secondary words, and of grid lines."""

SHEET, PRESSED = "#e3e6eb", "#8fbcd4"
"""Colors of a sheet of switches, and of its pressed part."""

BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK, GRAY, BROWN = PALETTE = (
    *("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#8c8c8c", "#7a4b1e"),
)
"""Colors that color-blind readers can tell apart, after Okabe and Ito, without their yellow, which is too pale for a
light card.
"""

DASHES: tuple[Any, ...] = ("solid", (0, (5, 2)), (0, (1.5, 1.5)), (0, (6, 2, 1.5, 2)))
"""Line styles for coinciding curves: the lower one shows in the gaps of the upper one."""

DARK = {
    CARD: "#14181d",
    INK: "#e6ebf1",
    SOFT: "#aab6c3",
    GRID: "#39434e",
    SHEET: "#2a333d",
    PRESSED: "#3b7a9e",
    BLUE: "#5db2f2",
    VERMILLION: "#f5793b",
    GREEN: "#2fc08f",
    SKY: "#2e7099",
    BLACK: "#ffffff",
    GRAY: "#9aa3ad",
    BROWN: "#bf8a5c",
    "#cfe3d4": "#2d4535",
}
"""Colors on a dark page, by their light ones; the last is a tint. Orange and purple are visible on both."""

WIDTH_PX = 720

WIDTH_IN = WIDTH_PX / 96
""":data:`WIDTH_PX` for matplotlib, whose SVG has 72 points per inch where a browser has 96 pixels."""

SMALL, NORMAL, LARGE = 8.5, 9.0, 10.0
"""Font sizes in points; the small one is 11 pixels high."""

SETTINGS: dict[str, Any] = {
    "svg.hashsalt": "contactfpga",
    "svg.fonttype": "none",
    "font.size": NORMAL,
    "axes.titlesize": LARGE,
    "axes.labelsize": NORMAL,
    "xtick.labelsize": SMALL,
    "ytick.labelsize": SMALL,
    "legend.fontsize": SMALL,
    "figure.facecolor": "none",
    "savefig.facecolor": "none",
    "axes.facecolor": "none",
    "text.color": INK,
    "axes.labelcolor": INK,
    "axes.edgecolor": SOFT,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.7,
    "legend.frameon": False,
}
"""matplotlib settings for drawing and saving; equal input gives an equal file."""


def new(height_in: float, width_in: float = WIDTH_IN) -> Figure:
    """A figure on a card, by default of the page's width, whose parts make room for one another."""
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine
    from matplotlib.patches import FancyBboxPatch

    figure = Figure(figsize=(width_in, height_in), layout=ConstrainedLayoutEngine(w_pad=0.1, h_pad=0.1))
    rounded = f"round,pad=0,rounding_size={8 / 96}"
    card = FancyBboxPatch(
        (0, 0), width_in, height_in, boxstyle=rounded, transform=figure.dpi_scale_trans, fc=CARD, ec="none", zorder=-10
    )
    card.set_in_layout(False)
    figure.add_artist(card)
    return figure


def save(figure: Figure, path: Path) -> Path:
    """Write a picture without the time of drawing."""
    kind = path.suffix.lower()
    with replaced(path) as new:
        if kind == ".svg":
            drawn = io.StringIO()
            figure.savefig(drawn, format="svg", metadata={"Date": None})
            new.write_text(for_dark_pages(numbered(drawn.getvalue())), encoding="utf-8", newline="\n")
        else:
            figure.savefig(new, dpi=2 * 96, metadata={"Software": None} if kind == ".png" else None)
    return path


def numbered(svg: str) -> str:
    """The SVG with ids numbered in order; matplotlib's ids hash coordinates that differ between processors."""
    names: dict[str, str] = {}
    return re.sub(
        r'(?<=[#"])[a-z][0-9a-f]{10}(?=[")])', lambda found: names.setdefault(found[0], f"i{len(names)}"), svg
    )


def for_dark_pages(svg: str) -> str:
    """The SVG with rules that apply :data:`DARK` where a reader prefers dark pages."""
    rules = []
    for light, dark in DARK.items():
        for what in ("fill", "stroke"):
            written = {f"{what}: {light}": f'[style*="{what}: {light}"]', f'{what}="{light}"': f'[{what}="{light}"]'}
            if found := [mark for words, mark in written.items() if words in svg]:
                rules.append(f"{','.join(found)}{{{what}:{dark}!important}}")
    style = "<style>@media (prefers-color-scheme: dark) {\n" + "\n".join(rules) + "\n}</style>"
    head, end, rest = svg.partition("<svg")
    opening, closed, rest = rest.partition(">")
    return f"{head}{end}{opening}{closed}\n{style}{rest}" if rules else svg
