"""`contactfpga zones`: the contact zones, live, as a table beside the drawn sheet, or as JSON."""

from __future__ import annotations

import argparse
import json

from contactfpga.console import flags
from contactfpga.tracking.tracker import Tracker
from contactfpga.tracking.tracks import Tracks
from contactfpga.zones.zone import Zones

HELP = "Show the contact zones live."
EXTRA = None


def add_flags(parser: argparse.ArgumentParser) -> None:
    """Add the command's flags to its parser."""
    flags.connection(parser)
    flags.once(parser)
    parser.add_argument("--json", action="store_true", help="Print every frame as a line with one JSON object.")
    parser.add_argument(
        "--tracks", action="store_true", help="Follow contacts: show ids that stay from frame to frame."
    )
    record = "Write every byte received to this file; replay://FILE plays it back."
    parser.add_argument("--record", metavar="FILE", help=record)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    if args.json:
        return _json(args)
    from contactfpga.console import live, views  # rich, which scripts do without

    follow = _Follow(args.tracks)
    with flags.opened(args, args.record) as board:
        return live.show(
            board, args, lambda zones, room: views.zones_view(board, zones, room, follow.tracks), follow.take
        )


class _Follow:
    """Follows contacts over all frames, also those that are not shown, where ids are asked for."""

    def __init__(self, wanted: bool):
        self._tracker = Tracker() if wanted else None
        self.tracks: Tracks | None = None

    def take(self, zones: Zones) -> None:
        if self._tracker is not None:
            self.tracks = self._tracker.update(zones)


def _json(args: argparse.Namespace) -> int:
    follow = _Follow(args.tracks)
    with flags.opened(args, args.record) as board:
        for zones in board:
            follow.take(zones)
            more = {} if follow.tracks is None else follow.tracks.to_dict()
            print(json.dumps(zones.to_dict() | more), flush=True)
            if args.once:
                break
    return 0
