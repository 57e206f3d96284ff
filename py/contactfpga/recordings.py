"""The public names of :mod:`contactfpga.tools.recordings`."""

from contactfpga.tools.recordings.recorder import Session
from contactfpga.tools.recordings.recording import Recording

__all__ = ["Recording", "Session"]
