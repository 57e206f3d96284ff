"""The command `contactfpga body ROBOT.toml`."""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Sequence

from contactfpga import terminal
from contactfpga.inputs.values import number_in
from contactfpga.robot.body import Body, LinkContact, Snapshot
from contactfpga.robot.body.snapshot import BASE, LINK
from contactfpga.tools.console import flags, numbers, results

EXTRA = None

READINGS_S = 0.03
"""Delay of a frame's pressure unit readings."""


def add_flags(flag: flags.Flags) -> None:
    flag("ROBOT.toml", "The robot's links; docs/body.md has the format.")
    frame = "Frame of the contacts: base, or link for each link's own (default: base, or link without a URDF)."
    flag("--frame", frame, (BASE, LINK))
    joint = "Angle of a joint in rad, or m of one that slides; may be repeated (default: 0)."
    flag("--joint NAME=RAD ...", joint, angle, [])
    flag("--seconds S", "Print the state every second, for this long (default: once).", numbers.SECONDS)
    flags.json(flag, "Print a line with one JSON object each time.")
    flag("--timeout S", "Seconds to wait for each board.", numbers.SECONDS, 1.0)


def angle(text: str) -> tuple[str, float]:
    """Parse NAME=RAD."""
    name, _, value = text.partition("=")
    found = number_in(value)
    if not name or not math.isfinite(found):
        raise argparse.ArgumentTypeError(f"{numbers.shortened(text)!r} must be NAME=RAD, with a finite number")
    return name, found


def run(args: argparse.Namespace) -> int:
    """Run the topic; returns 1 if a link has no data."""
    body = Body.load(args.robot)
    angles = _angles(body, dict(args.joint))
    frame = args.frame or (LINK if body.kinematics is None else BASE)
    with body.open(lambda _: angles, timeout=args.timeout) as opened:
        until = time.monotonic() + (args.seconds or 0.0)
        while True:
            snapshot = opened.read(args.timeout)
            if any(plan.units is not None for plan in body.links.values()):
                time.sleep(READINGS_S)
            _print(snapshot, frame, args)
            left = until - time.monotonic()
            if left <= 0:
                return 0 if len(snapshot.answering) == len(snapshot.links) else 1
            time.sleep(min(left, 1.0))


def _angles(body: Body, given: dict[str, float]) -> dict[str, float]:
    names = () if body.kinematics is None else body.kinematics.joint_names
    for name in given:
        if name not in names:
            raise ValueError(f"--joint {name!r} is no joint of the URDF; it has {', '.join(names) or 'none'}")
    return dict.fromkeys(names, 0.0) | given


def _print(snapshot: Snapshot, frame: str, args: argparse.Namespace) -> None:
    contacts = snapshot.contacts(frame, links=snapshot.answering)
    links = {
        name: {"status": one.status, "age_s": one.age_s, "reason": one.reason} for name, one in snapshot.links.items()
    }
    answer = {"host_time_s": snapshot.host_time_s, "links": links, "contacts": contacts}
    results.show(args, answer, lambda: _show(snapshot, contacts))


def _show(snapshot: Snapshot, contacts: Sequence[LinkContact]) -> None:
    for name, state in snapshot.links.items():
        mine = [one for one in contacts if one.link == name]
        what = f"{len(mine)} contact{'' if len(mine) == 1 else 's'}" if state.status == "ok" else "contacts not known"
        terminal.say(f"{name}: {state}; {what}", hang=2)
        for one in mine:
            terminal.say(f"  {_line(one)}", hang=4)


def _line(one: LinkContact) -> str:
    where = "no single place"
    if one.point_m is not None and one.normal is not None:
        x, y, z = (f"{1e3 * value:.1f}" for value in one.point_m)
        nx, ny, nz = (f"{round(value, 2) + 0.0:.2f}" for value in one.normal)
        where = f"{one.frame} ({x}, {y}, {z}) mm, normal ({nx}, {ny}, {nz})"
    push = "" if one.normal_n is None else f", pushes {one.normal_n:.2f} N"
    marks = sorted(one.flags) + ([f"{one.fold:.0%} as the cover folds"] if one.fold else [])
    marked = f", {', '.join(marks)}" if marks else ""
    return f"{where}, {one.zone.area_mm2:.0f} mm2{push}{marked}"
