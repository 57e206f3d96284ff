"""`contactfpga zones`: the contact zones, live, as a table beside the drawn sheet, or as JSON."""

from __future__ import annotations

import argparse
import json

from contactfpga import driver
from contactfpga.errors import ContactFPGAError
from contactfpga.zone import Zones


def main(args: argparse.Namespace) -> int:
    """Run the command."""
    if args.json:
        return _json(args)
    from contactfpga.commands import live  # rich, which scripts do without

    with live.connect(args, args.record) as board:
        return live.show(board, args, lambda zones: render(board, zones))


def _json(args: argparse.Namespace) -> int:
    with driver.open(args.port, args.skin, baud=args.baud, record=args.record, timeout=args.timeout) as board:
        for zones in board:
            print(json.dumps(zones.to_dict()), flush=True)
            if args.once:
                break
    return 0


def render(board: driver.Board, zones: Zones):  # type: ignore[no-untyped-def]
    """One frame as rich shows it."""
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    from contactfpga.commands.sheet import draw

    title = f"{zones.total_zones} zone" + ("" if zones.total_zones == 1 else "s")
    table = Table("cells", "mm²", "x mm", "y mm", title=title)
    for zone in zones:
        place = ("-" if length is None else f"{length:.2f}" for length in (zone.x_mm, zone.y_mm))
        table.add_row(str(zone.area_cells), f"{zone.area_mm2:g}", *place)
    beside = Table.grid(padding=(0, 3))
    beside.add_row(Text(draw(zones, mask(board))), table)
    return Group(beside, Text(status(board, zones)))


def mask(board: driver.Board) -> tuple[tuple[int, int], ...]:
    """The switches that the board's Skin leaves out; none where only its hello is known."""
    try:
        return board.skin.mask
    except ContactFPGAError:
        return ()


def status(board: driver.Board, zones: Zones) -> str:
    """The line below a frame: which one it is, and what went wrong so far."""
    stats = board.stats
    parts = [
        f"{board.port}: frame at {zones.time_us / 1e6:.3f} s",
        f"{zones.pressed} cells pressed",
        *sorted(zones.flags - {"fault"}),
        *sorted(zones.faults),
        f"{stats.frames} frames, {stats.lost} lost, {stats.overwritten} overwritten, {stats.damaged.total()} damaged",
    ]
    return " · ".join(part for part in parts if part)
