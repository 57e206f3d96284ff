"""The command `contactfpga fit`."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from contactfpga.choices import labellers
from contactfpga.choices.scans import SCANS
from contactfpga.design.cover import load_cover
from contactfpga.errors import UNSOLVED
from contactfpga.inputs.files import write_text
from contactfpga.skin import Skin
from contactfpga.tools.console import flags, numbers, outputs, results
from contactfpga.tools.console.interrupt import Interruption

if TYPE_CHECKING:
    from contactfpga_sim.lab.fit.candidates import Candidate
    from contactfpga_sim.lab.fit.faces import Faces
    from contactfpga_sim.lab.fit.trial import FitTask, SoFar

EXTRA = "chart"

PERCENT = numbers.number(0, 100, "%", above=True)


ORDER = (
    "The answer has the fewest wires (rows and columns) of all that meet the goals; of these the fewest LUT4, then the "
    "fewest bytes per frame, then the errors farthest from their limits."
)


def add_flags(parser: argparse.ArgumentParser) -> None:
    parser.epilog = ORDER
    what = "A .toml file of scenes, a .npz or .npy recording, or the name of a family or scene (docs/scenes.md)."
    parser.add_argument("scenes", nargs="+", metavar="SCENES", help=what)
    _goal_flags(parser.add_argument_group("what the Skin must meet for each of SCENES; none means no limit"))
    _candidate_flags(parser.add_argument_group("what is tried"))
    count, usual = numbers.whole(2, 1_000_000), "Number of scenes to choose with (default: the file's, or 500)."
    parser.add_argument("--placements", type=count, metavar="N", help=usual)
    above = "Count cells of recordings above this as pressed; needed for numbers."
    parser.add_argument("--threshold", type=numbers.CELL, metavar="X", help=above)
    parser.add_argument(
        "--seed", type=numbers.SEED, metavar="N", help="Seed of the places (default: the file's, or 0)."
    )
    parser.add_argument(
        "--quick", action="store_true", help="Do not check which of the refused Skins with as many wires are cheaper."
    )
    flags.workers(parser)
    flags.output(parser, "Write the Skin to this TOML file.")
    flags.json(parser)


def _goal_flags(goals: argparse._ArgumentGroup) -> None:
    far, late = numbers.number(0, 10_000, "mm", above=True), numbers.number(0, 1e9, "us", above=True)
    area = numbers.number(0, 100_000, "%", above=True)
    _limit(goals, "--miscounted", "PERCENT", PERCENT, 5.0, "Scenes whose numbers of zones and contacts differ")
    _limit(goals, "--missed", "PERCENT", PERCENT, 5.0, "Contacts without a zone")
    _limit(goals, "--barycenter-mm", "MM", far, 5.0, "Mean distance of barycenters from those of the contacts")
    _limit(goals, "--area", "PERCENT", area, None, "Mean error of a contact's area")
    felt = numbers.number(0, 99.999, "%", above=True)
    _limit(goals, "--felt", "PERCENT", felt, 99.0, "At least so many fingertips are felt; of covers that know forces")
    force = numbers.number(0, 1000, "N", above=True)
    goals.add_argument("--felt-n", type=force, default=2.0, metavar="N", help="Force of these fingertips (default: 2).")
    _limit(goals, "--latency-us", "US", late, 1000.0, "Worst time from the touch to the last byte")


def _limit(
    goals: argparse._ArgumentGroup,
    flag: str,
    unit: str,
    kind: Callable[[str], float],
    usual: float | None,
    what: str,
) -> None:
    shown = "none" if usual is None else f"{usual:g}"
    told = f"{what} (default: {shown}).".replace("%", "%%")
    goals.add_argument(flag, type=numbers.or_none(kind), default=usual, metavar=unit, help=told)


def _candidate_flags(tried: argparse._ArgumentGroup) -> None:
    fixed = "Skin that gives all settings but pitch, labeller, scan, and, where it has none, cover: these are chosen."
    tried.add_argument("--skin", metavar="FILE", help=fixed)
    pitch = "Try only this pitch; can be repeated."
    tried.add_argument("--pitch-mm", type=numbers.PITCH_MM, action="append", metavar="MM", help=pitch)
    cover = "Try only this cover: bare, paper, caps or tiles; can be repeated (default: caps and tiles)."
    tried.add_argument("--cover", metavar="NAME", action="append", help=cover)
    dome = "Try only this closing force of the switches under caps and tiles; can be repeated (default: 0.15 to 1 N)."
    tried.add_argument("--dome-n", type=numbers.number(0.001, 1000, "N"), metavar="N", action="append", help=dome)
    foam = "Thickness of the foam on caps and tiles (default: 2)."
    tried.add_argument("--foam-mm", type=numbers.number(0.01, 1000, "mm"), metavar="MM", default=2.0, help=foam)
    labeller = "Try only this labeller, cells, or module:attribute of your own; can be repeated."
    tried.add_argument("--labeller", action="append", metavar="NAME", help=labeller)
    scans = "Try only this scan; can be repeated (default: all that the Skin's columns can have)."
    tried.add_argument("--scan", action="append", metavar="NAME", help=scans)
    baud = "Try this baud rate; can be repeated (default: the Skin's)."
    tried.add_argument("--baud", type=numbers.BAUD, action="append", metavar="N", help=baud)
    host = "Accept bitmaps too: the host finds their zones in this time."
    tried.add_argument("--host-us", type=numbers.number(0, 1e9, "us"), metavar="US", help=host)


def run(args: argparse.Namespace) -> int:
    from contactfpga_sim.lab import pool
    from contactfpga_sim.lab.fit import show
    from contactfpga_sim.lab.fit.search import fit

    output = outputs.file(args.output) if args.output else None
    task, tried = asked(args)
    so_far: SoFar = {}
    try:
        with pool.executor(args.jobs, args.dask) as executor, pool.progress() as step:
            found = fit(task, tried, executor, step, so_far)
    except KeyboardInterrupt:
        raise Interruption(_kept(so_far, len(tried), args)) from None
    results.show(args, show.plain(found), lambda: show.printed(found))
    if output and found.answer:
        command = shlex.join(["contactfpga", *sys.argv[1:]]) if sys.argv[1:] else "contactfpga fit"
        write_text(output, show.toml(found, command))
        if not args.json:
            print(f"Skin: {output}")
    return 0 if found.answer and not found.broken else UNSOLVED


def asked(args: argparse.Namespace) -> tuple[FitTask, list[Candidate]]:
    """The task and all candidates; raises ValueError for impossible requests."""
    from contactfpga_sim.lab.fit import candidates
    from contactfpga_sim.lab.fit.faces import feels
    from contactfpga_sim.lab.fit.sources import Recorded, default_count, source
    from contactfpga_sim.lab.fit.trial import FitTask, Goals

    base = Skin.load(args.skin) if args.skin else None
    sources = tuple(source(name, args.seed, args.threshold) for name in args.scenes)
    covers = _covers(args, all(isinstance(one, Recorded) for one in sources))
    goals = Goals(
        miscounted=_share(args.miscounted),
        missed=_share(args.missed),
        barycenter_mm=args.barycenter_mm,
        area=_share(args.area),
        latency_us=args.latency_us,
        unfelt=None if args.felt is None else 1 - args.felt / 100,
        felt_n=args.felt_n,
    )
    count = default_count(sources) if args.placements is None else args.placements
    tried = candidates.candidates(
        base or Skin(),
        candidates.pitches_for(base, sources, args.pitch_mm),
        candidates.size_for(base, sources),
        _methods(args.labeller),
        flags.known("--scan", args.scan, list(SCANS)) if args.scan else None,
        args.baud,
        covers,
    )
    for one in sources:
        goals.check_count(one.most(count), any(feels(each.cover) for each in tried))
    return FitTask(sources, tuple(args.scenes), base or Skin(), goals, count, args.host_us, args.quick), tried


def _covers(args: argparse.Namespace, recorded: bool) -> Faces:
    from contactfpga_sim.lab import covers
    from contactfpga_sim.lab.fit import faces

    cover = load_cover(args.skin) if args.skin else None
    if cover is not None:
        if args.cover or args.dome_n:
            raise ValueError(f"{args.skin} has a cover, and --cover or --dome-n asks for others; leave one of them out")
        return faces.own(cover)
    names = flags.known("--cover", args.cover, list(covers.COVERS)) if args.cover else faces.KINDS
    return faces.BARE if recorded else faces.faces(names, args.dome_n or faces.DOMES_N, args.foam_mm)


def _methods(names: list[str] | None) -> list[dict[str, Any]]:
    from contactfpga_sim.lab.fit.candidates import METHODS, by

    if not names:
        return list(METHODS)
    return [
        method
        for name in dict.fromkeys(names)
        for method in ([{"report": "cells"}] if name == "cells" else by(labellers.find(name)))
    ]


def _share(percent: float | None) -> float | None:
    return None if percent is None else percent / 100


def _kept(so_far: SoFar, of: int, args: argparse.Namespace) -> str:
    from contactfpga_sim.lab.fit import show

    again = "run the same command again to go on from there"
    if not so_far:
        return f"interrupted before the first of {of} candidates was measured; {again}"
    results.show(args, show.plain_so_far(so_far.values()), lambda: show.printed_so_far(so_far.values()))
    return f"interrupted; of {of} candidates {len(so_far)} were measured, and no answer was chosen; {again}"
