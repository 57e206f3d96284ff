"""All flips of all designs, in cached blocks."""

from __future__ import annotations

import csv
import functools
import itertools
import math
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor, as_completed
from pathlib import Path
from typing import Any, NamedTuple

from contactfpga.inputs.files import replaced
from contactfpga.skin import Skin
from contactfpga_hdl.board import sizes
from contactfpga_hdl.top import Top
from contactfpga_sim.apps import kept, size
from contactfpga_sim.lab.flips import flip
from contactfpga_sim.lab.flips.flip import FlipOutcome
from contactfpga_sim.lab.flips.reference import BAUD, CLOCK_HZ, Reference

DESIGNS: dict[str, dict[str, Any]] = {
    "run": {},
    "run, on_change": {"send": "on_change"},
    "serial": {"labeller": "serial"},
    "run, on_change, reversal": {"send": "on_change", "scan": "reversal", "precharge_us": 0.5},
    "run, dual": {"dual": True},
    "run, on_change, dual": {"send": "on_change", "dual": True},
    "serial, dual": {"labeller": "serial", "dual": True},
}
"""Differences from the reference Skin."""


def skin(design: str) -> Skin:
    return Skin(clock_hz=CLOCK_HZ, baud=BAUD, **DESIGNS[design])


def luts(design: str) -> int:
    return size.luts(lambda: Top(Skin(**DESIGNS[design])), sizes.UP5K)


BLOCK = 25


class Row(NamedTuple):
    design: str
    found: FlipOutcome


def run(
    names: Sequence[str],
    registers: int,
    memories: int,
    executor: Executor,
    done: Callable[[int], None],
    within_s: float | None = None,
) -> list[Row]:
    """Flips of ``registers`` register and ``memories`` memory bits of each design. ``done`` receives the number of
    blocks after each.

    ``within_s``: time after which only each design's first block is begun.
    """
    counts = {False: math.ceil(registers / BLOCK), True: math.ceil(memories / BLOCK)}
    blocks = [(name, memory, block) for memory, count in counts.items() for block in range(count) for name in names]
    # So that all of them are as far when the time is over.
    ordered = sorted(blocks, key=lambda each: each[2] / counts[each[1]])
    todo = {each: executor.submit(_block, *each) for each in ordered}
    timer = threading.Timer(within_s or 0.0, lambda: [todo[each].cancel() for each in ordered if each[2]])
    if within_s is not None:
        timer.start()
    try:
        for future in as_completed(todo.values()):
            if not future.cancelled():
                future.result()
                done(len(blocks))
    finally:
        timer.cancel()
    return [
        Row(name, FlipOutcome(*one))
        for memory, count in counts.items()
        for name in names
        for one in _first(
            None if todo[name, memory, block].cancelled() else todo[name, memory, block].result()
            for block in range(count)
        )
    ]


def _first(blocks: Iterable[list[FlipOutcome] | None]) -> Iterator[FlipOutcome]:
    """Flips before the first missing block, as a later choice would bias the result."""
    for found in itertools.takewhile(lambda block: block is not None, blocks):
        yield from found or ()


def _block(design: str, memory: bool, block: int) -> list[FlipOutcome]:
    def new() -> list[FlipOutcome]:
        reference = _reference(design)
        return [flip.follow(reference, each) for each in flip.drawn(reference, memory, BLOCK, block)]

    rows: list[FlipOutcome] = kept.kept("flips", _key(design, memory, block), new)
    return rows


def _key(design: str, memory: bool, block: int) -> str:
    return repr((kept.made_by(__name__, skin(design)), memory, block))


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
