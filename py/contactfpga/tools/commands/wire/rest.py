"""`contactfpga wire --rest`: the rest level of each resistive cell, and the lightest level that holds."""

from __future__ import annotations

import argparse
from typing import Any

from contactfpga import terminal
from contactfpga.driver.board import Board
from contactfpga.errors import ContactFPGAError
from contactfpga.instruments.rest import NEVER, Rest
from contactfpga.skin import Skin
from contactfpga.tools.commands.wire.bounce import NAMED, bare_skin
from contactfpga.tools.commands.wire.settle import restored
from contactfpga.tools.console import interrupt, results


def measure(board: Board, args: argparse.Namespace) -> int:
    """Measure once, and then follow the drift for ``args.seconds`` of device time; returns 1 if a level is too high."""
    skin = bare_skin(board, "what one frame shows")
    if not skin.ruler:
        raise ContactFPGAError(f"{board.port} has switches, which have no rest level; --rest needs a Skin with a ruler")
    if not args.json:
        terminal.say(f"Leave {board.port} untouched until its rest levels are known.")
    rest, end = Rest((skin.rows, skin.columns)), []
    with interrupt.usual_end():
        try:
            while (level := rest.next_level()) is not None:
                rest.take(level, board.sample_at(level, args.timeout).cells)
            _follow(board, rest, args)
        finally:
            end = restored(board, args.timeout)
    high = rest.high(skin.ruler)
    results.show(args, _answer(rest, skin, high) | {"findings": end}, lambda: _show(rest, skin, high))
    return 1 if rest.lightest is not None and rest.lightest < skin.ruler else 0


def _follow(board: Board, rest: Rest, args: argparse.Namespace) -> None:
    begun_us: int | None = None
    while args.seconds is not None:
        zones = board.sample_at(0, args.timeout)
        begun_us = zones.time_us if begun_us is None else begun_us
        if zones.time_us - begun_us >= args.seconds * 1e6:
            return
        if rest.quiet(bool(zones.cells.any()), zones.time_us):
            level = rest.probe()
            rest.renew(level, board.sample_at(level, args.timeout).cells)


def _answer(rest: Rest, skin: Skin, high: list[tuple[int, int]]) -> dict[str, Any]:
    levels = [[None if level >= NEVER else round(level, 2) for level in row] for row in rest.levels.tolist()]
    return {"ruler": skin.ruler, "lightest": rest.lightest, "levels": levels, "high": high}


def _show(rest: Rest, skin: Skin, high: list[tuple[int, int]]) -> None:
    if rest.lightest is None:
        terminal.say("No cell reads pressed without a touch at any level: the end of settle_us is the lightest.")
    elif rest.lightest < skin.ruler:
        terminal.say(f"ruler = {skin.ruler} is too light for this sheet at rest; ruler = {rest.lightest} would hold.")
    else:
        terminal.say(f"ruler = {skin.ruler} holds; the lightest level that does is ruler = {rest.lightest}.")
    if high:
        named = ", ".join(f"{cell} from {rest.levels[cell]:.0f}" for cell in high[:NAMED])
        terminal.say(f"high at rest: {named}{', ...' if len(high) > NAMED else ''}; a preload, or a leak", hang=2)
