"""The command `contactfpga body register`."""

from __future__ import annotations

import argparse
import dataclasses
import math
import sys

from contactfpga import terminal
from contactfpga.driver import driver
from contactfpga.driver.board import Board
from contactfpga.inputs.values import shown
from contactfpga.robot.body import Body, registration
from contactfpga.robot.body.plan import Plan
from contactfpga.robot.body.registration import Press, Registration
from contactfpga.tools.console import flags, numbers, results

EXTRA = None


def add_flags(flag: flags.Flags) -> None:
    flag("ROBOT.toml", "The robot's links; docs/body.md has the format.")
    flag("LINK", "Name of the link.")
    points = "Known points on the link, a [[point]] with point_m each; you press those without pressed_mm when asked."
    flag("POINTS.toml", points)
    flag("--wait S", "Seconds to wait for each press.", numbers.SECONDS, 60.0)
    flags.json(flag)


def run(args: argparse.Namespace) -> int:
    plan = link(Body.load(args.robot), args.link)
    presses = registration.load(args.points)
    if any(press.pressed_mm is None for press in presses):
        with driver.open(plan.port, plan.skin) as board:
            presses = [_pressed(board, plan, number, press, args) for number, press in enumerate(presses, 1)]
    found = registration.register(plan, presses)
    results.show(args, _values(found), lambda: _show(found, plan))
    return 0


def link(body: Body, name: str) -> Plan:
    if name not in body.links:
        raise ValueError(f"link {shown(name)} is not known; there are {', '.join(body.links)}")
    return body.links[name]


def _pressed(board: Board, plan: Plan, number: int, press: Press, args: argparse.Namespace) -> Press:
    if press.pressed_mm is not None:
        return press
    x, y, z = (f"{1e3 * value:.1f}" for value in press.point_m)
    asks = sys.stderr if args.json else None
    terminal.say(f"press point {number}, ({x}, {y}, {z}) mm, and nothing else", asks)
    until = board.clock() + args.wait
    frames = board.subscribe(maxsize=4096)

    def coming():  # type: ignore[no-untyped-def]
        for zones in frames:
            if board.clock() > until:
                raise ValueError(f"point {number} was not pressed within {args.wait:g} s, or not by a single zone")
            yield zones

    with frames:
        place = registration.held(coming(), max(plan.skin.pitch_x_mm, plan.skin.pitch_y_mm))
        terminal.say(f"  zone at x {place[0]:.2f} mm, y {place[1]:.2f} mm; let go", asks, hang=2)
        for zones in coming():
            if not len(zones):
                break
    return dataclasses.replace(press, pressed_mm=place)


def _values(found: Registration) -> dict[str, object]:
    values = {field.name: getattr(found, field.name) for field in dataclasses.fields(found) if field.name != "pose"}
    return {
        "point_m": found.pose.point_m,
        "rpy_rad": found.pose.rpy_rad,
        "rms_mm": found.rms_mm,
    } | values


def _show(found: Registration, plan: Plan) -> None:
    print(found.to_toml(), end="")
    terminal.say(
        f"residual {found.rms_mm:.2f} mm ({found.other_mm:.1f} mm if it were {_other(found)}); known to "
        f"{found.sigma_mm:.2f} mm and {math.degrees(found.sigma_rad):.2f} degrees",
        hang=2,
    )
    changes = []
    if found.mirrored != plan.mirrored:
        changes.append("mirrored" if found.mirrored else "not mirrored")
    if found.turned_rad > 3 * found.sigma_rad:
        changes.append(f"turned by {math.degrees(found.turned_rad):.1f} degrees")
    if changes:
        terminal.say(f"against robot.toml it is {' and '.join(changes)}", hang=2)


def _other(found: Registration) -> str:
    return "not mirrored" if found.mirrored else "mirrored"
