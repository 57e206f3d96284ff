"""Frames in rich: the sheet as large as fits, and further knowledge."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from contactfpga import terminal
from contactfpga.driver.board import Board
from contactfpga.errors import ContactFPGAError, MissingExtra
from contactfpga.instruments.watch import Watch
from contactfpga.robot.haptics import Contact, Contacts
from contactfpga.tools.console import drawn_sheet
from contactfpga.tools.console.forces import Forces
from contactfpga.tools.console.live import Room
from contactfpga.tracking.tracks import Track, Tracks
from contactfpga.zones.zone import Zones

BESIDE = 3

LEGEND_LINES = 2

TABLE_LINES = 6

SUSPECTED = 4

NAMED = 12


def zones_view(
    board: Board, zones: Zones, room: Room, tracks: Tracks | None = None, forces: Forces | None = None
) -> RenderableType:
    """The sheet, with the table of its zones beside or below; ``tracks`` add contact ids, ``forces`` pushes."""
    said = () if forces is None else forces.sentences()
    below = status(board, zones, room.width, said)
    left = room.without(below.count("\n") + 1 + LEGEND_LINES)
    found = None if forces is None else forces.contacts
    listed = table(zones, left.height, tracks, found)
    across = listed.__rich_measure__(room.console, room.console.options).maximum
    scale, beside = _layout(zones, left, across)
    drawing = drawn_sheet.draw(zones, scale, room.unicode, _mask(board))
    shown: list[RenderableType]
    if beside:
        both = Table.grid(padding=(0, BESIDE))
        both.add_row(styled(drawing), listed)
        shown = [both]
    else:
        high = drawn_sheet.size(zones, scale)[1]
        shown = [styled(drawing), table(zones, left.without(high).height, tracks, found)]
    return Group(*shown, Text(terminal.wrapped(drawing.legend, room.width)), Text(below))


def watch_view(board: Board, watch: Watch, suspected: list[str], zones: Zones, room: Room) -> RenderableType:
    """The sheet with a watch's knowledge of its switches, and the newest suspicions."""
    count = f"{len(watch.never)} switches never pressed so far" if watch.seen is not None else "zones only"
    below = "\n".join([*suspected[-SUSPECTED:], count, status(board, zones, room.width)])
    below = "\n".join(terminal.wrapped(line, room.width, 2) for line in below.split("\n"))
    left = room.without(below.count("\n") + 1 + LEGEND_LINES)
    scale = drawn_sheet.scales(zones, left.width, left.height)[0]
    drawing = drawn_sheet.draw(zones, scale, room.unicode, _mask(board), _marks(watch))
    return Group(styled(drawing), Text(terminal.wrapped(drawing.legend, room.width)), Text(below))


def _marks(watch: Watch) -> drawn_sheet.Marks | None:
    if watch.seen is None:
        return None
    marked = []
    for cells in (watch.fluttering, watch.stuck):
        marks = np.zeros_like(watch.seen)
        for row, column in cells:
            marks[row, column] = True
        marked.append(marks)
    return drawn_sheet.Marks(watch.seen, *marked)


def cells_view(board: Board, zones: Zones, room: Room) -> RenderableType:
    """The sheet of a board that sends cells, with the places of pressed cells below."""
    assert zones.cells is not None
    places = [f"({row}, {column})" for row, column in zip(*zones.cells.nonzero())]
    named = [*places[:NAMED], *([f"and {len(places) - NAMED} more"] if len(places) > NAMED else [])]
    pressed = terminal.listed("pressed (row, column): ", named or ["none"], room.width)
    below = f"{pressed}\n{status(board, zones, room.width)}"
    left = room.without(below.count("\n") + 1 + LEGEND_LINES)
    scale = drawn_sheet.scales(zones, left.width, left.height)[0]
    drawing = drawn_sheet.draw(zones, scale, room.unicode, _mask(board))
    return Group(styled(drawing), Text(terminal.wrapped(drawing.legend, room.width)), Text(below))


def _layout(zones: Zones, room: Room, table_wide: int) -> tuple[int, bool]:
    for scale in drawn_sheet.scales(zones, room.width - BESIDE - table_wide, room.height):
        if drawn_sheet.size(zones, scale)[0] + BESIDE + table_wide <= room.width:
            return scale, True
    return drawn_sheet.scales(zones, room.width, room.height)[0], False


def table(
    zones: Zones, lines: int | None = None, tracks: Tracks | None = None, contacts: Contacts | None = None
) -> Table:
    """The zones, as many as there are lines for; contacts with places at these."""
    most = len(zones) if lines is None else max(1, lines - TABLE_LINES)
    left_out = len(zones) - most
    title = f"{zones.total_zones} zone" + ("" if zones.total_zones == 1 else "s")
    caption = f"and {left_out} more" if left_out > 0 else None
    made = Table(title=title, caption=caption)
    ids = {} if tracks is None else {id(track.zone): _names(track) for track in tracks.active}
    places = {} if tracks is None else {id(one.zone): one.place_mm for one in tracks.active if one.place_mm}
    pushes = _pushes(zones, contacts)
    before, after = [] if tracks is None else ["id"], [] if contacts is None else ["N", "from", "to"]
    for heading in (*before, "cells", "mm²", "x mm", "y mm", *after):
        made.add_column(heading, justify="right", no_wrap=True)
    for zone, push in list(zip(zones, pushes))[:most]:
        x, y = ("-" if length is None else f"{length:.2f}" for length in places.get(id(zone), (zone.x_mm, zone.y_mm)))
        name = [] if tracks is None else [ids.get(id(zone), "-")]
        made.add_row(*name, str(zone.area_cells), f"{zone.area_mm2:g}", zone.winding or x, y, *push)
    return made


def _pushes(zones: Zones, contacts: Contacts | None) -> list[tuple[str, ...]]:
    if contacts is None:
        return [()] * len(zones)
    left, found = iter(contacts), []
    for zone in zones:
        one = None if zone.point_mm is None else next(left)
        low, high = (None, None) if one is None else _interval(one)
        numbers = (None if one is None else one.normal_n, low, high)
        found.append(tuple("-" if number is None else f"{number:.2f}" for number in numbers))
    return found


def _interval(contact: Contact) -> tuple[float | None, float | None]:
    try:
        return contact.interval_n or (None, None)
    except MissingExtra:
        return None, None


def _names(track: Track) -> str:
    return "+".join(map(str, (track.id, *track.merged)))


def _mask(board: Board) -> drawn_sheet.Mask:
    try:
        return board.skin.mask
    except ContactFPGAError:
        return ()


def styled(drawing: drawn_sheet.SheetDrawing) -> Text:
    text = Text(no_wrap=True)
    for number, (characters, kinds) in enumerate(zip(drawing.characters, drawing.kinds.tolist())):
        if number:
            text.append("\n")
        for character, kind in zip(characters, kinds):
            text.append(character, drawn_sheet.STYLES[kind])
    return text


def status(board: Board, zones: Zones, width: int, said: Iterable[str] = ()) -> str:
    """The lines below a frame: its number, errors so far, and remarks."""
    stats = board.stats
    parts = [
        f"{board.port}: frame at {zones.time_us / 1e6:.3f} s",
        f"{zones.pressed} cells pressed",
        *sorted(zones.flags - {"fault"}),
        *sorted(zones.faults),
        *said,
        f"{stats.frames} frames, {stats.lost} lost, {stats.overwritten} overwritten, {stats.damaged.total()} damaged",
    ]
    return terminal.listed("", [part for part in parts if part], width, " · ")
