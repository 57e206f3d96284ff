"""The command `contactfpga study arm`."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from contactfpga import terminal
from contactfpga.design.cover import BODIES, load_cover
from contactfpga.errors import ContactFPGAError
from contactfpga.skin import Skin
from contactfpga.tools.console import flags, numbers, outputs, results

if TYPE_CHECKING:
    from contactfpga_sim.lab.arm import anywhere
    from contactfpga_sim.lab.arm.case import Case

EXTRA = "sim"

PLACES = 60


def add_flags(flag: flags.Flags) -> None:
    flag("--case CASE", "Case to run: paper, paper-offset or a .toml file.", default="paper")
    usual = "Latency from the switch to the controller (default: the paper's 6000)."
    flag("--latency-us US", usual, numbers.number(0, 1e7, "us"), 6000.0)
    places = "Touches anywhere on the sheet (default: 60; 0, and 0 for several touches: the case's place)."
    flag("--places N", places, numbers.whole(0, 10_000))
    flag("--skin FILE", "Skin of the sheet, with its [cover] if it has one (default: the reference Skin).")
    bodies = f"What the arm runs into: {', '.join(BODIES)} (default: the case's)."
    flag("--body BODY", bodies, tuple(BODIES))
    flags.json(flag, "Print one JSON object in SI units, and draw nothing.")
    regions = "Table of body regions: print the speed and reaction time that keep their limits instead."
    flag("--regions FILE.toml", regions)
    force = "Compare a force threshold of pressure units under the sheet with contact and torque limit instead."
    flag("--force-threshold", force)
    flags.workers(flag)
    flags.output_folder(flag, "build/arm")


def run(args: argparse.Namespace) -> int:
    from contactfpga_sim.lab.arm.case import Case

    case = Case.load(args.case)
    if args.skin and (cover := load_cover(args.skin)):
        case, args.case = case.wearing(cover), f"{args.case} under {args.skin}"
    if args.body:
        case, args.case = case.but(body=args.body), f"{args.case} against {args.body}"
    if args.regions:
        return _regions(args, case)
    if args.force_threshold:
        return _units(args, case)
    return _contact(args, case)


def _contact(args: argparse.Namespace, case: Case) -> int:
    from contactfpga.tools.console import tables
    from contactfpga_sim.lab.arm import anywhere, pictures, report

    skin = Skin.load(args.skin) if args.skin else None
    folder = None if args.json else outputs.folder(args.output)
    late = f"{1e-3 * args.latency_us:g} ms"
    count = args.places if args.places is not None else PLACES * (len(case.touch) == 1)
    touched = _anywhere(args, case, skin or Skin(), count) if count else None
    if folder is not None and touched is not None:
        tables.show(anywhere.lines(touched, late), title=f"Case {args.case}: touches anywhere on the sheet")
    found = report.columns(case, args.case, 1e-6 * args.latency_us, skin)
    if folder is None:
        known = report.as_json(found, args.case)
        if touched is not None:
            known["anywhere"] = anywhere.as_json(touched, late)
        results.show(args, known)
        return 0
    title = f"Case {args.case}: time counts from the touch, {case.link.speed_m_s:g} m/s"
    tables.show(report.table(found, args.case == "paper"), title=title)
    for note in report.NOTES if args.case == "paper" else ():
        terminal.say(note)
    for path in pictures.pictures(found, folder):
        print(path)
    return 0


def _anywhere(args: argparse.Namespace, case: Case, skin: Skin, count: int) -> anywhere.Found:
    from contactfpga_sim.apps.pool import executor, progress
    from contactfpga_sim.lab.arm import anywhere, places

    places.check(case)
    ways = anywhere.ways(case, skin, 1e-6 * args.latency_us)
    with executor(args.jobs, args.dask) as workers, progress() as step:
        return anywhere.touched(places.batches(case, skin, ways, count), workers, step)


def _units(args: argparse.Namespace, case: Case) -> int:
    from contactfpga.tools.console import tables
    from contactfpga_sim.lab.arm import report

    if args.skin is not None:
        raise ContactFPGAError("--force-threshold runs its own Skin; leave --skin out")
    lines = report.defense_lines(case)
    if args.json:
        results.show(args, [dict(zip(lines[0], line)) for line in lines[1:]])
        return 0
    tables.show(lines, title=f"Case {args.case}: {case.link.speed_m_s:g} m/s")
    return 0


def _regions(args: argparse.Namespace, case: Case) -> int:
    from contactfpga.design.cover.region import limits_of, load_regions
    from contactfpga.tools.commands.cover.design import REGION_HEADS, region_plain, region_row
    from contactfpga.tools.console import tables

    late = 1e-6 * args.latency_us
    found = [limits_of(case.pressing, one, case.link.speed_m_s, late) for one in load_regions(args.regions)]
    if args.json:
        results.show(args, [region_plain(one) for one in found])
        return 0
    title = f"Case {args.case}: {case.link.speed_m_s:g} m/s, reaction after {1e3 * late:g} ms"
    tables.show([REGION_HEADS, *map(region_row, found)], title=title)
    return 0
