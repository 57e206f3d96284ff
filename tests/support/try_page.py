"""The page that runs a board in a browser: its assembler, and its scripts under Node."""

import importlib.util
import json
import shutil
import subprocess
from pathlib import Path

import pytest

from contactfpga.design.cover import BODIES, Ellipse, Load

ROOT = Path(__file__).parents[2]
SOURCES = ROOT / "docs/try"
NODE = shutil.which("node")

needs_node = pytest.mark.skipif(NODE is None, reason="Node is not installed")


def _assembler():
    spec = importlib.util.spec_from_file_location("assemble", SOURCES / "assemble.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


assemble = _assembler()


def node(script: str, *arguments: str, given: str, timeout: float = 200) -> str:
    """What a script in tests/browser writes."""
    command = [NODE, ROOT / "tests/browser" / script, *arguments]
    done = subprocess.run(command, input=given, capture_output=True, text=True, timeout=timeout)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def kit() -> str:
    """What the page's scripts know of the kit, as JSON."""
    return json.dumps(assemble.facts())


def load(cells, finger):
    """How a finger of the page presses cells."""
    half_m = finger["radius_mm"] * 1e-3
    pressed = cells.indentation([Ellipse(half_m, half_m)], BODIES["finger"])
    (part,) = pressed.parts_at(pressed.depth_m(finger["force_n"]))
    return Load((part.placed(finger["x_mm"] * 1e-3, finger["y_mm"] * 1e-3, 0.0),), finger["force_n"])
