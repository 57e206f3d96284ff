"""`contactfpga doctor --watch`: follows a board while somebody touches everything, and says what does not work."""

from __future__ import annotations

import argparse
import json
from typing import Any

import numpy as np

from contactfpga.driver.health import Finding
from contactfpga.skin import Skin
from contactfpga.tools.console import flags, terminal
from contactfpga.tools.console.following import follow, known_skin
from contactfpga.zones.suspicion import Cell, Suspicion, named
from contactfpga.zones.watch import Watch
from contactfpga.zones.zone import Zones

FAULTS = ("stuck", "flutter")
"""Kinds of suspicion that are no note: it takes more than a hand to bring them about."""

STUCK_S = 10.0
"""After which a pressed switch that does not change is told, where the user names no time."""

ZONES_ONLY = (
    'the board sends zones, so dead and loose switches cannot be told; for these set report = "cells" in the Skin\'s '
    "file, then `contactfpga build BOARD --skin FILE` and `contactfpga flash BOARD`"
)


def run(args: argparse.Namespace) -> int:
    """Watch for ``args.seconds`` or until Ctrl-C; status 1 when a switch is stuck, loose or never read pressed."""
    with flags.opened(args) as board:
        skin = known_skin(board)
        watch = Watch(skin, stuck_s=args.stuck_s or STUCK_S)
        found: list[Suspicion] = []
        silent = args.json or terminal.of().live
        if not args.json:
            terminal.say(f"Touch every switch of {board.port}, and then nothing. Ctrl-C ends the watch.")

        def take(zones: Zones) -> None:
            for suspicion in watch.update(zones):
                found.append(suspicion)
                if not silent:
                    terminal.say(_line(_judged(suspicion)), hang=6)

        def render(zones: Zones, room: Any) -> Any:
            from contactfpga.tools.console import views  # rich, which scripts do without

            return views.watch_view(board, watch, [_line(_judged(one)) for one in found], zones, room)

        seconds, end = follow(board, args, take, None if args.json else render)
        findings = [*map(_judged, found), *_coverage(watch), *_unknown(skin), *end]
    mask_line = watch.mask_line
    faults = sum(finding.verdict == "fault" for finding in findings)
    if args.json:
        print(json.dumps(_answer(watch, findings, seconds, faults)), flush=True)
        return min(faults, 1)
    for finding in findings if terminal.of().live else findings[len(found) :]:
        terminal.say(_line(finding), hang=6)
    if mask_line:
        where = "in the Skin's file" if skin is not None else "in the Skin's file, beside the cells that are there"
        terminal.say(f"To go on without what is stuck, put this line {where}, and build again:\n{mask_line}")
    return min(faults, 1)


def _judged(suspicion: Suspicion) -> Finding:
    return Finding("fault" if suspicion.kind in FAULTS else "note", suspicion.sentence)


def _line(finding: Finding) -> str:
    return f"{finding.verdict:5} {finding.sentence}"


def _coverage(watch: Watch) -> list[Finding]:
    seen, never = watch.seen, watch.never
    if seen is None:
        return [Finding("note", ZONES_ONLY)]
    if not seen.any():
        return [Finding("fault", "no switch read pressed; was the sheet touched?")]
    if never:
        return [Finding("fault", f"{_dark(seen, never)} never read pressed: not touched, or dead")]
    return [Finding("ok", "every switch read pressed at least once")]


def _unknown(skin: Skin | None) -> list[Finding]:
    if skin is not None:
        return []
    return [Finding("note", "the mask of this board is not known, so absent switches look dead; give --skin FILE")]


def _dark(seen: np.ndarray, never: tuple[Cell, ...]) -> str:
    """Whole lines first: these are broken wires rather than dead switches."""
    rows = sorted({row for row, _ in never if not seen[row].any()})
    columns = sorted({column for _, column in never if not seen[:, column].any()})
    left = [(row, column) for row, column in never if row not in rows and column not in columns]
    lines = [f"{word} {line}" for word, found in (("row", rows), ("column", columns)) for line in found]
    return ", ".join([*lines, *([named(left)] if left else [])])


def _answer(watch: Watch, findings: list[Finding], seconds: float, faults: int) -> dict[str, Any]:
    seen = watch.seen
    return {
        "faults": faults,
        "findings": [finding._asdict() for finding in findings],
        "seconds": seconds,
        "seen": None if seen is None else [[int(cell) for cell in row] for row in seen],
        "never": watch.never,
        "stuck": watch.stuck,
        "fluttering": watch.fluttering,
        "mask": watch.mask,
        "mask_line": watch.mask_line,
    }
