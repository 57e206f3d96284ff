"""``make mutants``: mutants of the gateware, how many of them the comparison with the golden model tells, and the rest.

For each Skin mutants are drawn at random. Those that short stimuli leave are tried for a proof of equivalence; what is
left then goes through long stimuli, and through longer trials of a proof. What is alive in the end is listed.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
import itertools
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from contactfpga.skin.several import Several
from contactfpga.tools.console import interrupt, numbers
from contactfpga_sim.lab import kept, writer
from contactfpga_sim.verify.mutants import netlist, proof, sheets, stimuli, trial
from contactfpga_sim.verify.mutants.netlist import STAGES, Design, Mutant
from contactfpga_sim.verify.mutants.skins import OPTIONS, SEVERAL, SKINS
from contactfpga_sim.verify.mutants.stimuli import Stimulus

BATCH = 500
"""Mutants in one board: with more of them it runs slower."""

CHECKED = 2
"""This many of the killed mutants of each Skin are given to the prover too, which must not prove them."""


EACH = numbers.whole(1, 1_000_000, "mutants")
PROOF_S = numbers.whole(1, 3600, "seconds")

GROUPS: dict[str, Mapping[str, object]] = {"mutants": SKINS, "options": OPTIONS, "several": SEVERAL}
"""Skins, or several sheets, by the table of the page that they fill."""


@dataclasses.dataclass(frozen=True)
class Result:
    """What became of a mutant: ``killed``, ``equivalent`` or ``alive``."""

    skin: str
    mutant: Mutant
    fate: str


def chosen(name: str) -> tuple[Design, tuple[str, ...]]:
    """The Skin or the sheets of this name, and the stages whose mutants are drawn."""
    if name in SKINS:
        return SKINS[name], tuple(STAGES)
    return SEVERAL[name] if name in SEVERAL else OPTIONS[name]


def left_by(design: Design, mutants: Sequence[Mutant], stimuli: Iterable[Stimulus]) -> list[Mutant]:
    """The mutants that behave as the golden model says under every stimulus."""
    given = list(stimuli)
    left: list[Mutant] = []
    for start in range(0, len(mutants), BATCH):
        batch = mutants[start : start + BATCH]
        model = netlist.model(design, batch)
        left += [batch[n - 1] for n in trial.survivors(design, model, range(1, len(batch) + 1), given)]
    return left


def examine(
    name: str, count: int, seed: int, long_s: int = proof.LONG_S, say: Callable[[str], None] = lambda _: None
) -> list[Result]:
    """The fates of ``count`` mutants of what is :func:`chosen`; ``long_s`` are the seconds of a longer proof.

    Raises :class:`contactfpga_sim.verify.mutants.proof.ProofFailed` when a mutant that was killed is proved equivalent.
    """
    design, stages = chosen(name)
    given = sheets if isinstance(design, Several) else stimuli
    say("draw")
    drawn = netlist.draw([mutant for mutant in netlist.candidates(design) if mutant.stage in stages], count, seed)
    say(f"{len(drawn)} mutants, short stimuli")
    left = left_by(design, drawn, given.quick(design))
    say(f"{len(left)} left, proofs")
    killed = [mutant for mutant in drawn if mutant not in left][:CHECKED]
    proved = _proved(design, [*left, *killed], proof.QUICK_S)
    if wrong := proved & {*killed}:
        raise proof.ProofFailed(f"killed, yet proved equivalent: {', '.join(map(str, wrong))}")
    left = [mutant for mutant in left if mutant not in proved]
    say(f"{len(left)} left, long stimuli")
    longest = [stimuli.until_time_wraps(SKINS[name])] if name in SKINS else []  # minutes in the model of an option
    left = left_by(design, left, [*given.thorough(design), *longest])
    say(f"{len(left)} left, longer proofs")
    proved |= _proved(design, left, long_s)
    alive = {*left} - proved
    say(f"{len(alive)} alive")
    fates = (
        (mutant, "equivalent" if mutant in proved else "alive" if mutant in alive else "killed") for mutant in drawn
    )
    return [Result(name, mutant, fate) for mutant, fate in fates]


def _proved(design: Design, mutants: Sequence[Mutant], limit_s: int) -> set[Mutant]:
    return {mutant for mutant, same in zip(mutants, proof.equivalent(design, mutants, limit_s)) if same}


def table(results: Sequence[Result]) -> str:
    """Counts by stage, as Markdown; the share is that of the mutants not proved equivalent."""
    rows = [["stage", "mutants", "killed", "equivalent, proved", "alive", "killed of the rest"]]
    drawn = {result.mutant.stage for result in results}
    for stage in [*(stage for stage in STAGES if stage in drawn), "all"]:
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
    """Run the campaign; with a page named, write into it the tables of those groups of Skins that were run whole."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--each", type=EACH, default=40, help="mutants of each Skin (default %(default)s)")
    parser.add_argument("--seed", type=numbers.SEED, default=0, help="for the choice of mutants (default %(default)s)")
    parser.add_argument("--group", action="append", choices=GROUPS, help="only these Skins; can be repeated")
    named = [*SKINS, *OPTIONS, *SEVERAL]
    parser.add_argument("--skin", action="append", choices=named, help="only this Skin; can be repeated")
    parser.add_argument("--proof-s", type=PROOF_S, default=proof.LONG_S, help="of a longer proof (default %(default)s)")
    parser.add_argument("--jobs", type=numbers.JOBS, default=2, help="Skins at once (default %(default)s)")
    parser.add_argument("--page", type=Path, help="write the tables into this page")
    args = parser.parse_args()
    page = writer.page(args.page, "--page") if args.page else None
    names = args.skin or [name for group in args.group or GROUPS for name in GROUPS[group]]
    found = dict(zip(names, _run(names, args.each, args.seed, args.proof_s, args.jobs), strict=True))
    results = list(itertools.chain(*found.values()))
    print(f"{listed(results)}\n\n{table(results)}")
    whole = {
        group: functools.partial(table, list(itertools.chain(*(found[name] for name in members))))
        for group, members in GROUPS.items()
        if found.keys() >= members.keys()
    }
    if page and whole:
        writer.write(page, whole)
        print(f"wrote {page}")
    return 0


def _run(names: Sequence[str], each: int, seed: int, long_s: int, jobs: int) -> list[list[Result]]:
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

            return _kept(name, each, seed, long_s, say)

        return list(pool.map(one, names))


def _kept(name: str, each: int, seed: int, long_s: int, say: Callable[[str], None]) -> list[Result]:
    """As :func:`examine`, or what it found before with the same code."""
    design = chosen(name)[0]
    skins = design.skins if isinstance(design, Several) else (design,)
    code = kept.made_by("contactfpga_sim.verify.mutants.campaign", *skins)  # this module, which may have been run
    key = f"{name}, {each} of {seed}, {long_s} s, {code}"
    found = kept.kept(
        "mutants", key, lambda: [dataclasses.asdict(one) for one in examine(name, each, seed, long_s, say)]
    )
    return [Result(one["skin"], Mutant(**one["mutant"]), one["fate"]) for one in found]


if __name__ == "__main__":
    sys.exit(interrupt.guarded(main))
