"""Picture of docs/wave.md."""

from __future__ import annotations

import itertools
import tempfile
from pathlib import Path

import numpy as np

from contactfpga import picture_style as style
from contactfpga.skin import Skin
from contactfpga_sim.verify import wave

SKIN = Skin(rows=8, columns=8)
NAMES = ("row that is read", "row_cells", "record_data", "record_end", "byte_data", "tx", "contact")
"""Lanes from the top; names of signals are those of the waveform."""
ROW, CELLS, RECORD, END, BYTE, LINE, CONTACT = range(len(NAMES))
BEFORE_US, AFTER_US = 6.0, 3.0
BYTE_CLOCKS = 10 * SKIN.derived.bit_clocks


def draw(folder: Path) -> Path:
    """Draw a simulated touch until its frame is sent, with the values that the stages hand on; what the touch causes
    is colored."""
    import matplotlib as mpl

    with tempfile.TemporaryDirectory(prefix="contactfpga-") as scratch:
        touch = wave.simulate(SKIN, wave.finger(SKIN), Path(scratch) / "touch.vcd")
    us, trace = 1e6 / SKIN.clock_hz, touch.trace.since(touch.touched)
    first, last = -BEFORE_US, (touch.ends - touch.touched) * us + AFTER_US
    with mpl.rc_context(style.SETTINGS):
        figure = style.new(3.0)
        axes = figure.subplots()

        def box(lane: int, start: float, end: float, words: str, colored: object) -> None:
            left, right = max(start * us, first), min(end * us, last)
            if right - left > 3:  # room for two digits
                color = style.PRESSED if colored else style.SHEET
                axes.broken_barh([(left, right - left)], (-lane - 0.38, 0.76), fc=color, ec=style.CARD)
                axes.text((left + right) / 2, -lane, words, ha="center", va="center", fontsize=style.SMALL)

        numbers = itertools.accumulate(trace.rows, lambda number, row: 0 if row[2] else number + 1, initial=0)
        for (_, (start, cells, _)), (number, (end, after, _)) in itertools.pairwise(zip(numbers, trace.rows)):
            box(ROW, start, end, str(number), after)
            box(CELLS, start, end, f"{cells:02x}", cells)
        for at, data, ended in trace.records:
            if first < at * us < last:
                lane = END if ended else RECORD
                axes.plot([at * us], [-lane], "|", ms=15, mew=1.6, color=style.BLUE)
                axes.text(at * us + 1, -lane, "" if ended else f"{data:x}", va="center", fontsize=style.SMALL)
        ends = [at for at, byte in trace.bytes if byte == 0]
        for at, byte in trace.bytes:
            box(BYTE, at, at + BYTE_CLOCKS, f"{byte:02x}", ends[-2] < at <= ends[-1])
        for lane, before, changes in ((LINE, 1, trace.line), (CONTACT, 0, trace.contact)):
            times, levels = np.array([(-touch.touched, before), *changes, (touch.ends, changes[-1][1])]).T
            axes.step(times * us, -lane - 0.3 + 0.6 * levels, where="post", color=style.BLUE, lw=1)
        axes.axvline(0, color=style.VERMILLION, lw=1.4)
        axes.set_xlim(first, last)
        axes.set_ylim(0.6 - len(NAMES), 0.6)
        axes.set_xlabel("µs since the switches closed")
        axes.set_yticks(-np.arange(len(NAMES)), NAMES)
        axes.tick_params(axis="y", length=0)
        axes.spines["left"].set_visible(False)
        return style.save(figure, folder / "wave.svg")
