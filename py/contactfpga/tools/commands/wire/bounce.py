"""`contactfpga wire --bounce`: bounce times of a board's switches, and the debounce that hides them."""

from __future__ import annotations

import argparse
import dataclasses
from typing import Any

import numpy as np

from contactfpga import terminal
from contactfpga.choices import debounces
from contactfpga.driver.board import Board
from contactfpga.driver.health import Finding
from contactfpga.errors import ContactFPGAError
from contactfpga.instruments.bounce import QUIET_US, Bounce
from contactfpga.skin import Skin
from contactfpga.tools.console import flags, live, results
from contactfpga.zones.zone import Zones

SHARES = (50, 90, 99, 100)
"""Percentiles of press and release durations."""

MANY = 0.05
"""Share of overwritten frames that is reported."""

NAMED = 8


def measure(board: Board, args: argparse.Namespace) -> int:
    """Measure for ``args.seconds`` or until Ctrl-C; returns 1 if nothing was measured."""
    skin = bare_skin(board, "the bounce")
    bounce = Bounce(board.hello.send == "on_change")
    if not args.json:
        terminal.say(f"Press and release every switch of {board.port} some times. Ctrl-C ends the measurement.")

    def render(zones: Zones, room: Any) -> Any:
        from contactfpga.tools.console import views  # rich, which scripts do without

        return views.cells_view(board, zones, room)

    seconds, end = live.follow(board, args, bounce.update, None if args.json else render)
    bounce.finish()
    end += _overwritten(board)
    results.show(args, _answer(bounce, seconds, end), lambda: _show(bounce, skin, end))
    return 0 if bounce.bounced else 1


def bare_skin(board: Board, hidden: str) -> Skin:
    skin = flags.known_skin(board)
    if skin is None:
        raise ContactFPGAError(
            f"{board.port}: a hello does not tell whether the board debounces, which would hide {hidden}; give the "
            "Skin that it was built from: --skin FILE"
        )
    if debounces.find(skin.debounce).gateware:
        raise ContactFPGAError(
            f"{board.port} debounces ({skin.debounce!r}), which hides {hidden}; build a bitstream from the same Skin "
            'with debounce = "none" for this measurement'
        )
    return skin


def _overwritten(board: Board) -> list[Finding]:
    stats = board.stats
    share = stats.overwritten / max(1, stats.overwritten + stats.frames)
    if share < MANY:
        return []  # hellos take a frame's place now and then
    slow = (
        f"{100 * share:.0f} % of the frames were overwritten, as the line is slower than the scan; a higher baud helps"
    )
    return [Finding("note", slow)]


def _shares(bounce: Bounce, pressed: bool) -> dict[str, float] | None:
    times_us = bounce.times_us(pressed)
    if not len(times_us):
        return None
    # Those that were measured, none between two of them.
    values = np.percentile(times_us, SHARES, method="inverted_cdf")
    return {f"{share} %": float(value) for share, value in zip(SHARES, values)}


def _answer(bounce: Bounce, seconds: float, end: list[Finding]) -> dict[str, Any]:
    proposal = bounce.proposal()
    return {
        "seconds": seconds,
        "presses": len(bounce.times_us(True)),
        "releases": len(bounce.times_us(False)),
        "blips": len(bounce.blips),
        "resolution_us": bounce.resolution_us,
        "press_us": _shares(bounce, True),
        "release_us": _shares(bounce, False),
        "cells": [{"cell": cell, "longest_us": us} for cell, us in bounce.longest().items()],
        "slow": list(bounce.slow()),
        "proposal": proposal,
        "findings": end,
    }


def _show(bounce: Bounce, skin: Skin, end: list[Finding]) -> None:
    for finding in end:
        terminal.say(f"{finding.verdict:5} {finding.sentence}", hang=6)
    if not bounce.bounced:
        terminal.say(f"No press and no release ended; a switch must rest for {QUIET_US // 1000} ms after it.")
        return
    for pressed, word in ((True, "presses"), (False, "releases")):
        found = _shares(bounce, pressed)
        if found is not None:
            shown = ", ".join(f"{share} within {us / 1000:.2f} ms" for share, us in found.items())
            terminal.say(f"{len(bounce.times_us(pressed))} {word}: {shown}", hang=2)
    switches = len(bounce.longest())
    terminal.say(f"{switches} of {skin.rows * skin.columns - len(skin.mask)} switches were used.")
    resolution_ms = bounce.resolution_us / 1000
    terminal.say(
        f"Frames come {resolution_ms:.3f} ms apart: a shorter bounce may be missed, and each time may be up to "
        f"{2 * resolution_ms:.3f} ms longer.",
        hang=2,
    )
    slow = [f"({row}, {column}) {us / 1000:.2f} ms" for (row, column), us in bounce.slow().items()]
    if slow:
        terminal.say(f"{len(slow)} slow: {', '.join(slow[:NAMED])}{', ...' if len(slow) > NAMED else ''}", hang=2)
    if bounce.blips:
        what = f"{len(bounce.blips)} changes were undone within {QUIET_US // 1000} ms: touches as short, or noise."
        terminal.say(f'{what} If it is noise, take debounce = "sym_defer_pk" with the same times.', hang=2)
    _propose(bounce, skin)


def _propose(bounce: Bounce, skin: Skin) -> None:
    proposal = bounce.proposal()
    if proposal is None:
        terminal.say('No switch was seen to bounce: debounce = "none" will do.')
        return
    try:
        skin.replace(**dataclasses.asdict(proposal))
    except ContactFPGAError as error:
        terminal.say(f"No debounce of this Skin lasts that long: {error}", hang=2)
        return
    terminal.say(f"Proposed, twice the longest that was seen and what frames may have missed:\n{proposal.lines}")
