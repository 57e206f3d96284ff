"""Measures by place and route what README and boards page state of size and clock, and writes it there.

`make sizes` runs it: some 160 runs of place and route, an hour and more of one core unless they are kept from before.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from contactfpga.console import interrupt
from contactfpga.skin import Skin
from contactfpga_hdl.board import boards, build, sizes
from contactfpga_sim.pages import label_figures, writer
from contactfpga_sim.studies import size

EXAMPLES = {"icebreaker": Path("examples/icebreaker-64x64.toml")}
"""Sheets that the boards page shows beside the default ones."""


def gateware_table() -> str:
    """The whole design and the labeller alone, by sheet and device."""
    lines = [
        "| design | device | " + " | ".join(f"{lines}x{lines}" for lines in sizes.SIZES) + " |",
        "|---" * (2 + len(sizes.SIZES)) + "|",
    ]
    for name in sizes.DESIGNS:
        for device in sizes.DEVICES:
            cells = " | ".join(gateware_cell(name, device, lines) for lines in sizes.SIZES)
            lines.append(f"| {name} | {device.title} | {cells} |")
    return "\n".join(lines)


def gateware_cell(name: str, device: sizes.Device, lines: int) -> str:
    """LUT4, flip-flops, block RAMs and clock of a design."""
    print(f"{name}, {device.title}, {lines}x{lines}: {sizes.SEEDS} times place and route", file=sys.stderr)
    found = size.measure(lambda: sizes.DESIGNS[name](sizes.square(lines)), device)
    return f"{found.luts:,} / {found.flip_flops:,} / {found.block_rams}, {found.fmax_mhz:.0f} MHz"


class Published(NamedTuple):
    """The best public labeller at a sheet of so many rows and columns, measured with the same tools and settings."""

    clocks: int
    luts_and_mhz: tuple[tuple[int, int], ...]
    """For each of :data:`contactfpga_hdl.board.sizes.DEVICES`."""


LINK_RUN_CCA = {
    16: Published(38, ((622, 38), (435, 135))),
    32: Published(70, ((507, 43), (463, 120))),
    64: Published(134, ((610, 38), (582, 85))),
}
"""LinkRunCCA, VHDL: of five public labellers that were put through the same frames the only exact one."""


def labellers_table() -> str:
    """Our exact labellers beside the best public one: how late the last record is, LUT4 and clock."""
    lines = [
        "| sheet | labeller | last record behind the last row, worst | "
        + " | ".join(f"{device.title}: LUT4, clock" for device in sizes.DEVICES)
        + " |",
        "|---" * (3 + len(sizes.DEVICES)) + "|",
    ]
    for side, published in LINK_RUN_CCA.items():
        lines += [own_labeller_row(side, name) for name in ("run", "serial")]
        lines.append(labeller_row(side, "LinkRunCCA", published.clocks, published.luts_and_mhz))
    return "\n".join(lines)


def own_labeller_row(side: int, name: str) -> str:
    """One of our labellers on a square sheet."""
    clocks = label_figures.worst_last_record_clocks(Skin(rows=side, columns=side, labeller=name, settle_us=15.0))
    design = sizes.DESIGNS[f"labeller `{name}`"]
    found = [size.measure(lambda: design(sizes.square(side)), device) for device in sizes.DEVICES]
    return labeller_row(side, f"`{name}`", clocks, [(one.luts, one.fmax_mhz) for one in found])


def labeller_row(side: int, name: str, clocks: int, luts_and_mhz: Sequence[tuple[int, float]]) -> str:
    """A labeller on a square sheet."""
    fields = [f"{luts:,}, {mhz:.0f} MHz" for luts, mhz in luts_and_mhz]
    return f"| {side}x{side} | {name} | {clocks} clocks | {' | '.join(fields)} |"


def boards_table() -> str:
    """The sheets that the boards page names, each built for its board."""
    lines = [
        "| board | FPGA | clock | sheet | LUT4 | flip-flops | block RAMs | logic cells | Fmax |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for board in boards.BOARDS.values():
        lines.append(board_row(board, board.skin))
        if board.name in EXAMPLES:
            lines.append(board_row(board, Skin.load(EXAMPLES[board.name])))
    return "\n".join(lines)


def board_row(board: boards.BoardSpec, skin: Skin) -> str:
    """What the bitstream of a Skin takes of the board's FPGA."""
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
    return f"| {' | '.join(fields)} |"


TABLES: dict[str, Callable[[], str]] = {
    "gateware": gateware_table,
    "labellers": labellers_table,
    "boards": boards_table,
}


if __name__ == "__main__":
    sys.exit(interrupt.guarded(lambda: writer.main(TABLES)))
