"""`contactfpga latency`: from a touch to the last byte and to the contact pin."""

from __future__ import annotations

import argparse
import dataclasses
import json
import re

from contactfpga import terminal
from contactfpga.skin import Skin
from contactfpga.tools.console import numbers

EXTRA = "sim"

CELLS = re.compile(r"([1-9][0-9]?)x([1-9][0-9]?)")


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the command's flags to its parser."""
    parser.add_argument("--skin", metavar="FILE", help="Skin to measure (default: the reference Skin).")
    size = "Rows and columns of the contact (default: 3x3, a fingertip)."
    parser.add_argument("--cells", type=_cells, default=(3, 3), metavar="HxW", help=size)
    count = "Number of places to touch, spread over the sheet (default: every place)."
    parser.add_argument("--touches", type=numbers.whole(1, 4096), metavar="N", help=count)
    parser.add_argument("--json", action="store_true", help="Print one JSON object.")


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from contactfpga_sim.lab import latency, pool

    skin = Skin.load(args.skin) if args.skin else Skin()
    with pool.progress() as step:
        found = latency.measure(skin, args.cells, args.touches, step)
    if args.json:
        print(json.dumps(dataclasses.asdict(found)))
        return 0
    height, width = args.cells
    sheet = f"{skin.rows}x{skin.columns}, scan {skin.scan!r}, {skin.clock_hz / 1e6:g} MHz, {skin.baud / 1e6:g} Mbaud"
    last, pin, change = found.touch_to_last_byte_us, found.touch_to_contact_us, found.change_to_last_byte_us
    for title, what in (
        ("sheet", sheet),
        ("contact", f"{height}x{width} cells at {found.touches} places, on the compiled gateware"),
        ("touch to last byte", f"{last.median:.1f} us median, {last.worst:.1f} us worst"),
        ("touch to contact pin", f"{pin.median:.2f} us median, {pin.worst:.2f} us worst"),
        ("change to last byte", f"{change.median:.1f} us median, {change.worst:.1f} us worst, with frames on the wire"),
        ("frames per second", f"{found.frames_per_s:,.0f} while it moves"),
        ("bytes", f"{found.bytes} in a frame with the contact"),
    ):
        terminal.say(f"{title:22}{what}", hang=22)
    return 0


def _cells(text: str) -> tuple[int, int]:
    found = CELLS.fullmatch(text)
    if not found:
        shown = numbers.shortened(text)
        raise argparse.ArgumentTypeError(f"{shown!r} is not a size; write rows x columns of the contact, such as 3x3")
    return int(found[1]), int(found[2])
