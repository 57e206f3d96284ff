"""All flips of all designs, in cached blocks."""

from __future__ import annotations

import csv
import functools
import itertools
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor, as_completed
from pathlib import Path
from typing import Any, NamedTuple

from contactfpga.inputs.files import replaced
from contactfpga.skin import Skin
from contactfpga_hdl.board import sizes
from contactfpga_hdl.top import Top
from contactfpga_sim.apps import result_cache, size
from contactfpga_sim.apps.score import wilson
from contactfpga_sim.apps.stats import drawn
from contactfpga_sim.lab.flips import flip
from contactfpga_sim.lab.flips.flip import FlipOutcome
from contactfpga_sim.lab.flips.reference import BAUD, CLOCK_HZ, Reference

DESIGNS: dict[str, dict[str, Any]] = {
    "run": {},
    "serial": {"labeller": "serial"},
    "run, dual": {"dual": True},
    "serial, dual": {"labeller": "serial", "dual": True},
}
"""Differences from the reference Skin."""


def skin(design: str) -> Skin:
    return Skin(clock_hz=CLOCK_HZ, baud=BAUD, **DESIGNS[design])


def luts(design: str) -> int:
    return size.luts(lambda: Top(Skin(**DESIGNS[design])), sizes.UP5K)


BLOCK = 25

MOST = 150
"""Flips of registers, or of memories, of a design."""

NARROW = 0.02
"""Half width of the interval of the silently wrong share at which a design has enough flips."""


class Row(NamedTuple):
    design: str
    found: FlipOutcome


def run(names: Sequence[str], executor: Executor, done: Callable[[int], None]) -> list[Row]:
    """Flips of each design's registers and memories, as many as the interval needs. ``done`` receives the number of
    tasks after each."""
    tasks = [(name, memory) for memory in (False, True) for name in names]
    pending = [executor.submit(_flips, *task) for task in tasks]
    for future in as_completed(pending):
        future.result()
        done(len(tasks))
    return [
        Row(name, FlipOutcome(*one))
        for (name, _), future in zip(tasks, pending, strict=True)
        for one in future.result()
    ]


def _flips(design: str, memory: bool) -> list[FlipOutcome]:
    blocks = itertools.count()
    found, _ = drawn(lambda _: _block(design, memory, next(blocks)), range(BLOCK, MOST + 1, BLOCK), _enough)
    return found


def _enough(found: Sequence[FlipOutcome]) -> bool | None:
    silent = sum(FlipOutcome(*one).outcome == "silent" for one in found)
    low, high = wilson(silent, len(found))
    return True if high - low <= 2 * NARROW else None


def _block(design: str, memory: bool, block: int) -> list[FlipOutcome]:
    def new() -> list[FlipOutcome]:
        reference = _reference(design)
        return [flip.follow(reference, each) for each in flip.drawn(reference, memory, BLOCK, block)]

    rows: list[FlipOutcome] = result_cache.cached("flips", _key(design, memory, block), new)
    return rows


def _key(design: str, memory: bool, block: int) -> str:
    return repr((result_cache.made_by(__name__, skin(design)), memory, block))


@functools.lru_cache(maxsize=len(DESIGNS))
def _reference(design: str) -> Reference:
    return Reference(skin(design))


def write(rows: Iterable[Row], path: Path) -> None:
    with replaced(path) as new, new.open("w", encoding="utf-8", newline="") as file:
        lines = csv.writer(file, lineterminator="\n")
        lines.writerow(("design", *FlipOutcome._fields))
        for row in rows:
            found = row.found._replace(seconds=round(row.found.seconds, 6), gone_s=round(row.found.gone_s, 6))
            lines.writerow((row.design, *found))


def read(path: Path) -> list[Row]:
    with path.open(encoding="utf-8", newline="") as file:
        return [_row(line) for line in csv.DictReader(file)]


def _row(line: dict[str, str]) -> Row:
    found = FlipOutcome(
        name=line["name"],
        memory=line["memory"] == "True",
        outcome=line["outcome"],  # type: ignore[arg-type]
        kind=line["kind"],
        frames=int(line["frames"]),
        seconds=float(line["seconds"]),
        gone_s=float(line["gone_s"]),
        fights=int(line["fights"]),
    )
    return Row(line["design"], found)
