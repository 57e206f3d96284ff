"""All flips of all designs, in blocks that are kept, and their table."""

from __future__ import annotations

import csv
import functools
import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor, as_completed
from pathlib import Path
from typing import NamedTuple

from contactfpga.inputs.files import replaced
from contactfpga_sim.studies import kept
from contactfpga_sim.studies.flips import designs, flip
from contactfpga_sim.studies.flips.flip import Found
from contactfpga_sim.studies.flips.reference import Reference

BLOCK = 25
"""Flips that one process follows before it is asked again."""


class Row(NamedTuple):
    """A flip of a design."""

    design: str
    found: Found


def run(
    names: Sequence[str], registers: int, memories: int, executor: Executor, done: Callable[[int], None]
) -> list[Row]:
    """This many flips of register bits and of memory bits of each design. ``done`` is told the number of blocks
    whenever one is finished."""
    blocks = [
        (name, memory, block)
        for memory, count in ((False, registers), (True, memories))
        for block in range(math.ceil(count / BLOCK))
        for name in names
    ]
    todo = {executor.submit(_block, *each): each for each in blocks}
    found = {}
    for future in as_completed(todo):
        found[todo[future]] = future.result()
        done(len(blocks))
    return [Row(each[0], Found(*one)) for each in blocks for one in found[each]]


def _block(design: str, memory: bool, block: int) -> list[Found]:
    def new() -> list[Found]:
        reference = _reference(design)
        return [flip.follow(reference, each) for each in flip.drawn(reference, memory, BLOCK, block)]

    rows: list[Found] = kept.kept("flips", _key(design, memory, block), new)
    return rows


def _key(design: str, memory: bool, block: int) -> str:
    return repr((kept.made_by(__name__, designs.skin(design)), memory, block))


def finished(names: Iterable[str]) -> list[Row]:
    """All flips of these designs that were followed before: of each the blocks up to the first one that was not."""
    rows = []
    for memory in (False, True):
        for name in names:
            for block in itertools.count():
                if (found := kept.found("flips", _key(name, memory, block))) is None:
                    break
                rows += [Row(name, Found(*one)) for one in found]
    return rows


@functools.lru_cache(maxsize=len(designs.DESIGNS))
def _reference(design: str) -> Reference:
    return Reference(designs.skin(design))


def write(rows: Iterable[Row], path: Path) -> None:
    """One line per flip."""
    with replaced(path) as new, new.open("w", encoding="utf-8", newline="") as file:
        lines = csv.writer(file, lineterminator="\n")
        lines.writerow(("design", *Found._fields))
        for row in rows:
            found = row.found._replace(seconds=round(row.found.seconds, 6), gone_s=round(row.found.gone_s, 6))
            lines.writerow((row.design, *found))


def read(path: Path) -> list[Row]:
    """What :func:`write` wrote."""
    with path.open(encoding="utf-8", newline="") as file:
        return [_row(line) for line in csv.DictReader(file)]


def _row(line: dict[str, str]) -> Row:
    found = Found(
        name=line["name"],
        memory=line["memory"] == "True",
        outcome=line["outcome"],  # type: ignore[arg-type]
        kind=line["kind"],
        frames=int(line["frames"]),
        seconds=float(line["seconds"]),
        gone_s=float(line["gone_s"]),
    )
    return Row(line["design"], found)


def wilson(hits: int, of: int, z: float = 1.96) -> tuple[float, float]:
    """The 95 % interval of a share, by Wilson's formula."""
    share, part = hits / of, z * z / of
    middle = (share + part / 2) / (1 + part)
    half = z * math.sqrt(share * (1 - share) / of + part / 4 / of) / (1 + part)
    return max(0.0, middle - half), min(1.0, middle + half)
