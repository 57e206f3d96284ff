"""The command `contactfpga fit`."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from contactfpga.choices import labellers, scans
from contactfpga.design.cover import load_cover
from contactfpga.design.cover.task import Task
from contactfpga.errors import UNSOLVED
from contactfpga.inputs.files import write_text
from contactfpga.skin import Skin
from contactfpga.tools.console import flags, numbers, outputs, results
from contactfpga.tools.console.interrupt import Interruption

if TYPE_CHECKING:
    from contactfpga_sim.apps.fit.candidates import Candidate
    from contactfpga_sim.apps.fit.faces import Faces, Protection
    from contactfpga_sim.apps.fit.trial import FitTask, SoFar

EXTRA = "chart"


def _goal(most: float, unit: str) -> Callable[[str], float | None]:
    return numbers.or_none(numbers.number(0, most, unit, above=True))


PERCENT = _goal(100, "%")

ORDER = (
    "The answer is the first that meets the goals: fewest wires (rows and columns) first, then domes, light cells and "
    "light cells with three levels, then the smallest labeller, then the errors farthest from their limits."
)


def add_flags(flag: flags.Flags) -> None:
    flag.parser.epilog = ORDER
    what = "A .toml file of scenes, a .npz or .npy recording, or the name of a family or scene (docs/scenes.md)."
    flag("SCENES ...", what)
    _goal_flags(flag.group("what the Skin must meet for each of SCENES; none means no limit"))
    _candidate_flags(flag.group("what is tried"))
    usual = "Scenes that check the answer; up to 8 times as many choose it (default: the file's, or 500)."
    flag("--placements N", usual, numbers.whole(2, 1_000_000))
    flag("--threshold X", "Count cells of recordings above this as pressed; needed for numbers.", numbers.CELL)
    flag("--seed N", "Seed of the places (default: the file's, or 0).", numbers.SEED)
    flags.workers(flag)
    flags.output(flag, "Write the Skin to this TOML file.")
    flags.json(flag)


def _goal_flags(goals: flags.Flags) -> None:
    goals("--miscounted PERCENT", "Scenes whose numbers of zones and contacts differ.", PERCENT, 5.0)
    goals("--missed PERCENT", "Contacts without a zone.", PERCENT, 5.0)
    goals("--barycenter-mm MM", "Mean distance of barycenters from those of the contacts.", _goal(10_000, "mm"), 5.0)
    goals("--area PERCENT", "Mean error of a contact's area (default: none).", _goal(100_000, "%"))
    felt = "At least so many fingertips are felt; of covers that know forces."
    goals("--felt PERCENT", felt, _goal(99.999, "%"), 99.0)
    goals("--felt-n N", "Force of these fingertips.", numbers.number(0, 1000, "N", above=True), 2.0)
    goals("--arm FILE", "Arm, impact and brake, as of contactfpga cover design, for the next two.")
    newtons = numbers.number(0, 1e6, "N", above=True)
    goals("--late-n N", "Peak force on a rigid body if this arm stops only after its latency.", newtons)
    goals("--no-stop-n N", "Peak force on a rigid body if its motor goes on.", newtons)
    goals("--latency-us US", "Worst time from the touch to the last byte.", _goal(1e9, "us"), 1000.0)


def _candidate_flags(tried: flags.Flags) -> None:
    fixed = "Skin that gives all settings but pitch, labeller, scan, and, where it has none, cover: these are chosen."
    tried("--skin FILE", fixed)
    tried("--pitch-mm MM ...", "Try only this pitch; can be repeated.", numbers.PITCH_MM)
    cover = "Try only this cover: bare, paper, caps, tiles or light; can be repeated (default: caps, tiles, light)."
    tried("--cover NAME ...", cover)
    dome = "Try only this closing force of the switches under caps and tiles; can be repeated (default: 0.15 to 1 N)."
    tried("--dome-n N ...", dome, numbers.number(0.001, 1000, "N"))
    tried("--foam-mm MM", "Thickness of the foam on caps and tiles.", numbers.number(0.01, 1000, "mm"), 2.0)
    by = "Try only this labeller, cells, levels, or module:attribute of your own; can be repeated."
    tried("--labeller NAME ...", by)
    tried("--scan NAME ...", "Try only this scan; can be repeated (default: all that the Skin's columns can have).")
    tried("--baud N ...", "Try this baud rate; can be repeated (default: the Skin's).", numbers.BAUD)
    host = "Time in which the host finds the zones of a map; with it, bitmaps of domes are tried, too."
    tried("--host-us US", host, numbers.number(0, 1e9, "us"))


def run(args: argparse.Namespace) -> int:
    from contactfpga_sim.apps import pool
    from contactfpga_sim.apps.fit import show
    from contactfpga_sim.apps.fit.search import fit

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
    from contactfpga_sim.apps.fit import candidates
    from contactfpga_sim.apps.fit.faces import feels
    from contactfpga_sim.apps.fit.sources import RecordingSource, default_count, source
    from contactfpga_sim.apps.fit.trial import FitTask, Goals

    base = Skin.load(args.skin) if args.skin else None
    sources = tuple(source(name, args.seed, args.threshold) for name in args.scenes)
    covers = _covers(args, all(isinstance(one, RecordingSource) for one in sources))
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
        _methods(args.labeller, args.host_us is not None),
        [scans.find(name).name for name in args.scan] if args.scan else None,
        args.baud,
        covers,
        _protection(args),
    )
    for one in sources:
        goals.check_count(min(count, one.most(count)), any(feels(each.cover) for each in tried))
    return FitTask(sources, tuple(args.scenes), base or Skin(), goals, count, args.host_us), tried


def _protection(args: argparse.Namespace) -> Protection | None:
    from contactfpga_sim.apps.fit.faces import Protection

    asked = args.late_n is not None or args.no_stop_n is not None
    if asked != bool(args.arm):
        raise ValueError("--arm names the arm of --late-n and --no-stop-n; give it with one of them at least")
    return Protection(Task.load(args.arm), args.late_n, args.no_stop_n) if asked else None


def _covers(args: argparse.Namespace, recorded: bool) -> Faces:
    from contactfpga_sim.apps import covers
    from contactfpga_sim.apps.fit import faces

    cover = load_cover(args.skin) if args.skin else None
    if cover is not None:
        if args.cover or args.dome_n:
            raise ValueError(f"{args.skin} has a cover, and --cover or --dome-n asks for others; leave one of them out")
        return faces.own(cover)
    names = flags.known("--cover", args.cover, [*covers.COVERS, faces.LIGHT]) if args.cover else faces.KINDS
    return faces.BARE if recorded else faces.faces(names, args.dome_n or faces.DOMES_N, args.foam_mm)


def _methods(names: list[str] | None, bitmaps: bool) -> list[dict[str, Any]]:
    from contactfpga_sim.apps.fit.candidates import LEVELS, METHODS, ON_HOST, by

    if not names:
        return [ON_HOST] * bitmaps + [*METHODS]
    maps: dict[str, list[dict[str, Any]]] = {"cells": [ON_HOST], "levels": [LEVELS]}
    return [method for name in dict.fromkeys(names) for method in maps.get(name) or by(labellers.find(name))]


def _share(percent: float | None) -> float | None:
    return None if percent is None else percent / 100


def _kept(so_far: SoFar, of: int, args: argparse.Namespace) -> str:
    from contactfpga_sim.apps.fit import show

    again = "run the same command again to go on from there"
    if not so_far:
        return f"interrupted before the first of {of} candidates was measured; {again}"
    results.show(args, show.plain_so_far(so_far.values()), lambda: show.printed_so_far(so_far.values()))
    return f"interrupted; of {of} candidates {len(so_far)} were measured, and no answer was chosen; {again}"
