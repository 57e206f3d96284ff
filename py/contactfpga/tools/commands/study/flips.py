"""The command `contactfpga study flips`."""

from __future__ import annotations

import argparse
import functools

from contactfpga.tools.console import flags, numbers, outputs
from contactfpga.tools.console.interrupt import Interruption

EXTRA = "chart"


def add_flags(flag: flags.Flags) -> None:
    flag("--design NAME ...", "Flip only this design; can be repeated.")
    count = numbers.whole(1, 1_000_000)
    flag("--registers N", "Flips of flip-flops per design (default: 400); always the same ones.", count, 400)
    flag("--memories N", "Flips of memory bits per design.", count, 100)
    minutes = "Begin no more flips after this time, and take those that were followed until then."
    flag("--minutes N", minutes, numbers.number(0.1, 10_000, "minutes"))
    flag("--kept", "Run nothing: use the results kept from earlier runs, as many as there are for each design.")
    flags.workers(flag)
    flags.output_folder(flag, "build/flips")


def run(args: argparse.Namespace) -> int:
    from contactfpga_sim.lab import pool
    from contactfpga_sim.lab.flips import campaign, summary
    from contactfpga_sim.lab.flips.campaign import DESIGNS

    names = flags.known("--design", args.design, list(DESIGNS))
    folder = outputs.folder(args.output)
    if args.kept:
        rows = campaign.finished(names)
    else:
        try:
            with pool.executor(args.jobs, args.dask) as executor, pool.progress() as step:
                done = functools.partial(step, "blocks of flips")
                within_s = None if args.minutes is None else 60 * args.minutes
                rows = campaign.run(names, args.registers, args.memories, executor, done, within_s)
        except KeyboardInterrupt:
            what = "interrupted; the blocks that were finished are kept, and the same command goes on"
            raise Interruption(what) from None
    campaign.write(rows, folder / "flips.csv")
    print(folder / "flips.csv", flush=True)
    for name in names:
        for memory, what in ((False, "registers"), (True, "memories")):
            some = summary.of(rows, name, memory)
            if not some:
                print(f"{name}: {what}: none was followed")
                continue
            print(f"{name}: {what}: {summary.share(some)} silently wrong, {summary.share(some, 'told')} reported")
    return 0
