"""Size and clock by place and route, for the performance and boards pages."""

from __future__ import annotations

import functools
import sys
import tempfile
from pathlib import Path
from typing import Any

from contactfpga.boards import BOARDS
from contactfpga.boards.spec import BoardSpec
from contactfpga.skin import Skin
from contactfpga_hdl.board import build, sizes
from contactfpga_hdl.top import Top
from contactfpga_sim.apps import size
from contactfpga_sim.lab import writer

EXAMPLES = {"icebreaker": Path("examples/icebreaker-64x64.toml")}
FAST = Path("examples/fast.toml")


FAULTS: dict[str, dict[str, Any]] = {
    "`guard`": {"guard": True},
    "`fail_safe`": {"fail_safe": True},
    "`alive`": {"alive": True},
    "`guard`, `fail_safe` and `alive`": {"guard": True, "fail_safe": True, "alive": True},
    "`row_order` and `column_order`": {"row_order": (*range(1, 16), 0), "column_order": (*range(1, 16), 0)},
}
CHEAP = ("`fail_safe`", "`alive`", "`row_order` and `column_order`")
"""Options that the page leaves out."""
FAST_FAULTS: dict[str, dict[str, Any]] = {
    "`guard`": {"guard": True},
    "`self_test`": {"self_test": True},
    "`guard` and `self_test`": {"guard": True, "self_test": True},
}

WEIGHTS = (
    (1, 2, 3, -4, 5, 6, 7, 8),
    (-1, 1, -1, 1, -1, 1, -1, 1),
    (100, -50, 20, 10, 5, -7, 9, 11),
    (1, 1, 1, 1, 1, 1, 1, 1),
)
"""Weights of sums, cut to the units."""


def gateware_table() -> str:
    head = ("design", "device", *(f"{lines}x{lines}" for lines in size.SIZES))
    rows = (
        (name, device.title, *(gateware_cell(name, device, lines) for lines in size.SIZES))
        for name in size.DESIGNS
        for device in sizes.DEVICES
    )
    return writer.table(head, map(writer.line, rows))


def gateware_cell(name: str, device: sizes.Device, lines: int) -> str:
    print(f"{name}, {device.title}, {lines}x{lines}: {sizes.SEEDS} times place and route", file=sys.stderr)
    found = size.measure(lambda: size.DESIGNS[name](size.square(lines)), device)
    return f"{found.luts:,} / {found.flip_flops:,} / {found.block_rams}, {found.fmax_mhz:.0f} MHz"


def faults_table() -> writer.Table:
    rows = [*_fault_rows(Skin(), "none", FAULTS), *_fault_rows(Skin.load(FAST), f"`{FAST}`", FAST_FAULTS)]
    return writer.Table(("option", "LUT4", "more"), rows, lambda row: row[0] not in CHEAP)


def _fault_rows(skin: Skin, name: str, table: dict[str, dict[str, Any]]) -> list[tuple[str, str, str]]:
    reference = size.luts(lambda: Top(skin), sizes.UP5K)
    rows = [(name, f"{reference:,}", "")]
    for title, options in table.items():
        found = size.luts(lambda options=options: Top(skin.replace(**options)), sizes.UP5K)  # type: ignore[misc]
        rows.append((title, f"{found:,}", f"{found - reference:+}"))
    return rows


def units_table() -> str:
    reference = size.luts(lambda: Top(Skin()), sizes.UP5K)
    rows = []
    for units, sums in ((1, 0), (3, 1), (6, 0), (6, 4), (8, 4)):
        skin = Skin(units=units, unit_sums=tuple(row[:units] for row in WEIGHTS[:sums]))
        found = size.luts(functools.partial(Top, skin), sizes.UP5K)
        rows.append((str(units), str(sums), f"{found:,}", f"{found - reference:+}"))
    return writer.table(("units", "sums", "LUT4", "more"), map(writer.line, rows))


def boards_table() -> str:
    head = ("board", "FPGA", "clock", "sheet", "LUT4", "flip-flops", "block RAMs", "logic cells", "Fmax")
    lines = []
    for board in BOARDS.values():
        lines.append(board_row(board, board.skin))
        if board.name in EXAMPLES:
            lines.append(board_row(board, Skin.load(EXAMPLES[board.name])))
    return writer.table(head, lines)


def board_row(board: BoardSpec, skin: Skin) -> str:
    print(f"{board.title}, {skin.rows}x{skin.columns}: bitstream", file=sys.stderr)
    with tempfile.TemporaryDirectory(prefix=".sizes-", dir=Path.cwd()) as folder:  # these tools do not see /tmp
        found = build.build(skin, board, Path(folder))
    registers = [kind.upper() for kind in (skin.row_drive, skin.column_read) if kind != "direct"]
    fields = (
        board.title,
        board.fpga,
        f"{skin.clock_hz / 1e6:g} MHz",
        " ".join((f"{skin.rows}x{skin.columns}", *registers)),
        "{:,} of {:,}".format(*found.luts),
        f"{found.flip_flops:,}",
        "{} of {}".format(*found.block_rams),
        "{:,} of {:,}".format(*found.logic_cells) if found.logic_cells else "",
        f"{found.fmax_mhz:.1f} MHz",
    )
    return writer.line(fields)
