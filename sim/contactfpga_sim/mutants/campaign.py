"""``make mutants``: mutants of the gateware, how many of them the comparison with the golden model tells, and the rest.

For each Skin mutants are drawn at random. Those that short stimuli leave are tried for a proof of equivalence; what is
left then goes through long stimuli, and through longer trials of a proof. What is alive in the end is listed.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from contactfpga.console import interrupt, numbers
from contactfpga.skin import Skin
from contactfpga_sim.mutants import netlist, proof, trial
from contactfpga_sim.mutants.netlist import STAGES, Mutant
from contactfpga_sim.mutants.stimuli import SKINS, Stimulus, quick, thorough, until_time_wraps
from contactfpga_sim.pages import writer

BATCH = 500
"""Mutants in one board: with more of them it runs slower."""

CHECKED = 2
"""This many of the killed mutants of each Skin are given to the prover too, which must not prove them."""


EACH = numbers.whole(1, 1_000_000, "mutants")


@dataclasses.dataclass(frozen=True)
class Result:
    """What became of a mutant: ``killed``, ``equivalent`` or ``alive``."""

    skin: str
    mutant: Mutant
    fate: str


def left_by(skin: Skin, mutants: Sequence[Mutant], stimuli: Iterable[Stimulus]) -> list[Mutant]:
    """The mutants that behave as the golden model says under every stimulus."""
    given = list(stimuli)
    left: list[Mutant] = []
    for start in range(0, len(mutants), BATCH):
        batch = mutants[start : start + BATCH]
        model = netlist.model(skin, batch)
        left += [batch[n - 1] for n in trial.survivors(skin, model, range(1, len(batch) + 1), given)]
    return left


def examine(name: str, count: int, seed: int, say: Callable[[str], None] = lambda _: None) -> list[Result]:
    """The fates of ``count`` mutants of the Skin of this name in :data:`SKINS`.

    Raises :class:`contactfpga_sim.mutants.proof.ProofFailed` when a mutant that was killed is proved equivalent.
    """
    skin = SKINS[name]
    say("draw")
    drawn = netlist.draw(netlist.candidates(skin), count, seed)
    say(f"{len(drawn)} mutants, short stimuli")
    left = left_by(skin, drawn, quick(skin))
    say(f"{len(left)} left, proofs")
    killed = [mutant for mutant in drawn if mutant not in left][:CHECKED]
    proved = _proved(skin, [*left, *killed], proof.QUICK_S)
    if wrong := proved & {*killed}:
        raise proof.ProofFailed(f"killed, yet proved equivalent: {', '.join(map(str, wrong))}")
    left = [mutant for mutant in left if mutant not in proved]
    say(f"{len(left)} left, long stimuli")
    left = left_by(skin, left, [*thorough(skin), until_time_wraps(skin)])
    say(f"{len(left)} left, longer proofs")
    proved |= _proved(skin, left, proof.LONG_S)
    alive = {*left} - proved
    say(f"{len(alive)} alive")
    fates = (
        (mutant, "equivalent" if mutant in proved else "alive" if mutant in alive else "killed") for mutant in drawn
    )
    return [Result(name, mutant, fate) for mutant, fate in fates]


def _proved(skin: Skin, mutants: Sequence[Mutant], limit_s: int) -> set[Mutant]:
    return {mutant for mutant, same in zip(mutants, proof.equivalent(skin, mutants, limit_s)) if same}


def table(results: Sequence[Result]) -> str:
    """Counts by stage, as Markdown; the share is that of the mutants not proved equivalent."""
    rows = [["stage", "mutants", "killed", "equivalent, proved", "alive", "killed of the rest"]]
    for stage in [*dict.fromkeys(STAGES.values()), "all"]:
        fates = [result.fate for result in results if stage in ("all", result.mutant.stage)]
        killed, equivalent, alive = (fates.count(fate) for fate in ("killed", "equivalent", "alive"))
        share = f"{100 * killed / (killed + alive):.1f} %" if killed + alive else ""
        rows.append([stage, f"{len(fates):,}", f"{killed:,}", str(equivalent), str(alive), share])
    return writer.table_of(rows)


def listed(results: Iterable[Result]) -> str:
    """What is alive, one per line: stage, source place, change, Skin."""
    alive = sorted((str(result.mutant), result.skin) for result in results if result.fate == "alive")
    return "\n".join(f"{mutant}  ({skin})" for mutant, skin in alive)


def main() -> int:
    """Run the campaign; with a page named, write the table into it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--each", type=EACH, default=40, help="mutants of each Skin (default %(default)s)")
    parser.add_argument("--seed", type=numbers.SEED, default=0, help="for the choice of mutants (default %(default)s)")
    parser.add_argument("--skin", action="append", choices=SKINS, help="only this Skin; can be repeated")
    parser.add_argument("--jobs", type=numbers.JOBS, default=2, help="Skins at once (default %(default)s)")
    parser.add_argument("--page", type=Path, help="write the table into this page")
    args = parser.parse_args()
    page = writer.page(args.page, "--page") if args.page else None
    results = _run(args.skin or list(SKINS), args.each, args.seed, args.jobs)
    print(f"{listed(results)}\n\n{table(results)}")
    if page:
        writer.write(page, {"mutants": lambda: table(results)})
        print(f"wrote {page}")
    return 0


def _run(names: Sequence[str], each: int, seed: int, jobs: int) -> list[Result]:
    """All Skins, with a bar of progress for each, or where stderr is no terminal with a line for each step."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    started = time.monotonic()
    columns = (TextColumn("{task.fields[skin]}"), BarColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    live = sys.stderr.isatty()
    with (
        Progress(*columns, console=Console(stderr=True), disable=not live) as progress,
        ThreadPoolExecutor(jobs) as pool,
    ):

        def one(name: str) -> list[Result]:
            task = progress.add_task("", total=6, skin=name)

            def say(step: str) -> None:
                progress.update(task, description=step, advance=1)
                if not live:
                    print(f"{time.monotonic() - started:5.0f} s  {name}: {step}", file=sys.stderr, flush=True)

            return examine(name, each, seed, say)

        return [result for results in pool.map(one, names) for result in results]


if __name__ == "__main__":
    sys.exit(interrupt.guarded(main))
