"""`contactfpga wire --rest`: the rest level of each resistive cell, and the lightest level that holds."""

from __future__ import annotations

import argparse

import numpy as np

from contactfpga import terminal
from contactfpga.driver.board import Board
from contactfpga.errors import ContactFPGAError
from contactfpga.instruments.rest import NEVER, Rest
from contactfpga.tools.commands.wire.bounce import NAMED, bare_skin
from contactfpga.tools.commands.wire.settle import restored
from contactfpga.tools.console import interrupt, results
from contactfpga.zones.zone import Zones


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
            _search(board, rest, args.timeout)
            if args.seconds is not None:
                _follow(board, rest, args.seconds, args.timeout)
        finally:
            end = restored(board, args.timeout)
    if rest.next_level() is not None:
        raise ContactFPGAError(f"{board.port}: stopped before all rest levels were known; leave it running for longer")
    high, lightest = rest.high(skin.ruler), rest.lightest
    levels = [[None if level >= NEVER else round(level, 2) for level in row] for row in rest.levels.tolist()]
    answer = {"ruler": skin.ruler, "lightest": lightest, "levels": levels, "high": high, "findings": end}
    results.show(args, answer, lambda: _show(rest, skin.ruler, high))
    return 1 if lightest is not None and lightest < skin.ruler else 0


def levels(board: Board, timeout: float) -> Rest:
    """The least sample at which each cell reads pressed under what now lies on the sheet."""
    rest = Rest((board.skin.rows, board.skin.columns))
    try:
        _search(board, rest, timeout)
    finally:
        restored(board, timeout)
    return rest


def _search(board: Board, rest: Rest, timeout: float) -> None:
    for harder in range(2, board.sheet.levels + 1):
        board.sample_at(1, timeout, level=harder)  # so early that the lightest level alone decides what reads pressed
    while (level := rest.next_level()) is not None:
        rest.take(level, _cells(board.sample_at(level, timeout)))


def _follow(board: Board, rest: Rest, seconds: float, timeout: float) -> None:
    zones = board.sample_at(0, timeout)
    end_us = zones.time_us + seconds * 1e6
    while zones.time_us < end_us:
        if rest.quiet(bool(_cells(zones).any()), zones.time_us):
            level = rest.probe()
            rest.renew(level, _cells(board.sample_at(level, timeout)))
        zones = board.sample_at(0, timeout)


def _cells(zones: Zones) -> np.ndarray:
    assert zones.cells is not None, "a bare Skin reports cells"
    return zones.cells


def _show(rest: Rest, ruler: int, high: list[tuple[int, int]]) -> None:
    if rest.lightest is None:
        terminal.say("No cell reads pressed without a touch at any level: the end of settle_us is the lightest.")
    else:
        holds = "holds" if rest.lightest >= ruler else "is too light for this sheet at rest"
        terminal.say(f"ruler = {ruler} {holds}; the lightest level that holds is ruler = {rest.lightest}.")
    if high:
        named = ", ".join(f"{cell} from {rest.levels[cell]:.0f}" for cell in high[:NAMED])
        terminal.say(f"high at rest: {named}{', ...' if len(high) > NAMED else ''}; a preload, or a leak", hang=2)
