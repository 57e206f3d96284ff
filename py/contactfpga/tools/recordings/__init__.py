"""Recordings: MCAP files with every byte of each board, and with messages of ROS 2 (docs/recordings.md)."""

from contactfpga.tools.recordings.recording import Recording
from contactfpga.tools.recordings.session import Session

__all__ = ["Recording", "Session"]
