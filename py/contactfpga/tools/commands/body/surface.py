"""The command `contactfpga body surface`."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from contactfpga import terminal
from contactfpga.robot.body.kinematics import Pose
from contactfpga.skin import Skin
from contactfpga.surfaces.laying import Placement, Triangles
from contactfpga.tools.console import flags, numbers, outputs, results

EXTRA = "surface"

_LENGTH = numbers.number(-1e5, 1e5, "mm")


def add_flags(flag: flags.Flags) -> None:
    flag("MESH", "An .stl or .obj file (.ply and .off, too).")
    flag("TABLE.npz", "File to write; robot.toml names it as a link's surface.", dest="output")
    flag("--skin FILE", "The sheet (default: the reference Skin).")
    by = (
        "Unrolling winds the sheet around the frame's z axis without stretching it; projection goes straight down "
        "along z."
    )
    flag("--by", by, ("unrolling", "projection"), "unrolling")
    flag("--origin-mm X Y Z", "Origin of the sheet's frame in the mesh's, in mm.", _LENGTH, (0, 0, 0))
    flag("--rpy R P Y", "Its roll, pitch and yaw in rad.", numbers.TURN, (0, 0, 0))
    scale = "Millimeters per unit of the mesh (default: 1; 1000 for a mesh in meters)."
    flag("--scale MM", scale, numbers.number(1e-6, 1e6, "mm"), 1.0)
    flags.json(flag)


def run(args: argparse.Namespace) -> int:
    skin = Skin() if args.skin is None else Skin.load(args.skin)
    if skin.closed and args.by != "unrolling":
        raise ValueError("the ends of the Skin's sheet meet, so it goes round; use --by unrolling")
    output = outputs.file(args.output, "TABLE.npz")
    triangles = Triangles.load(args.mesh, args.scale)
    pose = Pose.of(args.origin_mm, args.rpy)
    laid = Placement(
        skin.rows, skin.columns, skin.pitch_x_mm, skin.pitch_y_mm, pose.rotation, np.array(args.origin_mm, float)
    )
    table = laid.unrolled(triangles, closed=skin.closed) if args.by == "unrolling" else laid.projected(triangles)
    table.save(output)
    answer = {
        "file": output,
        "rows": skin.rows,
        "columns": skin.columns,
        "triangles": len(triangles.corners_mm),
        "spacing_mm": table.spacing_mm,
    }
    results.show(args, answer, lambda: _show(answer, skin))
    return 0


def _show(answer: dict[str, Any], skin: Skin) -> None:
    (x_low, x_high), (y_low, y_high) = answer["spacing_mm"]
    terminal.say(f"{answer['file']}: {skin.rows}x{skin.columns} cells on {answer['triangles']} triangles")
    terminal.say(
        f"neighbors lie {x_low:.2f} to {x_high:.2f} mm apart along rows (pitch {skin.pitch_x_mm:g}), {y_low:.2f} to "
        f"{y_high:.2f} along columns (pitch {skin.pitch_y_mm:g})",
        hang=2,
    )
