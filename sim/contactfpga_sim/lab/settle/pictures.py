"""Pictures of docs/settle.md."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from contactfpga import picture_style as style
from contactfpga.design.circuit import Circuit, patterns
from contactfpga.design.circuit.network import Network
from contactfpga_sim.lab.settle import breaks, tables
from contactfpga_sim.lab.settle.breaks import HIGH_V, KNOBS, SETTLE_US, SIZE, US
from contactfpga_sim.lab.settle.tables import NAMES, RowTime

COLORS = (style.BLUE, style.VERMILLION, style.GREEN)


def draw(folder: Path) -> list[Path]:
    import matplotlib as mpl

    with mpl.rc_context(style.SETTINGS):
        return [_row(folder / "settle-row.svg"), _breaks(folder / "settle-breaks.svg")]


def _steps(axes: Any, found: RowTime) -> None:
    for start, end, name in zip(found.starts_us, found.starts_us[1:], NAMES):
        axes.axvline(start, color=style.GRID, lw=1)
        if end - start > 0.1:
            place = (start + end) / 2
            axes.text(place, 1.02, name, transform=axes.get_xaxis_transform(), ha="center", color=style.SOFT)
    axes.set_xlim(0, found.starts_us[-1])


def _thresholds(axes: Any) -> None:
    for volts, name in ((Circuit().low_v, "VIL"), (Circuit().high_v, "VIH")):
        axes.axhline(volts, color=style.SOFT, lw=0.8, ls=style.DASHES[2])
        axes.text(0.01, volts + 0.05, name, color=style.SOFT)


def _row(path: Path) -> Path:
    network = Network(Circuit(), patterns.named(SIZE, SIZE)["all but a column"])
    found = tables.row_time(network)
    middle = patterns.middle(SIZE)
    figure = style.new(3.0)
    axes = figure.subplots()
    _steps(axes, found)
    microseconds = US * found.seconds
    lines = {
        "unpressed column": (found.volts[:, middle], style.GREEN, style.DASHES[0]),
        "pressed column": (found.volts[:, 0], style.BLUE, style.DASHES[0]),
        "selected row": (found.volts[:, SIZE + middle], style.ORANGE, style.DASHES[1]),
    }
    for name, (volts, color, dashes) in lines.items():
        axes.plot(microseconds, volts, color=color, ls=dashes, lw=1.8, label=name)
    _thresholds(axes)
    axes.set_xlabel("time, µs")
    axes.set_ylabel("V")
    axes.legend(loc="center left", bbox_to_anchor=(0.05, 0.345))
    return style.save(figure, path)


def _breaks(path: Path) -> Path:
    figure = style.new(6.4)
    figure.suptitle("Crosses and numbers: the first value beyond the limit", x=0.02, ha="left", fontsize=style.NORMAL)
    for axes, (name, knob) in zip(figure.subplots(2, 2).flat, KNOBS.items()):
        late = name != "coupling"
        limit = SETTLE_US if late else HIGH_V
        for color, (run, sweep) in zip(COLORS, breaks.sweeps(name).items()):
            amounts = [outcome.amount for outcome in sweep.outcomes]
            shown = np.where(np.isfinite(amounts), amounts, np.nan)
            if sweep.broken is not None:
                axes.plot([sweep.breaks_at], [amounts[sweep.broken]], "x", color=color, ms=7, mew=2)
                run += f": {float(f'{sweep.breaks_at:.2g}'):,g}"
            axes.plot(knob.values, shown, color=color, lw=1.8, label=run)
        words = f"limit, settle_us = {limit:g} µs" if late else f"limit, VIH = {limit:.1f} V"
        axes.axhline(limit, color=style.INK, lw=1, ls=style.DASHES[1], label=words)
        if name != "columns":
            axes.set_xscale("log")
            axes.set_xlim(knob.values[0] / 1.2, 1.5 * knob.values[-1])
            axes.xaxis.set_major_formatter(lambda value, _: f"{value:,g}")
        if late:
            axes.set_ylim(0, 4 * limit)
        else:
            axes.set_ylim(0, 3.4)
        axes.set_title(knob.title, loc="left")
        axes.set_xlabel(knob.axis)
        axes.set_ylabel("time to settle, µs" if late else "lowest of an unpressed column, V")
        axes.grid(visible=True)
        axes.legend(loc="upper left" if late else "lower left")
    return style.save(figure, path)
