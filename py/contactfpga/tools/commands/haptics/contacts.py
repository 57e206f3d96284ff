"""The command `contactfpga haptics contacts`."""

from __future__ import annotations

import argparse
from typing import Any

from contactfpga import terminal
from contactfpga.robot.haptics import Center, Contacts, contacts
from contactfpga.tools.commands.haptics import reading
from contactfpga.tools.console import flags, results

EXTRA = "haptics"


def add_flags(flag: flags.Flags) -> None:
    flag("FILE.json", "The wrench, with contacts or a surface; docs/haptics.md has the format.")
    flag("--cones", "Take forces within friction's cones also where pushes along the normals suffice.")
    flags.json(flag, flags.SI)


def run(args: argparse.Namespace) -> int:
    wrench, touches, surface = reading.contacts(args.file)
    found = contacts(wrench, touches, surface, cones=args.cones)
    answer = _answer(found)
    if surface is not None:
        answer["center_of_pressure"] = None if found.center is None else _center(found.center)
    results.show(args, answer, lambda: _show(found, surface is not None))
    return 0


def _answer(found: Contacts) -> dict[str, Any]:
    ones = [{name: one.to_dict()[name] for name in ("force_n", "normal_n", "interval_n")} for one in found]
    spaces = {"model": found.model, "rank": found.rank, "null_space": found.null_space}
    return {"contacts": ones, **spaces, "chi2": found.chi2}


def _center(center: Center) -> dict[str, Any]:
    names = ("normal_n", "tangential_n", "torsion_nm")
    return {"point_m": list(center.point_m), **{name: getattr(center, name) for name in names}}


def _show(found: Contacts, asked_center: bool) -> None:
    for number, one in enumerate(found):
        low, high = one.interval_n or (0.0, None)
        upper = "no limit" if high is None else f"{high:.4g} N"
        # What is rounding is shown as 0.
        x, y, z = (round(part, 9) + 0.0 for part in one.force_n or ())
        terminal.say(
            f"contact {number}: pushes {one.normal_n:.4g} N, from {low:.4g} N to {upper} as friction allows; force "
            f"({x:.4g}, {y:.4g}, {z:.4g}) N",
            hang=2,
        )
    if asked_center:
        terminal.say(_of_center(found.center), hang=2)
    chi2 = "" if found.chi2 is None else f", chi2 {found.chi2:.4g} with {found.freedom} degrees of freedom"
    terminal.say(f"model {found.model}, rank {found.rank}, nullity {len(found.null_space)}{chi2}", hang=2)
    if found.beyond_friction:
        terminal.say(
            "no forces within friction's limits exert this wrench: the intervals hold for any friction", hang=2
        )
    if found.alarm:
        terminal.say("chance explains this wrench less than once in a thousand times: something else touches", hang=2)


def _of_center(center: Center | None) -> str:
    if center is None:
        return "no center of pressure: a single push on this surface does not exert the wrench"
    x, y, z = (1e3 * one for one in center.point_m)
    return (
        f"center of pressure: ({x:.4g}, {y:.4g}, {z:.4g}) mm, pushes {center.normal_n:.4g} N, drags "
        f"{center.tangential_n:.4g} N, turns {center.torsion_nm:.4g} Nm about the normal"
    )
