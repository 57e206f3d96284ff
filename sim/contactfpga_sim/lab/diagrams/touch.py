"""A touch of each kit as a timing diagram, from the gateware's simulation."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from contactfpga import picture_style as style
from contactfpga.design import kits
from contactfpga.skin import Skin
from contactfpga.wire.framing import DELIMITER
from contactfpga_sim.verify import wave

LANES = ("row is driven", "zone is found", "byte on the line", "contact")
ROW, ZONE, BYTE, CONTACT = range(len(LANES))
TOUCHED, OTHER = style.VERMILLION, style.SKY
HALF = 0.3
BYTE_BITS = 10
BEFORE_OFFER = 2
"""Clocks from a row's last one to its handover (docs/timing.md)."""


def draw(path: Path) -> Path:
    """A panel per kit, and one row of the raster scan between them."""
    figure = style.new(6.6)
    raster, slot, reversal = figure.subplots(3, 1, height_ratios=(4, 2.4, 4))
    starter, fast = (kits.kit(name).skin for name in ("starter", "fast"))
    _touch(raster, starter, "Raster scan, starter kit: all rows in turn")
    _slot(slot, starter)
    _touch(reversal, fast, "Line reversal, fast kit: only touched rows")
    raster.set_title("orange: what the touch causes", loc="right", fontsize=style.NORMAL, color=TOUCHED)
    return style.save(figure, path)


def _touch(axes: Any, skin: Skin, title: str) -> None:
    with tempfile.TemporaryDirectory(prefix="contactfpga-") as work:
        touch = wave.simulate(skin, wave.finger(skin), Path(work) / "touch.vcd")

    def us(clocks: float) -> float:
        return clocks * 1e6 / skin.clock_hz

    end = us(touch.ends - touch.touched)
    for lane, first, clocks, color in _bars(skin, touch):
        axes.broken_barh([(us(first - touch.touched), us(clocks))], (lane - HALF, 2 * HALF), color=color, lw=0)
    rises = next(us(cycle - touch.touched) for cycle, level in touch.trace.contact if level and cycle > touch.touched)
    axes.step([-end, rises, 1.1 * end], [CONTACT + HALF, CONTACT - HALF, CONTACT - HALF], where="post", color=TOUCHED)
    digits = 0 if end > 50 else 1
    words = f"rises after {rises:.0f} µs" if rises > 1 else f"rises after {1000 * rises:.0f} ns"
    axes.annotate(words, (rises, CONTACT + 0.12), (5, 0), textcoords="offset points", va="center", fontsize=style.SMALL)
    axes.axvline(0, color=style.INK, linewidth=1)
    axes.axvline(end, color=style.INK, linewidth=1)
    for at, words, side in ((0, "a switch closes", "left"), (end, f"all is sent: {end:.{digits}f} µs", "right")):
        axes.annotate(words, (at, -0.68), (4 if side == "left" else -4, 0), textcoords="offset points", ha=side)
    axes.set(xlim=(-0.12 * end, 1.03 * end), xlabel="µs since the switch closed")
    _dress(axes, LANES, title, top=-1.15)


def _bars(skin: Skin, touch: wave.SimulatedTouch) -> Iterator[tuple[int, float, float, str]]:
    trace, times = touch.trace, skin.derived
    for cycle, cells, _ in trace.rows:
        first = cycle - BEFORE_OFFER - times.settle_clocks
        if first + times.settle_clocks > touch.begins:
            yield ROW, first, times.settle_clocks, TOUCHED if cells else OTHER
    width = (touch.ends - touch.touched) / 200
    for cycle, _, end in trace.records:
        if not end:
            yield ZONE, cycle, width, TOUCHED
    sent = [(cycle, value) for cycle, value in trace.bytes if cycle < touch.ends]
    last = max(index for index, (_, value) in enumerate(sent) if value == DELIMITER)
    first = max(index for index, (_, value) in enumerate(sent[:last]) if value == DELIMITER) + 1
    clocks = BYTE_BITS * round(skin.clock_hz / skin.baud)
    for index, (cycle, _) in enumerate(sent):
        yield BYTE, cycle, 0.85 * clocks, TOUCHED if first <= index <= last else OTHER


def _slot(axes: Any, skin: Skin) -> None:
    times = skin.derived
    row = times.settle_clocks + times.release_clocks
    driven, released, next_row, one = (
        clocks * 1e6 / skin.clock_hz for clocks in (times.settle_clocks, times.release_clocks, row, 1)
    )
    axes.broken_barh([(0, driven)], (-HALF, 2 * HALF), color=OTHER, lw=0)
    axes.broken_barh([(next_row, driven)], (1 - HALF, 2 * HALF), color=OTHER, lw=0)
    axes.broken_barh([(driven + one, released - 2 * one)], (2 - HALF, 2 * HALF), color=style.GREEN, lw=0)
    axes.text(driven / 2, 0, f"settles, {driven:.2f} µs", ha="center", va="center", fontsize=style.SMALL)
    axes.annotate("columns are charged", (driven - one, 2), ha="right", va="center", fontsize=style.SMALL)
    axes.vlines(driven - one, -0.5, 0.5, color=style.INK, linewidth=1.6)
    axes.annotate("sample", (driven, 0), (6, 0), textcoords="offset points", va="center", fontsize=style.SMALL)
    axes.set(xlim=(-0.12 * next_row, 1.5 * next_row), xlabel="µs")
    _dress(axes, ("row k", "row k + 1", "columns"), "One row of this raster scan")


def _dress(axes: Any, lanes: tuple[str, ...], title: str, top: float = -0.6) -> None:
    axes.set(ylim=(len(lanes) - 0.4, top), yticks=range(len(lanes)), yticklabels=lanes)
    axes.set_title(title, loc="left", fontsize=style.NORMAL)
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.tick_params(axis="y", length=0)
