"""`contactfpga doctor`: looks at everything between this computer and the board, and says what to do."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterable

from contactfpga.driver import driver, finding, health, ports
from contactfpga.driver.address import SheetOf
from contactfpga.driver.health import Finding
from contactfpga.driver.stats import Stats
from contactfpga.errors import ContactFPGAError
from contactfpga.skin import Skin
from contactfpga.tools.console import flags, numbers, self_testing, terminal, watching

EXTRA = None

COUNTED_S = 1.0


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the command's flags to its parser."""
    flags.connection(parser)
    long = "Seconds over which frames are counted (default: 1), or watched or tested (default: until Ctrl-C)."
    parser.add_argument("--seconds", type=numbers.SECONDS, metavar="S", help=long)
    watch = "Follow the board while you touch every switch; name those that are stuck, loose or dead."
    parser.add_argument("--watch", action="store_true", help=watch)
    tested = "Have the board drive each line alone, again and again while you press every place; name joined lines."
    parser.add_argument("--self-test", action="store_true", help=tested)
    stuck = "Seconds without a change after which --watch reports a pressed switch (default: 10)."
    parser.add_argument("--stuck-s", type=numbers.SECONDS, metavar="S", help=stuck)
    parser.add_argument("--list", action="store_true", help="Listen to all ports; list the boards and their names.")
    parser.add_argument("--json", action="store_true", help="Print one JSON object: findings and counters.")


def run(args: argparse.Namespace) -> int:
    """Run the command; status 1 when a fault was found."""
    if args.list:
        return _list(args)
    if args.watch and args.self_test:
        raise ContactFPGAError("give --watch or --self-test, not both")
    if args.watch:
        return watching.run(args)
    if args.stuck_s is not None:
        raise ContactFPGAError("--stuck-s needs --watch")
    if args.self_test:
        return self_testing.run(args)
    report = _Report(silent=args.json)
    _look(args, report)
    if args.json:
        print(json.dumps(report.to_dict()), flush=True)
    return min(report.faults, 1)


class _Report:
    """What was found so far, printed as it comes unless ``silent``."""

    def __init__(self, silent: bool):
        self.stats: Stats | None = None
        self.lines: list[str] | None = None
        """Names of the faults that the board told last; None: it tells none."""
        self._silent = silent
        self._findings: list[Finding] = []

    @property
    def faults(self) -> int:
        return sum(finding.verdict == "fault" for finding in self._findings)

    def add(self, findings: Iterable[Finding]) -> None:
        for one in findings:
            self._findings.append(one)
            if not self._silent:
                terminal.say(f"{one.verdict:5} {one.sentence}", hang=6)

    def to_dict(self) -> dict[str, object]:
        return {
            "faults": self.faults,
            "findings": [finding._asdict() for finding in self._findings],
            "lines": self.lines,
            "stats": self.stats and self.stats.to_dict(),
        }


def _list(args: argparse.Namespace) -> int:
    """All boards; status 1 where there is none."""
    skin = Skin.load(args.skin) if args.skin else None
    heard = finding.survey(ports.candidates(), args.baud or (skin.baud if skin else driver.DEFAULT_BAUD))
    boards = [one for one in heard if one.hello is not None]
    if args.json:
        print(json.dumps([_listed(one) for one in heard]), flush=True)
    else:
        for one in heard:
            terminal.say(f"{'ok' if one.hello else 'note':5} {one}", hang=6)
        if not boards:
            terminal.say("fault no board said hello; is one plugged in, and its bitstream loaded?", hang=6)
    return 0 if boards else 1


def _listed(one: finding.Found) -> dict[str, object]:
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
        found = ports.candidates()
        report.add(Finding("note", f"{candidate} may be a board") for candidate in found)
        if len(found) == 1:
            port = found[0].device
    try:
        if port is not None and finding.searched(port):
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
            report.add(health.count(board, args.seconds or COUNTED_S, args.timeout))
            report.lines = None if board.faults is None else list(board.faults.names)
    except (ContactFPGAError, ValueError) as error:
        report.add([Finding("fault", str(error))])
