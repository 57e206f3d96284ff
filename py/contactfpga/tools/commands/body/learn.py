"""The command `contactfpga body learn`."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator
from typing import Any, TextIO

import numpy as np

from contactfpga import terminal
from contactfpga.driver.board import Board
from contactfpga.inputs.values import number_in, shown
from contactfpga.robot.body import Body, folds
from contactfpga.robot.body.body import OpenBody
from contactfpga.robot.body.plan import Plan
from contactfpga.robot.body.reader import open_board
from contactfpga.tools.commands.body.register import link
from contactfpga.tools.commands.wire.settle import restored
from contactfpga.tools.console import flags, numbers, outputs, results
from contactfpga.zones.zone import Zones

EXTRA = None
MAX_LINE = 200


def add_flags(flag: flags.Flags) -> None:
    flag("ROBOT.toml", "The robot's links; docs/body.md has the format.")
    flag("LINK", "Name of the link whose sheet folds.")
    flag("JOINT", "Name of the joint that folds it.")
    flag("FOLDS.json", "File to write; robot.toml names it as the link's folds.", dest="output")
    step = "Width of a step of the angle; folds are learned per step."
    flag("--step RAD", step, numbers.number(1e-4, 1, "rad"), folds.STEP_RAD)
    flags.json(flag)
    flag.parser.epilog = "Reads the joint's angle from standard input, in rad, one per line, until the input ends."


def run(args: argparse.Namespace) -> int:
    body = Body.load(args.robot)
    plan = link(body, args.link)
    _check(body, plan, args.joint)
    output = outputs.file(args.output, "FOLDS.json")
    terminal.say(f"move {args.joint} slowly over its whole range, twenty times; nobody may touch the cover", sys.stderr)
    try:
        with OpenBody(Body({plan.name: plan}), opened=_with_margin) as opened:
            found = folds.learn(args.joint, _pairs(opened, plan.name, sys.stdin), args.step)
    finally:
        _restore(plan)
    if not found.frames:
        raise ValueError("no angle came on standard input; let the robot write one per line")
    found.save(output)
    first, last = min(found.frames), max(found.frames)
    answer = {
        "file": output,
        "frames": sum(found.frames.values()),
        "from_rad": first * found.step_rad,
        "to_rad": (last + 1) * found.step_rad,
        "cells": np.any(list(found.reached.values()), axis=0).sum(),
        "steps": len(found.frames),
        "steps_pressed": sum(bool(one.any()) for one in found.reached.values()),
        "steps_missed": last - first + 1 - len(found.frames),
    }
    results.show(args, answer, lambda: _show(answer))
    return 0


def _show(answer: dict[str, Any]) -> None:
    steps, missed = answer["steps"], answer["steps_missed"]
    terminal.say(
        f"{answer['file']}: {answer['frames']} frames from {answer['from_rad']:.2f} to {answer['to_rad']:.2f} rad, "
        f"{answer['cells']} cells pressed somewhere, at {answer['steps_pressed']} of {steps} steps",
        hang=2,
    )
    if missed:
        missing = f"no frame came at {missed} of the {steps + missed - 2} steps between"
        terminal.say(f"{missing}: move more slowly, or folds there are not marked", hang=2)


def _check(body: Body, plan: Plan, joint: str) -> None:
    names = None if body.kinematics is None else body.kinematics.joint_names
    if names is not None and joint not in names:
        raise ValueError(f"joint {shown(joint)} is no joint of the URDF; it has {', '.join(names)}")
    if plan.skin.report != "cells":
        raise ValueError(
            f'link {shown(plan.name)}: its Skin has report = "{plan.skin.report}"; folds are learned cell by cell, so '
            'build it with report = "cells"'
        )


def _with_margin(plan: Plan) -> Board:
    """The link's board, which samples harder levels later (:func:`contactfpga.robot.body.folds.instants`)."""
    board = open_board(plan)
    try:
        for level, instant in enumerate(folds.instants(plan.skin), 2):
            board.sample_at(instant, level=level)
    except BaseException:
        board.close()
        raise
    return board


def _restore(plan: Plan) -> None:
    if plan.skin.harder:
        with open_board(plan) as board:
            for left in restored(board, 1.0):
                terminal.say(left.sentence, sys.stderr)


def _pairs(opened: OpenBody, name: str, lines: TextIO) -> Iterator[tuple[float, Zones]]:
    """Each angle with a later frame, until a link lacks data, since unseen cells are not free."""
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        angle = number_in(line[:MAX_LINE])
        if not math.isfinite(angle):
            raise ValueError(
                f"line {number} of standard input is {numbers.shortened(line.strip())!r}; it must be an angle in rad"
            )
        state = opened.read().links[name]
        if state.status != "ok" or state.zones is None:
            raise ValueError(f"link {name!r}: {state}; nothing can be learned without data")
        yield angle, state.zones
