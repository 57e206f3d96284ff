"""`contactfpga body ROBOT.toml`, and robot.toml that cannot be."""

from __future__ import annotations

import json
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from two_links import FLAT, ROBOT, ROUND, state_of, with_units

import contactfpga
from contactfpga.robot.body import Body, OpenBody, Snapshot
from contactfpga.tools import cli
from contactfpga.tools.commands.body import show
from contactfpga.zones.units import UnitSamples

UNITS = contactfpga.examples() / "units.toml"


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('frame = "torso"', 'frame = "leg"', "link 'chest': frame is 'leg'; the URDF has no such link"),
        ('port = "b"', 'port = "a"', "links 'arm' and 'chest' have one port, 'a'"),
        ('port = "b"', 'port = "sim://?pace=2"', "port is 'sim://?pace=2'; virtual boards of a robot run in real"),
        ("mirrored = true", "late_s = 0.001", "link 'chest': late_s is 0.001; a board of this Skin may be silent for"),
        ("mirrored = true", "late_s = 1\nsilent_s = 0.5", "link 'chest': late_s is 1 and silent_s 0.5; late_s must be"),
        ("mirrored = true", 'surface = "none.npz"', "none.npz"),
        ("mirrored = true", f'units = "{UNITS}"', "link 'chest': its file of units has 6; the Skin has units = 0"),
        ("mirrored = true", "surface = {radius_mm = 3}", "link 'chest': surface is {'radius_mm': 3}; a cone is"),
        ("[0.1, 0.0, 0.0]", "[0.1, 0.0, 2000]", "link 'arm': point_m is [0.1, 0.0, 2000]"),
        ("two.urdf", "package://nobody/x.urdf", "no Python package 'nobody' is installed"),
        ('"round.toml"', "3", "link 'arm': skin is 3; it must be a text"),
    ],
)
def test_robot_that_cannot_be_is_refused_in_one_line(robot, capsys, old, new, says):
    robot.write_text(ROBOT.replace(old, new))
    assert cli.main(["body", str(robot)]) == 1
    printed = capsys.readouterr().err
    assert says in printed.replace("\n  ", " ")
    assert printed.startswith("contactfpga: ")


@pytest.mark.campaign  # compiles the boards of four links
def test_example_prints_contacts_in_the_base_frame(capsys):
    """Of four virtual links of a humanoid from a package."""
    pytest.importorskip("jvrc_description")
    example = str(contactfpga.examples() / "robot.toml")
    assert cli.main(["body", example, "--json", "--joint", "L_ELBOW_P=-0.8", "--timeout", "60"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert {name: link["status"] for name, link in found["links"].items()} == dict.fromkeys(
        ("left_forearm", "right_forearm", "chest", "left_shin"), "ok"
    )
    assert {one["link"] for one in found["contacts"]} == set(found["links"])
    assert {one["frame"] for one in found["contacts"]} == {"base"}
    chest = next(one for one in found["contacts"] if one["link"] == "chest")
    assert chest["normal"] == pytest.approx([1, 0, 0], abs=1e-5)
    assert cli.main(["body", example, "--joint", "L_ELBOW_P=-0.8", "--timeout", "60"]) == 0
    page = (Path(__file__).resolve().parents[2] / "docs" / "body.md").read_text(encoding="utf-8")
    shown = next(block.strip() for block in page.split("```") if block.startswith("\nleft_forearm: ok"))
    printed = re.sub(r"\d\.\d\d\d s old", "0.000 s old", capsys.readouterr().out).strip()
    assert printed == shown, "what the page shows"
    assert cli.main(["body", example, "--joint", "NECK=1"]) == 1
    assert "--joint 'NECK' is no joint of the URDF; it has R_HIP_P, " in capsys.readouterr().err


def test_command_says_that_contacts_of_a_lost_link_are_not_known(robot, capsys):
    assert cli.main(["body", str(robot), "--frame", "link", "--timeout", "0.2"]) == 1
    printed = capsys.readouterr().out
    assert printed.count("contacts not known") == 2
    assert "arm: lost (no frame yet; a cannot be opened" in printed


def test_command_waits_for_the_readings_that_belong_to_a_frame(robot, capsys, monkeypatch):
    """They come some milliseconds after it."""
    body = Body.load(with_units(robot))
    states = {"arm": state_of(ROUND, 3, 5, 10.0), "chest": state_of(FLAT, 3, 5, 10.0)}
    push = np.array([0.0, 0.0, -4.0])
    exerted = np.concatenate([push, np.cross([0.03, 0.05, 0.0], push)])
    units = body.links["chest"].units
    readings = units.zeros + np.linalg.pinv(units.matrix) @ exerted

    come = UnitSamples(0, tuple(readings.tolist()), (0.0,) * 6, (False,) * 6)

    def sleep(seconds):
        if seconds > 0.005:
            states["chest"].zones._units = come

    monkeypatch.setattr(OpenBody, "read", lambda self, timeout: Snapshot(body, 10.0, states))
    monkeypatch.setattr(show, "time", SimpleNamespace(sleep=sleep, monotonic=lambda: 0.0))
    assert cli.main(["body", str(robot), "--frame", "link", "--timeout", "0.2"]) == 0
    assert "mm2, pushes 4.00 N" in capsys.readouterr().out
