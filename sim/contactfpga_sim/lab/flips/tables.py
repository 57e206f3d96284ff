"""Tables of docs/flips.md, and the curve of silently wrong flips against cost."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from contactfpga import picture_style as style
from contactfpga_sim.apps import pool
from contactfpga_sim.apps.stats import Rate
from contactfpga_sim.lab import writer
from contactfpga_sim.lab.flips import campaign, summary
from contactfpga_sim.lab.flips.campaign import DESIGNS, Row
from contactfpga_sim.lab.flips.summary import Design

COLUMNS = (
    "design",
    "LUT4",
    "bits",
    "flips",
    "silently wrong, 95 %",
    "wrong for, ms: longest / median",
    "reported",
)
LONG_S = 0.005
"""Time above which a fault spoils many frames."""


class FlipResults(NamedTuple):
    rows: Sequence[Row]
    designs: Sequence[Design]


def compute() -> FlipResults:
    """Flips, and the size of each design."""
    with pool.executor() as executor, pool.progress() as step:
        done = functools.partial(step, "designs flipped")
        rows = campaign.run(list(DESIGNS), executor, done)
    return FlipResults(rows, summary.measured(DESIGNS))


def draw(folder: Path, found: FlipResults) -> list[Path]:
    numbers = folder.parent / "flips"
    campaign.write(found.rows, numbers / "flips.csv")
    summary.write(found.designs, numbers / "designs.csv")
    drawn = _plot(found.rows, found.designs, folder / "flips.svg")
    return [numbers / "flips.csv", numbers / "designs.csv", drawn]


def worst_text(found: FlipResults) -> str:
    """The worst flips of registers and memories, with one and two copies, and their rate."""
    rows = found.rows
    groups = [
        (f"Flips of {'memory' if memory else 'registers'} with {'two copies' if dual else 'one copy'}", some)
        for dual in (False, True)
        for memory in (False, True)
        if (some := [row for row in rows if row.found.memory == memory and row.design.endswith("dual") == dual])
    ]
    groups.sort(key=lambda group: -max(map(_seconds, group[1])))
    lines = [f"- {name}: {_worst(some)}" for name, some in groups]
    if fought := [row for row in rows if row.found.fights]:
        worst = max(fought, key=lambda row: row.found.fights)
        lines.append(
            f"- A column was driven against a row in {len(fought)} of {len(rows):,} flips, for {worst.found.fights} "
            f"{'clock' if worst.found.fights == 1 else 'clocks'} at most: `{worst.found.name}` in `{worst.design}`. "
            "The resistors at the pins bound its current ([which](maker.md#which-resistor-at-each-pin))."
        )
    return "\n".join((*lines, "", "A flip that was not drawn may be worse than all of these."))


def _seconds(row: Row) -> float:
    """Seconds for which the flip was silently wrong, rounded as in the page's file, so that both agree on the worst."""
    return round(row.found.seconds, 6)


def _worst(rows: Sequence[Row]) -> str:
    silent = summary.share(rows)
    wrong = [row for row in rows if row.found.outcome == "silent"]
    worst = max(wrong or rows, key=_seconds)
    long = Rate(sum(row.found.seconds > LONG_S for row in wrong), len(rows))
    what = (
        f"one of `{worst.found.name}` in `{worst.design}` was silently wrong for {1e3 * worst.found.seconds:,.1f} ms "
        f"({worst.found.kind}). "
        if silent.hits
        else ""
    )
    return (
        f"{what}{silent.hits} of {silent.of:,} were silently wrong ({_interval(silent)}), {long.hits} of them for more "
        f"than {1e3 * LONG_S:g} ms ({_interval(long)})."
    )


def designs_table(found: FlipResults) -> writer.Table:
    lines, shown = [], []
    for design in found.designs:
        for memory, bits in ((False, design.registers), (True, design.memories)):
            some = summary.of(found.rows, design.name, memory)
            if not some:
                continue
            median, longest = summary.wrong_ms(some)
            first = ("", "") if memory else (f"`{design.name}`", f"{design.luts:,}")
            silent, told = summary.share(some), summary.share(some, "told")
            lines.append(
                (
                    *first,
                    f"{bits:,} of {'memory' if memory else 'registers'}",
                    f"{len(some):,}",
                    f"**{100 * silent.hits / silent.of:.1f} %**, {_interval(silent)}",
                    f"{longest:,.1f} / {median:,.1f}" if silent.hits else "",
                    f"{100 * told.hits / told.of:.1f} %",
                )
            )
            shown += [] if memory else [lines[-1]]
    columns = [name for name in COLUMNS if name not in ("bits", "flips")]
    return writer.Table(COLUMNS, lines, lambda row: row in shown, columns)


def _interval(share: Rate) -> str:
    low, high = share.interval()
    return f"{100 * low:.1f} to {100 * high:.1f} %"


def _plot(rows: Sequence[Row], designs: Sequence[Design], path: Path) -> Path:
    import matplotlib as mpl

    plain = [design for design in designs if not design.name.endswith(", dual")]
    twice = {design.name.removesuffix(", dual"): design for design in designs if design not in plain}
    shown = [one for design in plain for one in (design, twice.get(design.name)) if one]
    with mpl.rc_context(style.SETTINGS):
        figure = style.new(0.36 * len(shown) + 1.0)
        axes = figure.subplots()
        for row, design in enumerate(shown):
            share = summary.share(summary.of(rows, design.name, memory=False))
            low, high = (100 * end for end in share.interval())
            color = style.BLUE if design in plain else style.VERMILLION
            axes.plot([low, high], [row, row], color=color, lw=2)
            axes.plot(100 * share.hits / share.of, row, "o", ms=7, color=color, clip_on=False, zorder=3)
            axes.text(high + 0.1, row, f"{share.hits} of {share.of}", va="center", fontsize=style.SMALL)
        names = [f"{design.name.replace(', dual', ', two copies')}: {design.luts:,} LUT4" for design in shown]
        axes.set_yticks(range(len(shown)), names)
        axes.set_xlabel("flips of registers that are silently wrong, %, with their 95 % interval")
        axes.set(ylim=(len(shown) - 0.4, -0.6), xlim=(0, None))
        axes.margins(x=0.12)
        axes.grid(visible=True, axis="x")
        return style.save(figure, path)
