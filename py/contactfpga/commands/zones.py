"""`contactfpga zones`: the contact zones, live, as a table beside the drawn sheet, or as JSON."""

from __future__ import annotations

import argparse
import json
from typing import TYPE_CHECKING

from contactfpga.console import drawn_sheet, terminal
from contactfpga.driver import driver
from contactfpga.errors import ContactFPGAError
from contactfpga.zones.zone import Zones

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.table import Table
    from rich.text import Text

    from contactfpga.commands.live import Room

BESIDE = 3
"""Characters between the sheet and the table."""


def main(args: argparse.Namespace) -> int:
    """Run the command."""
    if args.json:
        return _json(args)
    from contactfpga.commands import live  # rich, which scripts do without

    with live.connect(args, args.record) as board:
        return live.show(board, args, lambda zones, room: render(board, zones, room))


def _json(args: argparse.Namespace) -> int:
    with driver.open(args.port, args.skin, baud=args.baud, record=args.record, timeout=args.timeout) as board:
        for zones in board:
            print(json.dumps(zones.to_dict()), flush=True)
            if args.once:
                break
    return 0


def render(board: driver.Board, zones: Zones, room: Room) -> RenderableType:
    """One frame as rich shows it: the sheet as large as there is room for, the table beside it or below."""
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    below = status(board, zones, room.width)
    left = room.without(below.count("\n") + 1 + LEGEND_LINES)
    listed = table(zones, left.height)
    across = listed.__rich_measure__(room.console, room.console.options).maximum
    scale, beside = _layout(zones, left, across)
    drawing = drawn_sheet.draw(zones, scale, room.unicode, mask(board))
    shown: list[RenderableType]
    if beside:
        both = Table.grid(padding=(0, BESIDE))
        both.add_row(styled(drawing), listed)
        shown = [both]
    else:
        high = drawn_sheet.size(zones, scale)[1]
        shown = [styled(drawing), table(zones, left.without(high).height)]
    return Group(*shown, Text(terminal.wrapped(drawing.legend, room.width)), Text(below))


LEGEND_LINES = 2


def _layout(zones: Zones, room: Room, table_wide: int) -> tuple[int, bool]:
    """The scale of the drawing, and whether the table stands beside it. Beside it is better than large: it is read
    with the sheet, and stays in sight."""
    for scale in drawn_sheet.scales(zones, room.width - BESIDE - table_wide, room.height):
        if drawn_sheet.size(zones, scale)[0] + BESIDE + table_wide <= room.width:
            return scale, True
    return drawn_sheet.scales(zones, room.width, room.height)[0], False


def table(zones: Zones, lines: int | None = None) -> Table:
    """The zones, the first of them where there are lines for no more."""
    from rich.table import Table

    most = len(zones) if lines is None else max(1, lines - TABLE_LINES)
    left_out = len(zones) - most
    title = f"{zones.total_zones} zone" + ("" if zones.total_zones == 1 else "s")
    caption = f"and {left_out} more" if left_out > 0 else None
    made = Table(title=title, caption=caption)
    for heading in ("cells", "mm²", "x mm", "y mm"):
        made.add_column(heading, justify="right", no_wrap=True)
    for zone in zones[:most]:
        place = ("-" if length is None else f"{length:.2f}" for length in (zone.x_mm, zone.y_mm))
        made.add_row(str(zone.area_cells), f"{zone.area_mm2:g}", *place)
    return made


TABLE_LINES = 6
"""Of a table: title, head, rules and caption."""


def mask(board: driver.Board) -> drawn_sheet.Mask:
    """The switches that the board's Skin leaves out; none where only its hello is known."""
    try:
        return board.skin.mask
    except ContactFPGAError:
        return ()


def styled(drawing: drawn_sheet.Drawing) -> Text:
    """The drawing in its styles."""
    from rich.text import Text

    text = Text(no_wrap=True)
    for number, (characters, kinds) in enumerate(zip(drawing.characters, drawing.kinds.tolist())):
        if number:
            text.append("\n")
        for character, kind in zip(characters, kinds):
            text.append(character, drawn_sheet.STYLES[kind])
    return text


def status(board: driver.Board, zones: Zones, width: int) -> str:
    """The lines below a frame: which one it is, and what went wrong so far."""
    stats = board.stats
    parts = [
        f"{board.port}: frame at {zones.time_us / 1e6:.3f} s",
        f"{zones.pressed} cells pressed",
        *sorted(zones.flags - {"fault"}),
        *sorted(zones.faults),
        f"{stats.frames} frames, {stats.lost} lost, {stats.overwritten} overwritten, {stats.damaged.total()} damaged",
    ]
    return terminal.listed("", [part for part in parts if part], width, " · ")
