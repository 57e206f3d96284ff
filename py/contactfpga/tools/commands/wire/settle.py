"""`contactfpga wire --settle`: the time of each cell to read pressed, and a sufficient settle time."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from contactfpga import terminal
from contactfpga.design.circuit.times import MARGIN, Time
from contactfpga.driver.board import Board
from contactfpga.driver.health import Finding
from contactfpga.errors import ContactFPGAError, NoSuchCommand, PortLost, ReadTimeout
from contactfpga.instruments.settling import Settling
from contactfpga.skin import Skin
from contactfpga.tools.commands.wire.bounce import NAMED, bare_skin
from contactfpga.tools.console import interrupt, live, results
from contactfpga.tools.console.drawn_sheet import CELL, FREE, MASKED, STUCK, Mask, SheetDrawing
from contactfpga.zones.zone import Zones

if TYPE_CHECKING:
    from rich.console import RenderableType

STEPS = 10


def measure(board: Board, args: argparse.Namespace) -> int:
    """Measure for ``args.seconds`` of device time or until Ctrl-C; returns 1 if nothing was measured."""
    skin = bare_skin(board, "what one frame shows")
    found = settling(board, skin)
    board.sample_at(0, args.timeout)  # refuses what cannot be measured before anything is asked of the user
    if not args.json:
        terminal.say(
            f"Press every place of {board.port} for a moment, or lay a plate on the sheet. Ctrl-C ends the measurement."
        )

    render = None if args.json else lambda _, room: _view(found, skin, room)
    seconds, end = follow(board, found, args.timeout, args.seconds, render)
    results.show(args, _answer(found, skin, seconds, end), lambda: _show(found, skin, end))
    return 0 if (found.clocks > 0).any() else 1


def settling(board: Board, skin: Skin) -> Settling:
    if skin.ruler:
        raise ContactFPGAError(f"{board.port} has resistive cells, whose times follow the force; take --rest")
    derived = skin.derived
    first, settle = derived.first_sample_clocks, derived.settle_clocks
    if settle <= first:
        raise ContactFPGAError(
            f"{board.port}: a row is driven for {settle} clocks, and its columns cannot be sampled before {first}; "
            "build a bitstream from the same Skin with a longer settle_us for this measurement"
        )
    return Settling((skin.rows, skin.columns), first, settle, skips=skin.reads_rows, guard=skin.guard)


def follow(
    board: Board,
    found: Settling,
    timeout: float,
    seconds: float | None = None,
    render: live.Render | None = None,
    enough: Callable[[], bool] = lambda: False,
) -> tuple[float, list[Finding]]:
    """Measure for this device time, until it is ``enough`` or until Ctrl-C, and restore the board; returns the seconds
    taken and findings about the end. ``timeout`` in s, of each frame.
    """
    findings: list[Finding] = []
    zones, past_us = board.sample_at(0, timeout), 0
    found.start(_cells(zones))
    with live.shown(render) as show:
        try:
            with interrupt.usual_end():
                while (seconds is None or past_us < seconds * 1e6) and not enough():
                    clocks, before = found.next_clocks(), zones
                    if clocks is None:
                        zones = board.sample_at(0, timeout)
                        found.start(_cells(zones))
                    else:
                        early = board.sample_at(clocks, timeout)
                        zones = board.sample_at(0, timeout)
                        found.take(clocks, _cells(early), _cells(zones))
                    past_us += max(0, zones.time_us - before.time_us)  # a board that starts again begins at 0
                    show(zones)
        except (PortLost, ReadTimeout, NoSuchCommand) as error:  # what was found is worth having all the same
            findings.append(Finding("fault", str(error)))
        finally:
            findings += restored(board, timeout)
    return past_us / 1e6, findings


def _cells(zones: Zones) -> np.ndarray:
    assert zones.cells is not None
    return zones.cells


def restored(board: Board, timeout: float) -> list[Finding]:
    """Sample as the Skin says again; returns a finding if that failed."""
    for _ in range(2):  # somebody who presses Ctrl-C twice shall not keep it from that
        with interrupt.usual_end():
            try:
                for level in range(1, board.sheet.levels + 1):
                    board.sample_at(0, timeout, level=level)
                return []
            except ContactFPGAError:
                break
    left = (
        f"{board.port} may still sample at other instants than its Skin states, so that cells read wrongly; switch it "
        "off and on, or run this command again"
    )
    return [Finding("fault", left)]


def _answer(found: Settling, skin: Skin, seconds: float, end: list[Finding]) -> dict[str, Any]:
    per_us, slow = skin.derived.clocks_per_us, found.slow()
    clocks = [[int(cell) or None for cell in row] for row in found.clocks]
    return {
        "seconds": seconds,
        "clock_hz": skin.clock_hz,
        "settle_clocks": found.settle,
        "first_clocks": found.first,
        "clocks": clocks,
        "us": [[None if cell is None else cell / per_us for cell in row] for row in clocks],
        "median_clocks": found.median,
        "slow": {"cells": slow.cells, "rows": slow.rows, "columns": slow.columns},
        "back_clocks": [int(column) or None for column in found.back_clocks],
        "proposal": None if (settle_us := _proposed_us(found, skin)) is None else {"settle_us": settle_us},
        "findings": end,
    }


def _proposed_us(found: Settling, skin: Skin) -> float | None:
    longest = int(found.clocks.max())
    return Time(longest / skin.clock_hz, "").us(MARGIN) if longest else None


def _show(found: Settling, skin: Skin, end: list[Finding]) -> None:
    for finding in end:
        terminal.say(f"{finding.verdict:5} {finding.sentence}", hang=6)
    known, per_us = found.clocks[found.clocks > 0], skin.derived.clocks_per_us
    if not len(known):
        terminal.say("Nothing was measured: no cell read pressed for long enough at the full settle time.")
        return
    place = terminal.of()
    drawing = drawn(found, per_us, skin.mask, 2 * skin.columns <= place.width, place.unicode)
    print(drawing.text)
    terminal.say(drawing.legend)
    terminal.say(
        f"{len(known)} of {skin.rows * skin.columns - len(skin.mask)} cells measured: "
        f"{_span(known.min(), found, per_us)} at least, {found.median / per_us:.2f} us the median, "
        f"{known.max() / per_us:.2f} us at most.",
        hang=2,
    )
    _show_slow(found, per_us)
    _show_back(found, per_us)
    _propose(found, skin)


def _span(clocks: int, found: Settling, per_us: int) -> str:
    return f"{'up to ' if clocks == found.first else ''}{clocks / per_us:.2f} us"


def _show_slow(found: Settling, per_us: int) -> None:
    slow = found.slow()
    if 2 * len(slow.cells) > (found.clocks > 0).sum():
        terminal.say("Most cells take nearly the whole settle time: it is short for this sheet.")
        return
    for kind, lines in (("row", slow.rows), ("column", slow.columns)):
        if lines:
            named = ", ".join(map(str, lines[:NAMED])) + (", ..." if len(lines) > NAMED else "")
            terminal.say(f"slow {kind}{'s' * (len(lines) > 1)} {named}: a long or thin line, or a weak pin", hang=2)
    alone = [cell for cell in slow.cells if cell[0] not in slow.rows and cell[1] not in slow.columns]
    if alone:
        times = [f"({row}, {column}) {found.clocks[row, column] / per_us:.2f} us" for row, column in alone[:NAMED]]
        what = f"slow cells {', '.join(times)}{', ...' if len(alone) > NAMED else ''}: contacts of high resistance"
        terminal.say(what, hang=2)


def _show_back(found: Settling, per_us: int) -> None:
    late = np.flatnonzero(found.back_clocks > found.first).tolist()
    if late:
        named = [f"{column} ({found.back_clocks[column] / per_us:.2f} us)" for column in late[:NAMED]]
        what = (
            f"slow to come back: columns {', '.join(named)}{', ...' if len(late) > NAMED else ''} after the next row's"
        )
        terminal.say(f"{what} selection; a longer release_us, precharge_us or a stronger pull helps", hang=2)


def _propose(found: Settling, skin: Skin) -> None:
    settle_us = _proposed_us(found, skin)
    assert settle_us is not None
    if settle_us > skin.settle_us:
        terminal.say(f"The Skin's {skin.settle_us:g} us leave too little room.")
    try:
        skin.replace(settle_us=settle_us)
    except ContactFPGAError as error:
        terminal.say(
            f"{settle_us:g} us would be enough for the sheet, but not for the rest of this Skin: {error}", hang=2
        )
        return
    terminal.say(f"Proposed, {MARGIN:g} times the longest of the measured cells:\nsettle_us = {settle_us:g}")


def _view(found: Settling, skin: Skin, room: live.Room) -> RenderableType:
    from rich.console import Group
    from rich.text import Text

    from contactfpga.tools.console import views  # rich, which scripts do without

    wide = 2 * skin.columns <= room.width
    drawing = drawn(found, skin.derived.clocks_per_us, skin.mask, wide, room.unicode)
    known = int((found.clocks > 0).sum())
    below = f"{drawing.legend}\n{known} of {skin.rows * skin.columns - len(skin.mask)} cells measured"
    return Group(views.styled(drawing), Text(terminal.wrapped(below, room.width)))


def drawn(
    found: Settling, clocks_per_us: int, mask: Mask = (), wide: bool = True, unicode: bool = True
) -> SheetDrawing:
    """The sheet, row 0 on top. Digit d: the cell reads pressed after d to d + 1 tenths of the settle time. Slow cells
    have the kind STUCK. ``wide``: with spaces between cells.
    """
    clocks, free = found.clocks, "·" if unicode else "."
    digits = np.array([str(digit) for digit in range(STEPS)])
    shown = np.where(clocks > 0, digits[np.maximum(clocks - 1, 0) * STEPS // found.settle], free)
    kinds = np.where(clocks > 0, CELL, FREE)
    for row, column in found.slow().cells:
        kinds[row, column] = STUCK
    for row, column in mask:
        shown[row, column], kinds[row, column] = " ", MASKED
    if wide:
        rows, columns = shown.shape
        spaced, of = np.full((rows, 2 * columns), " "), np.full((rows, 2 * columns), FREE)
        spaced[:, ::2], of[:, ::2] = shown, kinds
        shown, kinds = spaced, of
    legend = (
        f"d: reads pressed after d to d + 1 tenths of the settle time of {found.settle} clocks "
        f"({found.settle / clocks_per_us:g} us); {free} not measured"
    )
    return SheetDrawing(shown, kinds, legend + ("; blank: no switch" if tuple(mask) else ""))
