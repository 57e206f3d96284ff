"""Recordings of one board, playable from any moment."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from contactfpga.driver.address import REPLAY, Replay
from contactfpga.errors import ContactFPGAError
from contactfpga.zones.zone import Zones

if TYPE_CHECKING:
    from contactfpga.tools.recordings.recording import Recording

Reading = Callable[[int, int], object]
"""Receives the number of bytes read of a file, and its size."""


def silent(done: int, of: int) -> None:
    """Ignore the progress."""


def is_recording(name: str) -> bool:
    """Whether a name is a recording, not a port: ``replay://FILE``, or a file."""
    return name.startswith(REPLAY) or name.endswith(".mcap") or Path(name).is_file()


class BoardRecording:
    """A board of a recording; ``link``: None for the first."""

    def __init__(self, recording: Recording, link: str | None = None):
        self.recording = recording
        self.named = link is not None
        """Whether this link was requested, or is the first."""
        self.link = next(iter(recording.links)) if link is None else recording.checked(link)
        self.title = f"{recording.path.name}, {self.link}" if recording.timed else recording.path.name
        self.sheet = recording.links[self.link].sheet
        self.timed, self.duration_s = recording.timed, recording.duration_s

    def frames(self, start_s: float = 0.0, end_s: float | None = None) -> Iterator[tuple[float, Zones]]:
        """Seconds from the beginning and frame, in order, from ``start_s`` up to ``end_s``."""
        return ((seconds, zones) for seconds, _, zones in self.recording.frames(start_s, end_s, self.link))


def load(name: str, link: str | None = None, reading: Reading = silent) -> BoardRecording:
    """A recording by its path, or by ``replay://FILE``; ``link``: one of several in the file. ``reading``: receives the
    progress for a file without index.

    Raises :class:`~contactfpga.ContactFPGAError`, and :class:`~contactfpga.MissingExtra` for an MCAP file without
    ``[record]``.
    """
    from contactfpga.tools.recordings.recording import Recording

    asked = Replay.parse(name if name.startswith(REPLAY) else f"{REPLAY}{name}")
    link = link or asked.link
    recording = Recording(asked.path, reading)
    if link is not None and not recording.timed:
        raise ContactFPGAError(f"{asked.path} holds one board; --link is for files of `contactfpga record`")
    return BoardRecording(recording, link)
