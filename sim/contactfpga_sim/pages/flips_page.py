"""The tables in docs/flips.md."""

from __future__ import annotations

from collections.abc import Sequence

from contactfpga_sim.pages import writer
from contactfpga_sim.studies.flips import summary
from contactfpga_sim.studies.flips.campaign import Row
from contactfpga_sim.studies.flips.summary import Design

DESIGNS = (
    "design",
    "LUT4",
    "bits",
    "flips",
    "silently wrong, 95 %",
    "wrong for, ms: median / longest",
    "reported",
)
MODULES = ("module", "flips", "silently wrong", "reported", "masked", "registers silently wrong")
KINDS = ("design", "outcome", "by", "flips")
OUTCOMES = {"silent": "silently wrong", "told": "reported"}
"""In words."""


def tables(rows: Sequence[Row], designs: Sequence[Design]) -> writer.Tables:
    """All of them, by name."""
    return {
        "flipped": lambda: designs_table(rows, designs),
        "modules": lambda: modules_table(rows, designs),
        "ways": lambda: ways_table(rows, designs),
    }


def designs_table(rows: Sequence[Row], designs: Sequence[Design]) -> str:
    """A row for each design's registers, and one for its memories."""
    lines = []
    for design in designs:
        for memory, bits in ((False, design.registers), (True, design.memories)):
            some = summary.of(rows, design.name, memory)
            if not some:
                continue
            median, longest = summary.wrong_ms(some)
            first = ("", "") if memory else (f"`{design.name}`", f"{design.luts:,}")
            silent, told = summary.share(some), summary.share(some, "told")
            lines.append(
                writer.line(
                    (
                        *first,
                        f"{bits:,} of {'memory' if memory else 'registers'}",
                        f"{len(some):,}",
                        f"**{100 * silent.hits / silent.of:.1f} %**, {_interval(silent)}",
                        f"{median:,.1f} / {longest:,.1f}" if silent.hits else "",
                        f"{100 * told.hits / told.of:.1f} %",
                    )
                )
            )
    return writer.table(DESIGNS, lines)


def _interval(share: summary.Share) -> str:
    low, high = share.interval
    return f"{100 * low:.1f} to {100 * high:.1f} %"


def modules_table(rows: Sequence[Row], designs: Sequence[Design]) -> str:
    """Registers of the plain designs, by module."""
    plain = [row for row in rows if not row.design.endswith("dual") and not row.found.memory]
    lines = []
    for module, some in summary.by(plain, summary.stage).items():
        counts = [summary.share(some, outcome).hits for outcome in ("silent", "told", "masked")]
        names = summary.by([row for row in some if row.found.outcome == "silent"], lambda row: row.found.name)
        listed = ", ".join(f"`{name}` {len(hits)}" for name, hits in list(names.items())[:6])
        lines.append(writer.line((module, str(len(some)), *map(str, counts), listed)))
    return writer.table(MODULES, lines)


def ways_table(rows: Sequence[Row], designs: Sequence[Design]) -> str:
    """What is wrong with each design, or reports the flip."""
    lines = []
    for design in designs:
        some = [row for row in rows if row.design == design.name and row.found.outcome != "masked"]
        for way, hits in summary.by(some, lambda row: f"{row.found.outcome}|{row.found.kind}").items():
            outcome, kind = way.split("|")
            lines.append(writer.line((f"`{design.name}`", OUTCOMES[outcome], kind, str(len(hits)))))
    return writer.table(KINDS, lines)
