"""A bar per stage from touch to user code, and the paper's time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from contactfpga import picture_style as style
from contactfpga_sim.apps.latency.spread import Spread
from contactfpga_sim.apps.latency.stages import PAPER_US, Finger

EXACT, MEASURED, PAPER = style.BLUE, style.ORANGE, style.GRAY

PALE = 0.35


def save(found: Finger, title: str, path: Path) -> Path:
    """Draw the picture; equal numbers give equal files."""
    with matplotlib.rc_context(style.SETTINGS):
        return style.save(picture(found, title), path)


def picture(found: Finger, title: str) -> Figure:
    bars = _bars(found)
    figure = style.new(0.36 * (len(bars) + 1) + 2.2)
    above, below = figure.subplots(2, 1, height_ratios=[len(bars) + 0.3, 2.6])
    end = max(max(times.p99, times.worst * (color == EXACT)) for _, times, color in bars)
    for row, (_, times, color) in enumerate(bars):
        _bar(above, row, times, color, end)
    _rows(above, [name for name, _, _ in bars], end)
    above.set_title(title, loc="left")
    name, times, color = bars[-1]
    end = max(times.p99, PAPER_US)
    _bar(below, 0, times, color, end)
    below.barh(1, PAPER_US, 0.6, color=PAPER)
    _label(below, 1, PAPER_US, f"{_shown(PAPER_US)}, sheet and control")
    _rows(below, [name, "the paper"], end)
    below.set_xlabel("µs: median / 99 % / worst")
    patches = [Patch(color=EXACT, label="exact: gateware by the clock, model of the bridge")]
    if found.host is not None:
        patches.append(Patch(color=MEASURED, label=f"measured on {found.host.machine.split(',')[0]}"))
    figure.legend(
        handles=patches,
        loc="outside lower left",
        ncols=2,
        title="Dark to the median, pale to the worst (> if it lies beyond), a line at 99 %",
        title_fontsize=style.SMALL,
        alignment="left",
    )
    return figure


def _bars(found: Finger) -> list[tuple[str, Spread, str]]:
    bars = [
        ("touch to contact pin", found.board.touch_to_contact_us, EXACT),
        ("touch to last byte", found.board.touch_to_last_byte_us, EXACT),
        ("last byte to host", found.bridge_us, EXACT),
        ("touch to host", found.usb_us, EXACT),
    ]
    if found.host is not None and found.user_code_us is not None:
        bars[3:3] = [("host to user code", found.host.us, MEASURED)]
        bars.append(("touch to user code", found.user_code_us, MEASURED))
    return bars


def _bar(panel: Any, row: int, times: Spread, color: str, end: float) -> None:
    shown = min(times.worst, end)
    panel.barh(row, shown, 0.6, color=color, alpha=PALE, linewidth=0)
    panel.barh(row, times.median, 0.6, color=color)
    panel.plot([times.p99, times.p99], [row - 0.3, row + 0.3], color=style.INK, linewidth=1.2, solid_capstyle="butt")
    beyond = "> " if times.worst > end else ""
    _label(panel, row, shown, beyond + " / ".join(_shown(us) for us in (times.median, times.p99, times.worst)))


def _label(panel: Any, row: int, end: float, text: str) -> None:
    panel.annotate(text, (end, row), xytext=(5, 0), textcoords="offset points", va="center", fontsize=style.SMALL)


def _shown(us: float) -> str:
    return f"{us:,.0f}" if us >= 100 else f"{us:.1f}" if us >= 1 else f"{us:.2f}"


def _rows(panel: Any, names: list[str], end: float) -> None:
    panel.set_xlim(0, 1.3 * end)
    panel.xaxis.set_major_formatter("{x:,.0f}")
    panel.set_yticks(range(len(names)), names)
    panel.set_ylim(len(names) - 0.4, -0.6)
    panel.tick_params(axis="y", length=0)
    panel.spines["left"].set_visible(False)
    panel.grid(axis="x")
