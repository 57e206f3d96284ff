"""Skins that together have every pair of choices, and stimuli, for co-simulation."""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterable, Mapping, Sequence
from functools import cache, partial
from typing import Any

import numpy as np

from contactfpga.choices.debounces import DEBOUNCES
from contactfpga.choices.labellers import LABELLERS
from contactfpga.choices.reports import REPORTS
from contactfpga.skin import Skin, SkinError
from contactfpga.skin.sheet import MIN_AROUND, max_zones
from contactfpga_sim.model.golden.facts import facts
from contactfpga_sim.model.golden.request import KIND, command, request
from contactfpga_sim.model.golden.trace import Timeline

Pair = tuple[int, int, int, int]
"""Two choices, each with one of its values, as indices."""

CHOICES: dict[str, tuple[Any, ...]] = {
    "sheet": ((1, 1), (1, 9), (9, 1), (5, 7), (12, 4), (16, 16), (3, 33)),
    "connectivity": (8, 4),
    "diodes": ("col2row", "row2col"),
    "debounce": tuple(DEBOUNCES),
    "debounce_scans": ((0, 0), (1, 2), (2, 0), (3, 1)),
    "labeller": tuple(LABELLERS),
    "report": tuple(REPORTS),
    "barycenter_bits": (4, 0, 3),
    "extent": (False, True),  # where labeller and report have it
    "send": ("always", "on_change"),
    "mask": ("none", "cells", "column"),
    "capacity": ("default", "one", "half"),
    "surface": ("plane", "cylinder"),
    "link": ((12, 3_000_000), (12, 4_000_000), (1, 500_000), (50, 5_500_000)),
    "row_chains": (0, 1, 3),  # of shift registers at most, 0 for none
    "column_chains": (0, 1, 3),
    "shift_hz": (8_000_000, 5_000_000),
    "row_time": ("tight", "uneven", "long"),
    "precharge_us": (0.0, 0.1, 1.2),  # where columns are on pins of their own
    "keep_alive_scans": (1, 3, 1000),
}

REVERSAL: dict[str, tuple[Any, ...]] = CHOICES | {
    "scan": ("reversal",),
    "row_chains": (0,),
    "column_chains": (0,),
    "precharge_us": (0.1, 1.2),
    "project_us": (0.1, 1.0, 2.3),
}
"""Choices for line reversal, with rows and columns on pins of their own."""


def closed(choices: dict[str, tuple[Any, ...]]) -> dict[str, tuple[Any, ...]]:
    """Choices for closed sheets."""
    return choices | {
        "surface": ("closed",),
        "sheet": ((4, 3), *(sheet for sheet in choices["sheet"] if sheet[1] >= MIN_AROUND)),
        "labeller": tuple(name for name, labeller in LABELLERS.items() if labeller.closed),
        "report": ("moments", "cells"),
        "barycenter_bits": (0,),
    }


def pairwise(choices: dict[str, tuple[Any, ...]], seed: int = 0) -> list[dict[str, Any]]:
    """A short, reproducible list of assignments with every pair of values of two choices."""
    rows = _pairwise(tuple(map(len, choices.values())), seed)
    return [{name: choices[name][value] for name, value in zip(choices, row, strict=True)} for row in rows]


@cache
def _pairwise(counts: tuple[int, ...], seed: int) -> list[tuple[int, ...]]:
    pick = random.Random(seed)
    open_pairs = _Open(counts)
    rows = []
    while firsts := open_pairs.pairs():
        best = max((_candidate(open_pairs, pick.choice(firsts), pick) for _ in range(20)), key=open_pairs.closed_by)
        open_pairs.close(best)
        rows.append(tuple(best.values()))
    return rows


class _Open:
    def __init__(self, counts: Sequence[int]):
        self.counts = counts
        self._first = list(itertools.accumulate(counts, initial=0))
        every = (1 << self._first[-1]) - 1
        own = [((1 << count) - 1) << first for count, first in zip(counts, self._first, strict=False)]
        self._partners = [every & ~own[place] for place, count in enumerate(counts) for _ in range(count)]

    def pairs(self) -> list[Pair]:
        return [
            (a, i, b, j)
            for a, count in enumerate(self.counts)
            for i in range(count)
            for b in range(a + 1, len(self.counts))
            for j in range(self.counts[b])
            if self._partners[self._first[a] + i] >> (self._first[b] + j) & 1
        ]

    def bits(self, row: Mapping[int, int]) -> int:
        """Values (by place) of a row, or of part of a row."""
        return sum(1 << (self._first[place] + value) for place, value in row.items())

    def closed_with(self, bits: int, place: int, value: int) -> int:
        return (self._partners[self._first[place] + value] & bits).bit_count()

    def closed_by(self, row: Mapping[int, int]) -> int:
        """Twice the pairs that a whole row would close."""
        bits = self.bits(row)
        return sum(self.closed_with(bits, place, value) for place, value in row.items())

    def close(self, row: Mapping[int, int]) -> None:
        bits = self.bits(row)
        for place, value in row.items():
            self._partners[self._first[place] + value] &= ~bits


def _candidate(open_pairs: _Open, first: Pair, pick: random.Random) -> dict[int, int]:
    a, i, b, j = first
    row = {a: i, b: j}
    for place in pick.sample(range(len(open_pairs.counts)), len(open_pairs.counts)):
        if place not in row:
            values = pick.sample(range(open_pairs.counts[place]), open_pairs.counts[place])
            row[place] = max(values, key=partial(open_pairs.closed_with, open_pairs.bits(row), place))
    return dict(sorted(row.items()))


def pairs_in(rows: list[list[int]]) -> set[Pair]:
    """All pairs (choice, value, choice, value), as indices, in the rows."""
    return {(a, row[a], b, row[b]) for row in rows for a, b in itertools.combinations(range(len(row)), 2)}


def skin_for(choice: dict[str, Any]) -> Skin:
    """Skin for an assignment of :data:`CHOICES`, :data:`REVERSAL` or :func:`closed` ones."""
    rows, columns = choice["sheet"]
    megahertz, baud = choice["link"]
    values = {name: choice[name] for name in ("connectivity", "diodes", "debounce", "labeller", "report", "send")}
    values |= {"rows": rows, "columns": columns, "clock_hz": megahertz * 1_000_000, "baud": baud}
    values["scan"] = choice.get("scan", "raster")
    ends_meet = choice["surface"] == "closed"
    if choice["surface"] != "plane":
        values |= {"surface": "cylinder", "radius_mm": 2.0 * columns + 5.5, "pitch_y_mm": 7.25, "closed": ends_meet}
    if rows * columns > 1 and choice["mask"] == "cells":
        values["mask"] = ((rows - 1, 0), (0, columns - 1)) if rows * columns > 2 else ((0, 0),)
    elif columns > 1 and choice["mask"] == "column":
        values["mask"] = tuple((row, columns // 2) for row in range(rows))
    values |= _registers(choice)
    if "column_read" not in values:
        values["precharge_us"] = choice["precharge_us"]
    if values["scan"] == "reversal":
        values["project_us"] = choice["project_us"]
    if choice["report"] == "barycenter":
        values["barycenter_bits"] = choice["barycenter_bits"]
    values["extent"] = choice["extent"] and LABELLERS[choice["labeller"]].extent and choice["report"] != "cells"
    most = max_zones(rows, columns, choice["connectivity"], ends_meet)
    if choice["capacity"] != "default":
        values["zone_capacity"] = 1 if choice["capacity"] == "one" else -(-most // 2)
    values |= {"debounce_press_us": 0.0, "debounce_release_us": 0.0}  # until the scan time is known
    settle, release = _row_time(values, choice["row_time"], megahertz)
    values |= {"settle_us": settle, "release_us": release}
    known = facts(Skin(**values | {"send": "always"}))
    scan_us = known.scan_clocks / megahertz
    press, back = choice["debounce_scans"]
    values |= {"debounce_press_us": press * scan_us, "debounce_release_us": back * scan_us}
    least = known.skin.derived.min_keep_alive_ms if known.scan.waits else 0.0
    values["keep_alive_ms"] = min(100.0, least + (choice["keep_alive_scans"] + 0.5) * scan_us / 1000)
    return Skin(**values)


def _registers(choice: dict[str, Any]) -> dict[str, Any]:
    values: dict[str, Any] = {}
    kinds = (("row", "row_drive", "74hc595"), ("column", "column_read", "74hc165"))
    for (kind, wiring, registers), lines in zip(kinds, choice["sheet"], strict=True):
        if chains := choice[f"{kind}_chains"]:
            length = -(-lines // chains)
            values |= {wiring: registers, f"{kind}_chains": -(-lines // length), "shift_hz": choice["shift_hz"]}
    return values


def _row_time(values: dict[str, Any], kind: str, megahertz: int) -> tuple[float, float]:
    """Settle and release time in us: the shortest accepted, one with odd clocks, or a long one."""
    release = {"tight": 1, "uneven": 3, "long": 2 * megahertz}[kind]
    for settle in range(1, 10_000):
        exact = (settle / megahertz, release / megahertz)
        try:
            Skin(**values | {"settle_us": exact[0], "release_us": exact[1], "send": "always"})
        except SkinError:
            continue
        if kind == "tight":
            return exact
        longer = settle + (7 if kind == "uneven" else 40)
        return (longer - 0.25) / megahertz, release / megahertz
    raise AssertionError("no row time is accepted")


def stimulus(skin: Skin, cycles: int, seed: int) -> Timeline:
    """Random cells that change at any cycle, stuck columns, requests and other bytes.

    A scan that waits does not drive stuck columns, so it gets few.
    """
    rng = np.random.default_rng([seed, 7])
    shape = (skin.rows, skin.columns)
    scan = facts(skin).scan_clocks
    may_stick = np.arange(skin.columns) % 4 == 3 if facts(skin).scan.waits else np.ones(skin.columns, bool)
    pieces: list[tuple[int, np.ndarray, np.ndarray | None]] = []
    start = 0
    while start < cycles:
        cells = rng.random(shape) < rng.choice([0.0, 0.02, 0.1, 0.3, 0.5, 0.7, 0.95, 1.0])
        if pieces and rng.random() < 0.2:
            cells = pieces[-1][1]
        stuck = may_stick & (rng.random(skin.columns) < 0.3) if rng.random() < 0.25 else None
        pieces.append((start, cells, stuck))
        start += int(scan * rng.choice([0.3, 1.0, 1.0, 1.7, 3.0])) + 1
    gaps = rng.choice([0, 1, 7, scan, 5 * scan], size=6)
    return Timeline(pieces, traffic(skin, gaps.tolist(), int(rng.integers(scan)), cycles, rng))


def traffic(
    skin: Skin, gaps: Iterable[int], start: int, cycles: int, rng: np.random.Generator
) -> list[tuple[int, bytes]]:
    """A host's bytes from ``start`` on, with these gaps: requests, supported commands, and damaged, cut, unknown and
    random packets."""
    byte = 10 * facts(skin).bit_clocks
    sent = []
    for gap in gaps:
        data = _packet(skin, rng)
        if start + len(data) * byte > cycles:
            break
        sent.append((start, data))
        start += len(data) * byte + gap
    return sent


def _packet(skin: Skin, rng: np.random.Generator) -> bytes:
    number, hello = int(rng.integers(1, 1 << 21)), bool(rng.random() < 0.5)
    data = bytearray(request(number, hello, facts(skin).bit_clocks))
    if facts(skin).commands and rng.random() < 0.7:
        hello = bool(rng.random() < 0.1)  # each takes the line from what commands bring about
        data = bytearray(command(number, *_order(skin, rng), hello, facts(skin).bit_clocks))
    match rng.choice(["whole", "flip", "cut", "kind", "bytes"], p=[0.6, 0.15, 0.1, 0.05, 0.1]):
        case "flip":
            data[int(rng.integers(len(data)))] ^= 1 << int(rng.integers(8))
        case "cut":
            data = data[: int(rng.integers(1, len(data)))]
        case "kind":
            kinds = [kind for kind in range(1, 16) if kind != KIND]
            data = bytearray(request(number, hello, facts(skin).bit_clocks, kind=int(rng.choice(kinds))))
        case "bytes":
            data = bytearray(rng.choice([0, 5, 0x51, 0x81, 0xFF], size=int(rng.integers(1, 13))).astype(np.uint8))
    return bytes(data)


def _order(skin: Skin, rng: np.random.Generator) -> tuple[int, int]:
    what = rng.choice(np.array([*facts(skin).commands, rng.integers(128)]))
    number = rng.choice(np.array([0, 1, rng.integers(1 << 12), rng.integers(1 << 18)]))
    clock, of_place = rng.integers(facts(skin).settle + 3), rng.integers(8) | number << 3
    return int(what), int(rng.choice(np.array([of_place, clock, rng.integers(1 << 21)])))
