"""`contactfpga arm`: the experiment of Section IV, its table and its pictures."""

from __future__ import annotations

import argparse
import dataclasses
import json

from contactfpga.console import outputs, terminal
from contactfpga.skin import Skin
from contactfpga_sim.studies.arm import comply, report, run_pictures
from contactfpga_sim.studies.arm.case import Case

SHARES = (0.25, 0.5, 0.75, 1.0, 1.25)
"""Of the fastest push that the arm yields to."""


def main(args: argparse.Namespace) -> int:
    """Run the command."""
    case = Case.load(args.case)
    if args.charts:
        from contactfpga_sim.studies.arm import latency_charts  # which needs processes and a progress bar

        return latency_charts.main(args, case)
    if case.control.behaviour == "comply":
        return _pushes(args, case)
    skin = Skin.load(args.skin) if args.skin else None
    folder = None if args.json else outputs.folder(args.output)
    found = report.columns(case, args.case, 1e-3 * args.latency, skin)
    if folder is None:
        print(json.dumps(report.as_json(found, args.case), indent=2))
        return 0
    title = f"Case {args.case}: time counts from the touch, {case.link.speed_m_s:g} m/s"
    _print(report.table(found, args.case == "paper"), title)
    for note in report.NOTES if args.case == "paper" else ():
        terminal.say(note)
    for path in run_pictures.pictures(found, folder):
        print(path)
    return 0


def _pushes(args: argparse.Namespace, case: Case) -> int:
    fastest = comply.fastest_m_s(case)
    pushes = [comply.pushed(case, share * fastest)[0] for share in SHARES]
    if args.json:
        known = {"case": args.case, "fastest_m_s": fastest, "pushes": [dataclasses.asdict(push) for push in pushes]}
        print(json.dumps(known, indent=2))
        return 0
    _print(report.push_lines(pushes), f"Case {args.case}: pushed by {1e3 * case.touch[0].push_m:g} mm and let go")
    terminal.say(f"The torque stays below {case.control.torque_limit_nm:g} Nm up to a push of {fastest:.3f} m/s.")
    return 0


def _print(lines: list[list[str]], title: str) -> None:
    from contactfpga.console.tables import tables

    console = terminal.console()
    for table in tables(lines, console.width, title=title):
        console.print(table)
        console.print()
