"""Shares of flips by design and module, and their cost."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from contactfpga.inputs.files import replaced
from contactfpga_sim.apps.stats import Rate
from contactfpga_sim.lab.flips import campaign
from contactfpga_sim.lab.flips.campaign import Row
from contactfpga_sim.model.board.state import StateBoard


class Design(NamedTuple):
    name: str
    luts: int
    registers: int
    """Flip-flop bits, including those around memories."""
    memories: int


def measured(names: Iterable[str]) -> list[Design]:
    """Bits and LUT4 of designs; needs programs of extra ``boards``."""
    found = []
    for name in names:
        board = StateBoard(campaign.skin(name))
        bits = [sum(place.bits for place in board.places if place.memory == memory) for memory in (False, True)]
        board.close()
        found.append(Design(name, campaign.luts(name), *bits))
    return found


def write(found: Iterable[Design], path: Path) -> None:
    with replaced(path) as new, new.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows([Design._fields, *found])


def read(path: Path) -> list[Design]:
    with path.open(encoding="utf-8", newline="") as file:
        return [
            Design(line.pop("name"), **{key: int(value) for key, value in line.items()})
            for line in csv.DictReader(file)
        ]


def of(rows: Iterable[Row], design: str, memory: bool) -> list[Row]:
    return [row for row in rows if row.design == design and row.found.memory == memory]


def share(rows: Sequence[Row], outcome: str = "silent") -> Rate:
    return Rate(sum(row.found.outcome == outcome for row in rows), len(rows))


def wrong_ms(rows: Sequence[Row]) -> tuple[float, float]:
    """Median and longest silently wrong output, in ms."""
    times = sorted(1e3 * row.found.seconds for row in rows if row.found.outcome == "silent")
    return (times[len(times) // 2], times[-1]) if times else (math.nan, math.nan)
