"""Picture of docs/wave.md: `contactfpga wave` for the reference Skin."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib

from contactfpga import picture_style as style
from contactfpga.skin import Skin
from contactfpga_sim.verify import wave

LANES = (
    "row that is driven",
    "a row is handed on",
    "a zone, or a frame's end",
    "a byte is handed on",
    "line",
    "contact",
)


def draw(folder: Path) -> list[Path]:
    skin = Skin()
    with tempfile.TemporaryDirectory(prefix="contactfpga-") as work:
        touch = wave.simulate(skin, wave.finger(skin), Path(work) / "touch.vcd")
    with matplotlib.rc_context(style.SETTINGS):
        figure = style.new(3.2)
        _lanes(figure.subplots(), skin, touch)
        return [style.save(figure, folder / "wave.svg")]


def _lanes(axes: Any, skin: Skin, touch: wave.SimulatedTouch) -> None:
    def us(cycle: float) -> float:
        return (cycle - touch.begins) * 1e6 / skin.clock_hz

    trace, end = touch.trace, us(touch.ends)
    for lane, boundary in enumerate(("rows", "records", "bytes"), start=1):
        cycles = [cycle for cycle, *_ in trace.events(boundary) if cycle >= touch.begins]
        axes.eventplot([us(cycle) for cycle in cycles], **_ticks(lane))
    rows = [(us(cycle), row % skin.rows) for row, (cycle, *_) in enumerate(trace.rows) if cycle >= touch.begins]
    axes.step([at for at, _ in rows], [0.4 - 0.8 * row / skin.rows for _, row in rows], where="pre", color=style.BLUE)
    for lane, first, levels in ((4, 1, trace.line), (5, 0, trace.contact)):
        _level(axes, lane, [(-math.inf, first), *((us(cycle), level) for cycle, level in levels)], end)
    axes.axvline(us(touch.touched), color=style.VERMILLION, linewidth=1.2)
    axes.annotate("a switch closes", (us(touch.touched), -0.75), color=style.VERMILLION, ha="center")
    axes.set(xlim=(0, end), ylim=(len(LANES) - 0.4, -0.9), xlabel="µs", yticks=range(len(LANES)), yticklabels=LANES)
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.tick_params(axis="y", length=0)


def _ticks(lane: int) -> dict[str, Any]:
    return {"lineoffsets": lane, "linelengths": 0.6, "colors": style.BLUE, "linewidths": 1.2}


def _level(axes: Any, lane: int, changes: Sequence[tuple[float, int]], end: float) -> None:
    before = [level for at, level in changes if at <= 0]
    shown = [(0.0, before[-1]), *((at, level) for at, level in changes if at > 0)]
    times, levels = [at for at, _ in shown], [lane + 0.3 - 0.6 * level for _, level in shown]
    axes.step([*times, end], [*levels, levels[-1]], where="post", color=style.BLUE)
