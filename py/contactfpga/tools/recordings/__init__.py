"""Recordings: MCAP files with every byte of each board, and with messages of ROS 2 (docs/recordings.md)."""

from contactfpga.tools.recordings.recorder import Session
from contactfpga.tools.recordings.recording import Recording

__all__ = ["Recording", "Session"]
