"""ROS 2: what a board says as messages of ``contactfpga_msgs``, and a way to publish them without ROS (docs/ros.md)."""

from __future__ import annotations

from contactfpga.robot.ros.types import PACKAGE, messages

__all__ = ["PACKAGE", "messages"]

MAX_DOMAIN = 232
"""The last domain of DDS: beyond, its port numbers end."""
