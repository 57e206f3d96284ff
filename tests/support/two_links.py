"""A robot of two links for tests: its files, and boards behind its ports that come and go."""

from __future__ import annotations

import shutil
import time

from model_board import DirectPort

import contactfpga
from contactfpga.robot.body.state import LinkState

URDF = """<robot name="two"><link name="torso"/><link name="arm"/>
<joint name="elbow" type="revolute"><parent link="torso"/><child link="arm"/>
<origin xyz="0.5 0 1"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint></robot>"""

ROBOT = """
urdf = "two.urdf"
[[links]]
name = "arm"
skin = "round.toml"
port = "a"
point_m = [0.1, 0.0, 0.0]
rpy_rad = [0.0, 1.5707963267948966, 0.0]
[[links]]
name = "chest"
frame = "torso"
skin = "flat.toml"
port = "b"
mirrored = true
"""
ROUND = contactfpga.Skin(surface="cylinder", radius_mm=40.0)
FLAT = contactfpga.Skin()


def write_robot(folder):
    """Its files; returns robot.toml."""
    (folder / "two.urdf").write_text(URDF)
    (folder / "round.toml").write_text(ROUND.to_toml())
    (folder / "flat.toml").write_text(FLAT.to_toml())
    (folder / "robot.toml").write_text(ROBOT)
    return folder / "robot.toml"


def with_units(robot):
    """Pressure units under the chest."""
    robot.write_text(ROBOT.replace("mirrored = true", 'units = "units.toml"'))
    (robot.parent / "flat.toml").write_text(FLAT.replace(units=6, baud=6_000_000).to_toml())
    shutil.copy(contactfpga.examples() / "units.toml", robot.parent / "units.toml")
    return robot


class Streaming(DirectPort):
    """Sends a frame every 5 ms, and nothing once it is mute. Its clock runs as the host's does."""

    mute = False
    due_s = 0.0

    def frame(self, **options):
        self.time_us = max(self.time_us, round(1e6 * time.monotonic()))
        return super().frame(**options)

    def read(self, seconds):
        if not self._out and seconds:
            time.sleep(0.001)
        if not self.mute and time.monotonic() >= self.due_s:
            self.due_s = time.monotonic() + 0.005
            self._out += self.frame()
        return super().read(seconds)

    def clock(self):
        return time.monotonic()


class PluggedPorts:
    """Ports by name, for :class:`OpenBody`."""

    def __init__(self):
        self.ports = {}
        self.skins = {"a": ROUND, "b": FLAT}
        for name in self.skins:
            self.plug(name)

    def plug(self, name):
        self.ports[name] = Streaming(self.skins[name])

    def opened(self, plan):
        if plan.port not in self.ports:
            raise contactfpga.PortNotFound(f"{plan.port} is not there")
        return contactfpga.open(self.ports[plan.port], plan.skin)


def state_of(skin, x_cells, y_cells, frame_s):
    board = DirectPort(skin)
    board.moments = [(4, 4 * x_cells, 4 * y_cells)]
    with contactfpga.open(board, skin) as opened:
        return LinkState(opened.read(), 0.0, "ok", "", frame_s)
