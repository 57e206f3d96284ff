"""`contactfpga zones`: the contact zones, live, as a table beside the drawn sheet, or as JSON."""

from __future__ import annotations

import argparse
import contextlib
import json

from contactfpga.console import flags, interrupt
from contactfpga.console.forces import Forces
from contactfpga.driver.board import Board
from contactfpga.haptics import WithReadings
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
    flags.forces(parser, "Show the force at each zone too")
    record = "Write every byte received to this new file; replay://FILE plays it back."
    parser.add_argument("--record", metavar="FILE", help=record)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    flags.check_forces(args)
    if args.json:
        return _json(args)
    from contactfpga.console import live, views  # rich, which scripts do without

    with flags.opened(args, args.record) as board:
        follow = _Follow(args, Forces.of(board, args.units, args.friction))
        return live.show(
            board,
            args,
            lambda zones, room: views.zones_view(board, zones, room, follow.tracks, follow.forces),
            follow.take,
            follow.frames(board),
        )


class _Follow:
    """Follows contacts over all frames, also those that are not shown, where ids or forces are asked for."""

    def __init__(self, args: argparse.Namespace, forces: Forces | None):
        self._tracker = Tracker() if args.tracks else None
        self.tracks: Tracks | None = None
        self.forces = forces

    def frames(self, board: Board) -> Board | WithReadings:
        """The board's frames; with forces, each once its readings are known."""
        return board if self.forces is None else WithReadings(board)

    def take(self, zones: Zones) -> None:
        if self._tracker is not None:
            self.tracks = self._tracker.update(zones)
        if self.forces is not None:
            self.forces.take(zones, self.tracks)


def _json(args: argparse.Namespace) -> int:
    with flags.opened(args, args.record) as board:
        follow = _Follow(args, Forces.of(board, args.units, args.friction))
        with contextlib.nullcontext() if args.once else interrupt.usual_end():
            for zones in follow.frames(board):
                follow.take(zones)
                more = {} if follow.tracks is None else follow.tracks.to_dict()
                if follow.forces is not None:
                    more |= follow.forces.to_dict()
                print(json.dumps(zones.to_dict() | more), flush=True)
                if args.once:
                    break
    return 0
