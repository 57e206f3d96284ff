"""The command `contactfpga study benchmark`."""

from __future__ import annotations

import argparse
from pathlib import Path

from contactfpga.errors import ContactFPGAError
from contactfpga.tools.console import flags, numbers, outputs

EXTRA = "chart"

COUNT, MOST, SEED = 400, 1000, 2


def add_flags(flag: flags.Flags) -> None:
    flag("--scenes FOLDER", "Take these scenes (default: draw new ones into the output folder).")
    flag("--placements N", "Number of scenes per family to draw.", numbers.whole(1, MOST), COUNT)
    flag("--seed N", "Seed of the scenes to draw: 2 judges, take another one to choose a method.", numbers.SEED, SEED)
    flag("--entry FILE.npz ...", "Also score and chart these results; can be repeated.")
    flags.workers(flag)
    flags.output_folder(flag, "build/benchmark")


def run(args: argparse.Namespace) -> int:
    from contactfpga_sim.apps import pool, score
    from contactfpga_sim.lab.benchmark import entries, scenes
    from contactfpga_sim.lab.chart import front_picture

    folder = outputs.folder(args.output)
    drawn = Path(args.scenes) if args.scenes else outputs.folder(folder / "scenes")
    try:
        with pool.executor(args.jobs, args.dask) as workers:
            if not args.scenes:
                print(*scenes.write(drawn, args.seed, args.placements, workers), sep="\n", flush=True)
            given = [score.load(path, drawn) for path in args.entry or ()]  # refused before the work begins
            names = [*entries.METHODS, *(entry.name for entry, _ in given)]
            if twice := [name for name in names if names.count(name) > 1]:
                raise ContactFPGAError(f"two entries have the name {twice[0]!r}; give yours another one")
            found = entries.judged(entries.METHODS, drawn, workers)
    except score.ScoreError as error:
        raise ContactFPGAError(str(error)) from None
    found += [(entry, score.scored(entry, there)) for entry, there in given]
    for entry, scores in found:
        print(f"{entry.name} ({entry.kind})", *score.shown(scores), sep="\n")
    score.write(folder / "scores.csv", found)
    print(folder / "scores.csv", front_picture.save(folder / "scores.csv", folder / "front.svg"), sep="\n")
    return 0
