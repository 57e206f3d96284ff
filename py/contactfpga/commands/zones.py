"""`contactfpga zones`: the contact zones, live, as a table beside the drawn sheet, or as JSON."""

from __future__ import annotations

import argparse
import json

from contactfpga import driver
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
        table.add_row(str(zone.area_cells), f"{zone.area_mm2:g}", f"{zone.x_mm:.2f}", f"{zone.y_mm:.2f}")
    beside = Table.grid(padding=(0, 3))
    beside.add_row(Text(draw(zones)), table)
    return Group(beside, Text(status(board, zones)))


def status(board: driver.Board, zones: Zones) -> str:
    """The line below a frame: which one it is, and what went wrong so far."""
    stats = board.stats
    lost = f"{stats.lost} or more" if stats.gaps else str(stats.lost)
    parts = [
        f"{board.port}: frame at {zones.time_us / 1e6:.3f} s",
        f"{zones.pressed} cells pressed",
        *sorted(zones.flags - {"requested"}),
        f"{zones.stuck} columns stuck" if zones.stuck else "",
        f"{stats.frames} frames, {lost} lost, {stats.overwritten} overwritten, {stats.damaged.total()} damaged",
    ]
    return " · ".join(part for part in parts if part)
