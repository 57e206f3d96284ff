"""Fate of mutants by group of Skins."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor

from contactfpga.skin.several import Several
from contactfpga_sim.apps import pool, result_cache
from contactfpga_sim.lab import writer
from contactfpga_sim.verify.mutants import campaign, proof
from contactfpga_sim.verify.mutants.campaign import Result, chosen, examine
from contactfpga_sim.verify.mutants.netlist import STAGES, Mutant
from contactfpga_sim.verify.mutants.skins import OPTIONS, SEVERAL, SKINS

GROUPS: dict[str, Mapping[str, object]] = {"mutants": SKINS, "options": OPTIONS, "several": SEVERAL}
"""Skins by section of the page."""
EACH = 40
JOBS = 2
CACHE = "CONTACTFPGA_CACHE"


def compute() -> dict[str, list[Result]]:
    return run([name for group in GROUPS.values() for name in group], EACH, 0, proof.LONG_S, pool.usual_jobs or JOBS)


def mutants_table(found: Mapping[str, Sequence[Result]]) -> writer.Table:
    return table(_all(found, SKINS))


def options_table(found: Mapping[str, Sequence[Result]]) -> writer.Table:
    return table(_all(found, OPTIONS))


def several_table(found: Mapping[str, Sequence[Result]]) -> writer.Table:
    return table(_all(found, SEVERAL))


def _all(found: Mapping[str, Sequence[Result]], names: Iterable[str]) -> list[Result]:
    return [result for name in names for result in found[name]]


def table(results: Sequence[Result]) -> writer.Table:
    """Counts by stage; shares are of mutants not proved equivalent. The page shows stages with survivors."""
    rows = []
    drawn = {result.mutant.stage for result in results}
    for stage in [*(stage for stage in STAGES if stage in drawn), "all"]:
        fates = [result.fate for result in results if stage in ("all", result.mutant.stage)]
        killed, equivalent, alive = (fates.count(fate) for fate in ("killed", "equivalent", "alive"))
        share = f"{100 * killed / (killed + alive):.1f} %" if killed + alive else ""
        rows.append([stage, f"{len(fates):,}", f"{killed:,}", str(equivalent), str(alive), share])
    head = ("stage", "mutants", "killed", "equivalent, proved", "alive", "killed of the rest")
    return writer.Table(head, rows, lambda row: row[0] == "all" or row[4] != "0")


def listed(results: Iterable[Result]) -> str:
    """A line per survivor: stage, source, change, Skin."""
    alive = sorted((str(result.mutant), result.skin) for result in results if result.fate == "alive")
    return "\n".join(f"{mutant}  ({skin})" for mutant, skin in alive)


def run(names: Sequence[str], each: int, seed: int, long_s: int, jobs: int) -> dict[str, list[Result]]:
    """Results by Skin, with progress bars, or lines off a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    started = time.monotonic()
    columns = (TextColumn("{task.fields[skin]}"), BarColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    live = sys.stderr.isatty()
    with (
        Progress(*columns, console=Console(stderr=True), disable=not live) as progress,
        ThreadPoolExecutor(jobs) as threads,
        _own_cache(),
    ):

        def one(name: str) -> list[Result]:
            task = progress.add_task("", total=6, skin=name)

            def say(step: str) -> None:
                progress.update(task, description=step, advance=1)
                if not live:
                    print(f"{time.monotonic() - started:5.0f} s  {name}: {step}", file=sys.stderr, flush=True)

            return _kept(name, each, seed, long_s, say)

        return dict(zip(names, threads.map(one, names), strict=True))


@contextlib.contextmanager
def _own_cache() -> Iterator[None]:
    named = os.environ.get(CACHE)
    os.environ[CACHE] = named or "build/mutants"
    try:
        yield
    finally:
        if named is None:
            del os.environ[CACHE]


def _kept(name: str, each: int, seed: int, long_s: int, say: Callable[[str], None]) -> list[Result]:
    design = chosen(name)[0]
    skins = design.skins if isinstance(design, Several) else (design,)
    code = result_cache.made_by(campaign.__name__, *skins)
    key = f"{name}, {each} of {seed}, {long_s} s, {code}"
    found = result_cache.cached(
        "mutants", key, lambda: [dataclasses.asdict(one) for one in examine(name, each, seed, long_s, say)]
    )
    return [Result(one["skin"], Mutant(**one["mutant"]), one["fate"]) for one in found]
