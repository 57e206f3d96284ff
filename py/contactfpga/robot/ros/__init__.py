"""ROS 2: a board's data as messages of ``contactfpga_msgs``, and publishing without ROS (docs/ros.md)."""

from __future__ import annotations

from contactfpga.robot.ros.types import PACKAGE, messages

__all__ = ["PACKAGE", "messages"]

MAX_DOMAIN = 232
"""The last DDS domain, by its port numbers."""
