"""`contactfpga doctor --self-test`: tests a board's lines again and again while somebody presses the switches."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator

from contactfpga.driver.board import Board
from contactfpga.driver.health import Finding
from contactfpga.tools.console import flags, interrupt, terminal
from contactfpga.zones.self_test import LineFinding, SelfTest, untried


def run(args: argparse.Namespace) -> int:
    """Test for ``args.seconds`` or until Ctrl-C; status 1 when lines are joined or a diode is bridged."""
    with flags.opened(args) as board:
        known: list[LineFinding] = []
        last: list[SelfTest] = []
        tests = 0
        pressed: frozenset[tuple[int, int]] = frozenset()
        if not args.json:
            terminal.say(f"Press every place of {board.port}, one after the other. Ctrl-C ends the test.")
        for test in _tests(board, args):
            last, tests, pressed = [test], tests + 1, pressed | test.pressed
            for finding in test.findings:
                if finding not in known:
                    known.append(finding)
                    if not args.json:
                        _say(_judged(finding))
        end = _end(known, tests, pressed, last)
    faults = sum(finding.kind == "fault" for finding in known)
    if args.json:
        found = [finding._asdict() for finding in [*map(_judged, known), *end]]
        answer = {"faults": faults, "findings": found, "tests": tests, "pressed": sorted(pressed)}
        print(json.dumps(answer), flush=True)
        return min(faults, 1)
    for said in end:
        _say(said)
    return min(faults, 1)


def _tests(board: Board, args: argparse.Namespace) -> Iterator[SelfTest]:
    until = None if args.seconds is None else board.clock() + args.seconds
    with interrupt.usual_end():
        while True:
            yield board.self_test(max(2.0, args.timeout))
            if until is not None and board.clock() >= until:
                return


def _end(
    known: list[LineFinding], tests: int, pressed: frozenset[tuple[int, int]], last: list[SelfTest]
) -> Iterator[Finding]:
    if not last:
        yield Finding("note", "no self-test was completed")
        return
    if not any(finding.kind == "fault" for finding in known):
        yield Finding("ok", f"no line follows another one in {tests} self-tests")
    if left := untried(last[0], pressed):
        yield Finding("note", f"{left} switches were not seen pressed by a self-test, so their diodes are not tested")
    else:
        yield Finding("ok", "every switch was pressed in a self-test")


def _judged(finding: LineFinding) -> Finding:
    return Finding("fault" if finding.kind == "fault" else "note", finding.sentence)


def _say(finding: Finding) -> None:
    terminal.say(f"{finding.verdict:5} {finding.sentence}", hang=6)
