"""The flags of `contactfpga fit`."""

from __future__ import annotations

import argparse
from collections.abc import Callable

from contactfpga.console import numbers

PERCENT = numbers.number(0, 100, "%", above=True)


def add(parser: argparse.ArgumentParser) -> None:
    """Add them to the command's parser."""
    what = "a .toml file of scenes, a .npz or .npy recording, or a family's or scene's name (docs/scenes.md)"
    parser.add_argument("scenes", nargs="+", metavar="SCENES", help=what)
    goals = parser.add_argument_group("what the Skin must meet on each of them; none: no limit")
    _limit(goals, "--miscounted", "PERCENT", PERCENT, 5.0, "scenes with another number of zones than of contacts")
    _limit(goals, "--missed", "PERCENT", PERCENT, 5.0, "contacts without a zone")
    far = numbers.number(0, 10_000, "mm", above=True)
    _limit(goals, "--barycenter-mm", "MM", far, 5.0, "mean distance of barycenters from the contacts'")
    _limit(
        goals, "--area", "PERCENT", numbers.number(0, 100_000, "%", above=True), None, "mean error in a contact's area"
    )
    _limit(
        goals,
        "--latency-us",
        "US",
        numbers.number(0, 1e9, "us", above=True),
        1000.0,
        "worst time from the touch to the last byte",
    )
    tried = parser.add_argument_group("what is tried")
    tried.add_argument("--skin", metavar="FILE", help="Skin of which pitch, labeller and scan are chosen anew")
    one = "only this one; can be repeated"
    tried.add_argument("--pitch-mm", type=numbers.PITCH_MM, action="append", metavar="MM", help=one)
    tried.add_argument("--labeller", action="append", metavar="NAME", help=one)
    tried.add_argument("--scan", action="append", metavar="NAME", help=one)
    tried.add_argument("--baud", type=numbers.BAUD, action="append", help="(default: the Skin's); can be repeated")
    host = "the host finds zones in bitmaps, in this time"
    tried.add_argument("--host-us", type=numbers.number(0, 1e9, "us"), metavar="US", help=host)
    count, usual = numbers.whole(2, 1_000_000), "scenes to choose with (default: the file's, or 500)"
    parser.add_argument("--placements", type=count, metavar="N", help=usual)
    above = "cells of recordings above this count as pressed; needed for numbers"
    parser.add_argument("--threshold", type=numbers.CELL, help=above)
    parser.add_argument("--seed", type=numbers.SEED, help="of the places (default: the file's, or 0)")
    parser.add_argument("--quick", action="store_true", help="do not look which of the refused ones are cheaper")
    parser.add_argument("--jobs", type=numbers.JOBS, metavar="N", help="processes (default: one a core)")
    parser.add_argument("--dask", metavar="ADDRESS", help="scheduler of a Dask cluster that does the work instead")
    parser.add_argument("--output", metavar="FILE", help="write the Skin to this TOML file")
    parser.add_argument("--json", action="store_true", help="one JSON object")


def _limit(
    goals: argparse._ArgumentGroup,
    flag: str,
    unit: str,
    kind: Callable[[str], float],
    usual: float | None,
    what: str,
) -> None:
    shown = "none" if usual is None else f"{usual:g}"
    told = f"{what} (default: {shown})".replace("%", "%%")
    goals.add_argument(flag, type=numbers.or_none(kind), default=usual, metavar=unit, help=told)
