"""Sheets with their zones, in the terminal and in pictures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np
from rich.columns import Columns
from rich.text import Text

from contactfpga import picture_style as style
from contactfpga.skin import Skin
from contactfpga.wire.protocol import Frame
from contactfpga.zones.zone import Zones, cell_labels
from contactfpga_sim.model.golden.zones import closed_flood, flood

COLORS = style.PALETTE[:6]
"""Colors of zones, visible on dark terminals."""

ACROSS = 4


class Drawn(Protocol):
    """Parts of a scene needed for drawing."""

    @property
    def skin(self) -> Skin: ...
    @property
    def scene(self) -> str: ...
    @property
    def cells(self) -> np.ndarray: ...
    @property
    def frame(self) -> Frame | None: ...


def in_terminal(outcomes: Sequence[Drawn], unicode: bool = True) -> Columns:
    """Zones in colors, two rows of cells per line of text; in ASCII one."""
    return Columns([_sheet(out, unicode) for out in outcomes], padding=(0, 3))


def _sheet(out: Drawn, unicode: bool) -> Text:
    labels, count = _labels(out), zones(out)
    text = Text(f"{out.scene}: {count} zone{'' if count == 1 else 's'}\n")
    for pieces in _halves(labels) if unicode else _ascii(labels):
        for character, look in pieces:
            text.append(character, style=look)
        text.append("\n")
    return text


def zones(out: Drawn) -> int:
    """Number of zones that the frame states; of one with levels, of the contacts found in its map."""
    if out.frame is None or out.frame.levels is None:
        return out.frame.zones if out.frame else 0
    return int(_labels(out).max())


def _labels(out: Drawn) -> np.ndarray:
    if out.frame is not None and out.frame.levels is not None:
        return cell_labels(out.frame, out.skin.sheet)
    find = closed_flood if out.skin.closed else flood
    return find(out.cells, out.skin.connectivity)[0]


Pieces = Iterator[tuple[str, str]]
"""Characters of a line with their styles."""


def _halves(labels: np.ndarray) -> Iterator[Pieces]:
    if len(labels) % 2:
        labels = np.vstack([labels, np.zeros((1, labels.shape[1]), int)])
    for upper, lower in zip(labels[::2].tolist(), labels[1::2].tolist()):
        yield ((_GLYPHS[above > 0, below > 0], _style(above, below)) for above, below in zip(upper, lower))


def _ascii(labels: np.ndarray) -> Iterator[Pieces]:
    for row in labels.tolist():
        yield (("#" if number else ".", _style(number, number)) for number in row)


_GLYPHS = {(False, False): "·", (True, False): "▀", (False, True): "▄", (True, True): "█"}


def _style(above: int, below: int) -> str:
    if not above and not below:
        return "dim"
    colors = [COLORS[(number - 1) % len(COLORS)] for number in (above, below) if number]
    return colors[0] if len(set(colors)) == 1 else f"{colors[0]} on {colors[1]}"


def to_file(outcomes: Sequence[Drawn], path: Path) -> None:
    """Write a picture with a panel per scene: cells in their zones' colors, and received barycenters."""
    import matplotlib

    with matplotlib.rc_context(style.SETTINGS):
        _save(outcomes, path)


def _save(outcomes: Sequence[Drawn], path: Path) -> None:
    from matplotlib.colors import to_rgb

    palette = np.array([to_rgb(color) for color in (style.SHEET, *COLORS)])
    down = -(-len(outcomes) // ACROSS)
    figure = style.new(2.0 * down + 0.5)
    panels = figure.subplots(down, ACROSS, squeeze=False)
    for panel in panels.flat:
        panel.axis("off")
    for panel, out in zip(panels.flat, outcomes):
        labels = _labels(out)
        shown = np.where(labels > 0, (labels - 1) % len(COLORS) + 1, 0)
        panel.imshow(palette[shown], extent=_extent(out.skin), interpolation="nearest")
        if out.frame is not None:
            array = Zones(out.frame, out.skin.sheet).array
            panel.plot(array["x_mm"], array["y_mm"], "k+", markersize=7, markeredgewidth=1.4)
        panel.set_title(out.scene, fontsize=style.SMALL)
    figure.suptitle("Contact zones and their barycenters (+), as they came over the wire", fontsize=style.LARGE)
    path.parent.mkdir(parents=True, exist_ok=True)
    style.save(figure, path)


def _extent(skin: Skin) -> tuple[float, float, float, float]:
    half_x, half_y = skin.pitch_x_mm / 2, skin.pitch_y_mm / 2
    right, bottom = (skin.columns - 1) * skin.pitch_x_mm + half_x, (skin.rows - 1) * skin.pitch_y_mm + half_y
    return -half_x, right, bottom, -half_y
