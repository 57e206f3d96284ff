"""The command `contactfpga ros`."""

from __future__ import annotations

import argparse

from contactfpga import terminal
from contactfpga.robot.haptics import WithReadings
from contactfpga.robot.ros import MAX_DOMAIN
from contactfpga.tools.console import flags, interrupt, numbers
from contactfpga.tools.console.forces import Forces

EXTRA = "ros"


def add_flags(flag: flags.Flags) -> None:
    flags.connection(flag)
    name = "Namespace of the topics (default: skin, so that zones are in /skin/zones)."
    flag("--namespace NAME", name, default="skin")
    flag("--frame NAME", "Name of the link's frame (default: the board's name, or skin).", default="")
    flag("--parent NAME", "Publish where the link's frame lies in this one, on /tf_static.", default="")
    flag("--origin-m X Y Z", "Origin of the link's frame there, in m.", numbers.number(-100, 100, "m"), (0.0, 0.0, 0.0))
    turn = "Its roll, pitch and yaw in rad: turns about the fixed x, y and z axes, one after the other."
    flag("--rpy R P Y", turn, numbers.TURN, (0.0, 0.0, 0.0))
    rate = "Publish zones, tracks and contacts at most at this rate."
    flag("--zones-hz HZ", rate, numbers.number(0, 1e5, "Hz", above=True), 1000.0)
    flags.forces(flag, "Publish forces too")
    flag("--domain ID", "ROS_DOMAIN_ID.", numbers.whole(0, MAX_DOMAIN), 0)
    flag("--network", "Reach nodes on other computers too; without it only those on this one.")
    flags.seconds(flag)


def run(args: argparse.Namespace) -> int:
    from contactfpga.robot.ros.dds import Publisher
    from contactfpga.robot.ros.feed import Feed
    from contactfpga.robot.ros.settings import Settings

    flags.check_forces(args)
    settings = Settings(
        frame=args.frame, parent=args.parent, place_m=args.origin_m, turn_rad=args.rpy, zones_hz=args.zones_hz
    )
    with Publisher(args.namespace, args.domain, args.network) as publisher, flags.opened(args) as board:
        forces = Forces.of(board, args.units, args.friction)
        feed = Feed(board, publisher.send, settings, None if forces is None else forces.of_frame)
        reach = "all computers of the network" if args.network else "this computer"
        until = None if args.seconds is None else board.clock() + args.seconds
        with interrupt.usual_end():
            terminal.say(f"publishing {publisher.topic('zones')} and the other topics to {reach}; Ctrl-C ends it")
            feed.run(WithReadings(board) if forces else board, lambda: until is not None and board.clock() >= until)
    return 0
