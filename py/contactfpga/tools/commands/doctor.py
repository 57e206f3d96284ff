"""The command `contactfpga doctor`."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from contactfpga import terminal
from contactfpga.driver import driver, finding, health
from contactfpga.driver.address import SheetOf, searched
from contactfpga.driver.board import Board
from contactfpga.driver.health import Finding
from contactfpga.driver.stats import Stats
from contactfpga.errors import ContactFPGAError
from contactfpga.instruments.self_test import LineFinding, SelfTest, untried
from contactfpga.instruments.watch import Cell, Suspicion, Watch, named
from contactfpga.skin import Skin
from contactfpga.tools.console import flags, interrupt, live, numbers, results
from contactfpga.zones.zone import Zones

EXTRA = None

COUNTED_S = 1.0

FAULTS = ("stuck", "flutter")
"""Suspicions that are faults, not notes: a hand alone does not cause them."""

STUCK_S = 10.0
"""Default time in s after which a pressed switch is reported."""

ZONES_ONLY = (
    'the board sends zones, so dead and loose switches cannot be told; for these set report = "cells" in the Skin\'s '
    "file, then `contactfpga build BOARD --skin FILE` and `contactfpga flash BOARD`"
)


def add_flags(flag: flags.Flags) -> None:
    flags.connection(flag)
    long = "Seconds over which frames are counted (default: 1), or watched or tested (default: until Ctrl-C)."
    flag("--seconds S", long, numbers.SECONDS)
    flag("--watch", "Follow the board while you touch every switch; name those that are stuck, loose or dead.")
    tested = "Have the board drive each line alone, again and again while you press every place; name joined lines."
    flag("--self-test", tested)
    stuck = "Seconds without a change after which --watch reports a pressed switch (default: 10)."
    flag("--stuck-s S", stuck, numbers.SECONDS)
    flag("--list", "Listen to all ports; list the boards and their names.")
    flags.json(flag, "Print one JSON object: findings and counters.")


def run(args: argparse.Namespace) -> int:
    if args.list:
        return _list(args)
    if args.watch and args.self_test:
        raise ContactFPGAError("give --watch or --self-test, not both")
    if args.watch:
        return _watch(args)
    if args.stuck_s is not None:
        raise ContactFPGAError("--stuck-s needs --watch")
    if args.self_test:
        return _self_test(args)
    report = _Report(silent=args.json)
    _look(args, report)
    results.show(args, report)
    return min(report.faults, 1)


class _Report:
    def __init__(self, silent: bool):
        self.stats: Stats | None = None
        self.lines: list[str] | None = None
        self._silent = silent
        self._findings: list[Finding] = []

    @property
    def faults(self) -> int:
        return sum(finding.verdict == "fault" for finding in self._findings)

    def add(self, findings: Iterable[Finding]) -> None:
        for one in findings:
            self._findings.append(one)
            if not self._silent:
                _say(one)

    def to_dict(self) -> dict[str, object]:
        return {
            "faults": self.faults,
            "findings": self._findings,
            "lines": self.lines,
            "stats": self.stats,
        }


def _say(finding: Finding) -> None:
    terminal.say(_line(finding), hang=6)


def _say_all(findings: Iterable[Finding]) -> None:
    for one in findings:
        _say(one)


def _line(finding: Finding) -> str:
    return f"{finding.verdict:5} {finding.sentence}"


def _list(args: argparse.Namespace) -> int:
    skin = Skin.load(args.skin) if args.skin else None
    heard = finding.survey(finding.candidates(), args.baud or (skin.baud if skin else driver.DEFAULT_BAUD))
    boards = [one for one in heard if one.hello is not None]
    results.show(args, [_listed(one) for one in heard], lambda: _show_list(heard, bool(boards)))
    return 0 if boards else 1


def _show_list(heard: list[finding.Reply], some: bool) -> None:
    for one in heard:
        terminal.say(f"{'ok' if one.hello else 'note':5} {one}", hang=6)
    if not some:
        named = f"ports without USB ids, as of `contactfpga board`, are listened to where {finding.MORE} names them"
        terminal.say(f"fault no board said hello; is one plugged in, and its bitstream loaded? {named}", hang=6)


def _listed(one: finding.Reply) -> dict[str, object]:
    known = one.hello
    return {
        "port": one.candidate.device,
        "serial_number": one.candidate.serial_number,
        "name": known and known.name,
        "fingerprint": known and known.fingerprint.hex(),
        "rows": known and known.sheet.rows,
        "columns": known and known.sheet.columns,
        "problem": one.problem or None,
    }


def _look(args: argparse.Namespace, report: _Report) -> None:
    port = args.port
    if port is None:
        found = finding.candidates()
        report.add(Finding("note", f"{candidate} may be a board") for candidate in found)
        if len(found) == 1:
            port = found[0].device
    try:
        if port is not None and searched(port):
            skin = Skin.load(args.skin) if args.skin else None
            port = finding.find(port, skin, args.baud or (skin.baud if skin else driver.DEFAULT_BAUD))
        if port is not None and "://" not in port:
            sheet = SheetOf.parse(port)
            device = port if sheet is None else sheet.port
            report.add(health.rights(device))
            report.add(health.ftdi(device))
        with driver.open(port, args.skin, baud=args.baud, timeout=args.timeout) as board:
            report.stats = board.stats
            report.add(health.hello(board))
            report.add(health.reader(board))
            report.add(health.count(board, args.seconds or COUNTED_S, args.timeout))
            report.lines = None if board.faults is None else list(board.faults.names)
    except (ContactFPGAError, ValueError) as error:
        report.add([Finding("fault", str(error))])


def _watch(args: argparse.Namespace) -> int:
    with flags.opened(args) as board:
        skin = flags.known_skin(board)
        watch = Watch(skin, stuck_s=args.stuck_s or STUCK_S)
        found: list[Suspicion] = []
        silent = args.json or terminal.of().live
        if not args.json:
            terminal.say(f"Touch every switch of {board.port}, and then nothing. Ctrl-C ends the watch.")

        def take(zones: Zones) -> None:
            for suspicion in watch.update(zones):
                found.append(suspicion)
                if not silent:
                    _say(suspected(suspicion))

        def render(zones: Zones, room: Any) -> Any:
            from contactfpga.tools.console import views  # rich, which scripts do without

            return views.watch_view(board, watch, [_line(suspected(one)) for one in found], zones, room)

        seconds, end = live.follow(board, args, take, None if args.json else render)
        findings = [*map(suspected, found), *_coverage(watch), *_without_mask(skin), *end]
    faults = sum(finding.verdict == "fault" for finding in findings)
    left = findings if terminal.of().live else findings[len(found) :]
    results.show(args, _watched(watch, findings, seconds, faults), lambda: _show_watched(left, watch, skin))
    return min(faults, 1)


def _show_watched(findings: list[Finding], watch: Watch, skin: Skin | None) -> None:
    _say_all(findings)
    if watch.mask_line:
        where = "in the Skin's file" if skin is not None else "in the Skin's file, beside the cells that are there"
        terminal.say(f"To go on without what is stuck, put this line {where}, and build again:\n{watch.mask_line}")


def suspected(suspicion: Suspicion) -> Finding:
    return Finding("fault" if suspicion.kind in FAULTS else "note", suspicion.sentence)


def _coverage(watch: Watch) -> list[Finding]:
    seen, never = watch.seen, watch.never
    if seen is None:
        return [Finding("note", ZONES_ONLY)]
    if not seen.any():
        return [Finding("fault", "no switch read pressed; was the sheet touched?")]
    if never:
        return [Finding("fault", f"{dark(seen, never)} never read pressed: not touched, or dead")]
    return [Finding("ok", "every switch read pressed at least once")]


def _without_mask(skin: Skin | None) -> list[Finding]:
    if skin is not None:
        return []
    return [Finding("note", "the mask of this board is not known, so absent switches look dead; give --skin FILE")]


def dark(seen: np.ndarray, never: tuple[Cell, ...]) -> str:
    """Names of switches that ``never`` read pressed, of all ``seen``; whole lines, probably broken wires, come
    first.
    """
    rows = sorted({row for row, _ in never if not seen[row].any()})
    columns = sorted({column for _, column in never if not seen[:, column].any()})
    left = [(row, column) for row, column in never if row not in rows and column not in columns]
    lines = [f"{word} {line}" for word, found in (("row", rows), ("column", columns)) for line in found]
    return ", ".join([*lines, *([named(left)] if left else [])])


def _watched(watch: Watch, findings: list[Finding], seconds: float, faults: int) -> dict[str, Any]:
    seen = watch.seen
    return {
        "faults": faults,
        "findings": findings,
        "seconds": seconds,
        "seen": None if seen is None else seen.astype(int),
        "never": watch.never,
        "stuck": watch.stuck,
        "fluttering": watch.fluttering,
        "mask": watch.mask,
        "mask_line": watch.mask_line,
    }


def _self_test(args: argparse.Namespace) -> int:
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
                        _say(tested(finding))
        end = list(_tests_end(known, tests, pressed, last))
    faults = sum(finding.kind == "fault" for finding in known)
    found = [*map(tested, known), *end]
    answer = {"faults": faults, "findings": found, "tests": tests, "pressed": sorted(pressed)}
    results.show(args, answer, lambda: _say_all(end))
    return min(faults, 1)


def _tests(board: Board, args: argparse.Namespace) -> Iterator[SelfTest]:
    until = None if args.seconds is None else board.clock() + args.seconds
    with interrupt.usual_end():
        while True:
            yield board.self_test(max(2.0, args.timeout))
            if until is not None and board.clock() >= until:
                return


def _tests_end(
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


def tested(finding: LineFinding) -> Finding:
    return Finding("fault" if finding.kind == "fault" else "note", finding.sentence)
