"""The command `contactfpga zones`."""

from __future__ import annotations

import argparse
import contextlib
import json

from contactfpga.driver.board import Board
from contactfpga.errors import ReplayEnded
from contactfpga.robot.haptics import WithReadings
from contactfpga.robot.haptics.live import FrameSource
from contactfpga.tools.console import flags, interrupt, live
from contactfpga.tools.console.forces import Forces
from contactfpga.tracking.places import Places
from contactfpga.tracking.tracker import Tracker
from contactfpga.tracking.tracks import Tracks
from contactfpga.zones.zone import Zones

EXTRA = None


def add_flags(flag: flags.Flags) -> None:
    flags.connection(flag)
    flags.once(flag)
    flags.seconds(flag)
    flags.json(flag, flags.FRAMES)
    flag("--tracks", "Follow contacts: show ids that stay from frame to frame.")
    flag("--place-by FILE", "Follow contacts, and place them by this table of `contactfpga cover places`.")
    flags.forces(flag, "Show the force at each zone too")
    flag("--record FILE", "Write every byte received to this new file; replay://FILE plays it back.")


def run(args: argparse.Namespace) -> int:
    flags.check_forces(args)
    if args.json:
        return _json(args)
    from contactfpga.tools.console import views  # rich, which scripts do without

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
    """Follows contacts over all frames, also those not shown, for ids or forces."""

    def __init__(self, args: argparse.Namespace, forces: Forces | None):
        places = Places.load(args.place_by) if args.place_by else None
        self._tracker = Tracker(places=places) if args.tracks or places else None
        self._seconds: float | None = args.seconds
        self.tracks: Tracks | None = None
        self.forces = forces

    def frames(self, board: Board) -> FrameSource:
        frames: FrameSource = board if self.forces is None else WithReadings(board)
        return frames if self._seconds is None else _TimeLimit(frames, self._seconds)

    def take(self, zones: Zones) -> None:
        if self._tracker is not None:
            self.tracks = self._tracker.update(zones)
        if self.forces is not None:
            self.forces.take(zones, self.tracks)


class _TimeLimit:
    def __init__(self, frames: FrameSource, seconds: float):
        self._frames, self._left_us = frames, seconds * 1e6
        self._before_us: int | None = None

    def next(self, timeout: float = 1.0) -> Zones:
        zones = self._frames.next(timeout)
        if self._before_us is not None:  # a board that was restarted begins at 0
            self._left_us -= max(0, zones.time_us - self._before_us)
        self._before_us = zones.time_us
        if self._left_us <= 0:
            raise ReplayEnded("the time is over")
        return zones


def _json(args: argparse.Namespace) -> int:
    with flags.opened(args, args.record) as board:
        follow = _Follow(args, Forces.of(board, args.units, args.friction))
        frames = follow.frames(board)
        with contextlib.nullcontext() if args.once else interrupt.usual_end(), contextlib.suppress(ReplayEnded):
            while True:
                zones = frames.next(args.timeout)
                follow.take(zones)
                more = {} if follow.tracks is None else follow.tracks.to_dict()
                if follow.forces is not None:
                    more |= follow.forces.to_dict()
                print(json.dumps(zones.to_dict() | more), flush=True)
                if args.once:
                    break
    return 0
