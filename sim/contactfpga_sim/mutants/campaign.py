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

from contactfpga.console import interrupt, numbers
from contactfpga.skin import Skin
from contactfpga_sim.mutants import netlist, proof, trial
from contactfpga_sim.mutants.netlist import STAGES, Mutant
from contactfpga_sim.mutants.skins import OPTIONS, SKINS
from contactfpga_sim.mutants.stimuli import Stimulus, quick, thorough, until_time_wraps
from contactfpga_sim.pages import writer
from contactfpga_sim.studies import kept

BATCH = 500
"""Mutants in one board: with more of them it runs slower."""

CHECKED = 2
"""This many of the killed mutants of each Skin are given to the prover too, which must not prove them."""


EACH = numbers.whole(1, 1_000_000, "mutants")
PROOF_S = numbers.whole(1, 3600, "seconds")

GROUPS: dict[str, Mapping[str, object]] = {"mutants": SKINS, "options": OPTIONS}
"""Skins by the table of the page that they fill."""


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


def examine(
    name: str, count: int, seed: int, long_s: int = proof.LONG_S, say: Callable[[str], None] = lambda _: None
) -> list[Result]:
    """The fates of ``count`` mutants of the Skin of this name in :data:`SKINS`, or of the stages that go with it in
    :data:`OPTIONS`; ``long_s`` are the seconds of a longer proof.

    Raises :class:`contactfpga_sim.mutants.proof.ProofFailed` when a mutant that was killed is proved equivalent.
    """
    skin, stages = OPTIONS[name] if name in OPTIONS else (SKINS[name], tuple(STAGES))
    say("draw")
    drawn = netlist.draw([mutant for mutant in netlist.candidates(skin) if mutant.stage in stages], count, seed)
    say(f"{len(drawn)} mutants, short stimuli")
    left = left_by(skin, drawn, quick(skin))
    say(f"{len(left)} left, proofs")
    killed = [mutant for mutant in drawn if mutant not in left][:CHECKED]
    proved = _proved(skin, [*left, *killed], proof.QUICK_S)
    if wrong := proved & {*killed}:
        raise proof.ProofFailed(f"killed, yet proved equivalent: {', '.join(map(str, wrong))}")
    left = [mutant for mutant in left if mutant not in proved]
    say(f"{len(left)} left, long stimuli")
    longest = [until_time_wraps(skin)] if name in SKINS else []  # minutes in the golden model of an option
    left = left_by(skin, left, [*thorough(skin), *longest])
    say(f"{len(left)} left, longer proofs")
    proved |= _proved(skin, left, long_s)
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
    parser.add_argument("--skin", action="append", choices=[*SKINS, *OPTIONS], help="only this Skin; can be repeated")
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
    skin = OPTIONS[name][0] if name in OPTIONS else SKINS[name]
    code = kept.made_by("contactfpga_sim.mutants.campaign", skin)  # this module, which may have been run
    key = f"{name}, {each} of {seed}, {long_s} s, {code}"
    found = kept.kept(
        "mutants", key, lambda: [dataclasses.asdict(one) for one in examine(name, each, seed, long_s, say)]
    )
    return [Result(one["skin"], Mutant(**one["mutant"]), one["fate"]) for one in found]


if __name__ == "__main__":
    sys.exit(interrupt.guarded(main))
