"""The curve of docs/flips.md: flips that are silently wrong against what a design costs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from contactfpga import picture_style as style
from contactfpga_sim.lab.flips import summary
from contactfpga_sim.lab.flips.campaign import Row
from contactfpga_sim.lab.flips.summary import Design

GOAL = 1.0
"""Per cent."""


def draw(rows: Sequence[Row], designs: Sequence[Design], path: Path) -> Path:
    """Write it."""
    import matplotlib as mpl

    with mpl.rc_context(style.SETTINGS):
        figure = style.new(3.6)
        axes = figure.subplots()
        kinds = [design.name.removesuffix(", dual") for design in designs]
        for kind, color in zip(dict.fromkeys(kinds), style.PALETTE):
            line = [design for design, one in zip(designs, kinds) if one == kind]
            shares = [summary.share(summary.of(rows, design.name, memory=False)) for design in line]
            middle = [100 * share.hits / share.of for share in shares]
            below = [at - 100 * share.interval[0] for at, share in zip(middle, shares)]
            above = [100 * share.interval[1] - at for at, share in zip(middle, shares)]
            luts = [design.luts for design in line]
            axes.errorbar(luts, middle, yerr=[below, above], color=color, marker="o", capsize=3, lw=1.2, label=kind)
        axes.axhline(GOAL, color=style.INK, lw=1, ls=style.DASHES[1])
        axes.set_xlabel("LUT4 of a UP5K, plain and with dual")
        axes.set_ylabel("register flips silently wrong, %")
        axes.set_xlim(left=0)
        axes.set_ylim(bottom=0)
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:,.0f}")
        axes.grid(visible=True)
        axes.legend()
        return style.save(figure, path)
