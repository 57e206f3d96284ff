"""The command `contactfpga replay`."""

from __future__ import annotations

import argparse
import json
import time

from contactfpga import terminal
from contactfpga.skin import Skin
from contactfpga.tools.console import flags, numbers, results

EXTRA = "sim"


def add_flags(flag: flags.Flags) -> None:
    flag("FRAMES.npy", "Array (frames, rows, columns) of bool or numbers.")
    flag("--connectivity", "Neighbors of a cell: 8 with corners, 4 without.", (4, 8), 8)
    flag("--threshold X", "Count cells above this as pressed; needed for numbers.", numbers.CELL)
    flag("--pitch-mm MM", "Distance between rows and between columns in mm.", numbers.PITCH_MM, 10.0)
    divided = "Divide barycenters on the board, to 1/2^K cell (default: the host divides)."
    flag("--barycenter-bits K", divided, numbers.whole(*Skin.limits("barycenter_bits")))
    ends = "The last column is a neighbor of the first: the sheet is a cylinder (docs/skin.md#closed-sheets)."
    flag("--closed", ends)
    flags.json(flag, flags.FRAMES)


def run(args: argparse.Namespace) -> int:
    from contactfpga_sim.model.board import replay

    frames, skin = replay.load(
        args.frames, args.threshold, args.connectivity, args.pitch_mm, args.barycenter_bits, args.closed
    )
    started = time.monotonic()
    if args.json:
        for index, result in enumerate(replay.replay(frames, skin)):
            print(json.dumps(replay.to_json(index, result, skin)))
        return 0
    counts, late = [0], [0]
    for result in replay.replay(frames, skin):
        counts.append(result.frame.zones)
        late.append(result.last_record or 0)
    seconds = time.monotonic() - started
    closed = ", ends meet" if skin.closed else ""
    results.table(
        ("frames", f"{len(frames)} of {skin.rows}x{skin.columns}, {skin.connectivity}-connectivity{closed}"),
        ("zones", f"{sum(counts)}, at most {max(counts)} in a frame"),
        ("last record", f"at most {max(late)} clocks after a frame's last row"),
        ("speed", f"{len(frames) / seconds:,.0f} frames per second, once compiled"),
    )
    terminal.say("Every frame came back exactly once. Use --json for one JSON object per frame.")
    return 0
