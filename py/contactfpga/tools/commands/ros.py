"""The command `contactfpga ros`."""

from __future__ import annotations

import argparse

from contactfpga import terminal
from contactfpga.robot.haptics import WithReadings
from contactfpga.robot.ros import MAX_DOMAIN
from contactfpga.tools.console import flags, interrupt, numbers
from contactfpga.tools.console.forces import Forces

EXTRA = "ros"


def add_flags(parser: argparse.ArgumentParser) -> None:
    flags.connection(parser)
    name = "Namespace of the topics (default: skin, so that zones are in /skin/zones)."
    parser.add_argument("--namespace", metavar="NAME", default="skin", help=name)
    frame = "Name of the link's frame (default: the board's name, or skin)."
    parser.add_argument("--frame", metavar="NAME", default="", help=frame)
    parent = "Publish where the link's frame lies in this one, on /tf_static."
    parser.add_argument("--parent", metavar="NAME", default="", help=parent)
    place = "Origin of the link's frame there, in m (default: 0 0 0)."
    parser.add_argument(
        "--origin-m",
        nargs=3,
        type=numbers.number(-100, 100, "m"),
        metavar=("X", "Y", "Z"),
        default=(0.0, 0.0, 0.0),
        help=place,
    )
    turn = (
        "Its roll, pitch and yaw in rad: turns about the fixed x, y and z axes, one after the other (default: 0 0 0)."
    )
    parser.add_argument(
        "--rpy", nargs=3, type=numbers.TURN, metavar=("R", "P", "Y"), default=(0.0, 0.0, 0.0), help=turn
    )
    rate = "Publish zones, tracks and contacts at most at this rate (default: 1000)."
    parser.add_argument(
        "--zones-hz", type=numbers.number(0, 1e5, "Hz", above=True), metavar="HZ", default=1000.0, help=rate
    )
    flags.forces(parser, "Publish forces too")
    domain = "ROS_DOMAIN_ID (default: 0)."
    parser.add_argument("--domain", type=numbers.whole(0, MAX_DOMAIN), metavar="ID", default=0, help=domain)
    network = "Reach nodes on other computers too; without it only those on this one."
    parser.add_argument("--network", action="store_true", help=network)
    flags.seconds(parser)


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
