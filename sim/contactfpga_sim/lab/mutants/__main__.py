"""``make mutants``: mutants of the named Skins, or of all, and the survivors."""

from __future__ import annotations

import argparse
import itertools

from contactfpga.tools.console import interrupt, numbers
from contactfpga_sim.lab.mutants.tables import EACH, GROUPS, JOBS, listed, run, table
from contactfpga_sim.verify.mutants import proof
from contactfpga_sim.verify.mutants.skins import OPTIONS, SEVERAL, SKINS


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m contactfpga_sim.lab.mutants", description=(__doc__ or ""))
    count, seconds = numbers.whole(1, 1_000_000, "mutants"), numbers.whole(1, 3600, "seconds")
    parser.add_argument("--each", type=count, default=EACH, help="mutants of each Skin (default %(default)s)")
    parser.add_argument("--seed", type=numbers.SEED, default=0, help="for the choice of mutants (default %(default)s)")
    parser.add_argument("--group", action="append", choices=GROUPS, help="only these Skins; can be repeated")
    named = [*SKINS, *OPTIONS, *SEVERAL]
    parser.add_argument("--skin", action="append", choices=named, help="only this Skin; can be repeated")
    parser.add_argument("--proof-s", type=seconds, default=proof.LONG_S, help="of a longer proof (default %(default)s)")
    parser.add_argument("--jobs", type=numbers.JOBS, default=JOBS, help="Skins at once (default %(default)s)")
    args = parser.parse_args()
    names = args.skin or [name for group in args.group or GROUPS for name in GROUPS[group]]
    found = run(names, args.each, args.seed, args.proof_s, args.jobs)
    results = list(itertools.chain(*found.values()))
    print(f"{listed(results)}\n\n{table(results)}")
    return 0


if __name__ == "__main__":
    interrupt.leave(interrupt.guarded(main))
