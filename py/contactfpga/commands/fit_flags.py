"""The flags of `contactfpga fit`."""

from __future__ import annotations

import argparse


def add(parser: argparse.ArgumentParser) -> None:
    """Add them to the command's parser."""
    what = "a .toml file of scenes, a .npz or .npy recording, or a family's or scene's name (docs/scenes.md)"
    parser.add_argument("scenes", nargs="+", metavar="SCENES", help=what)
    goals = parser.add_argument_group("what the Skin must meet on each of them; none: no limit")
    _limit(goals, "--miscounted", "PERCENT", 5.0, "scenes with another number of zones than of contacts")
    _limit(goals, "--missed", "PERCENT", 5.0, "contacts without a zone")
    _limit(goals, "--barycenter-mm", "MM", 5.0, "mean distance of barycenters from the contacts'")
    _limit(goals, "--area", "PERCENT", None, "mean error in a contact's area")
    _limit(goals, "--latency-us", "US", 1000.0, "worst time from the touch to the last byte")
    tried = parser.add_argument_group("what is tried")
    tried.add_argument("--skin", metavar="FILE", help="Skin of which pitch, labeller and scan are chosen anew")
    tried.add_argument("--pitch-mm", type=float, action="append", metavar="MM", help="only this one; can be repeated")
    tried.add_argument("--labeller", action="append", metavar="NAME", help="only this one; can be repeated")
    tried.add_argument("--scan", action="append", metavar="NAME", help="only this one; can be repeated")
    tried.add_argument("--baud", type=int, action="append", help="(default: the Skin's); can be repeated")
    tried.add_argument("--host-us", type=float, metavar="US", help="the host finds zones in bitmaps, in this time")
    parser.add_argument(
        "--placements", type=int, metavar="N", help="scenes to choose with (default: the file's, or 500)"
    )
    parser.add_argument("--seed", type=int, help="of the places (default: the file's, or 0)")
    parser.add_argument("--quick", action="store_true", help="do not look which of the refused ones are cheaper")
    parser.add_argument("--jobs", type=int, metavar="N", help="processes (default: one a core)")
    parser.add_argument("--dask", metavar="ADDRESS", help="scheduler of a Dask cluster that does the work instead")
    parser.add_argument("--output", metavar="FILE", help="write the Skin to this TOML file")
    parser.add_argument("--json", action="store_true", help="one JSON object")


def _limit(goals: argparse._ArgumentGroup, flag: str, unit: str, usual: float | None, what: str) -> None:
    shown = "none" if usual is None else f"{usual:g}"
    goals.add_argument(flag, type=_number, default=usual, metavar=unit, help=f"{what} (default: {shown})")


def _number(text: str) -> float | None:
    return None if text == "none" else float(text)
