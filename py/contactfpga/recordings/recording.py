"""Reads a recording: what each link said, and when."""

from __future__ import annotations

import functools
import heapq
import math
import tomllib
from collections.abc import Iterator
from pathlib import Path

from contactfpga.driver.conversation import Arrival, Conversation
from contactfpga.driver.mcap_bytes import McapBytes, RecordingError
from contactfpga.inputs.values import is_finite
from contactfpga.skin import Skin
from contactfpga.wire.hello import Hello
from contactfpga.zones.run import Run
from contactfpga.zones.zone import Zones

Timed = tuple[float, str, Zones]
"""Seconds since the recording's beginning, the link, and its frame."""


class Recording:
    """A file of `contactfpga record` that was closed or recovered.

    Every call reads the file, of which it keeps nothing in memory. Frames are made of the board's own bytes, as by the
    driver. Raises :class:`ContactFPGAError` where the file cannot be read.
    """

    def __init__(self, path: str | Path):
        self.path = Path(path)
        self._file = McapBytes(path)

    @property
    def start_s(self) -> float:
        """When it begins, in seconds since 1970."""
        return self._file.start_ns / 1e9

    @property
    def duration_s(self) -> float:
        """From its first byte to its last one."""
        return (self._file.end_ns - self._file.start_ns) / 1e9

    @functools.cached_property
    def links(self) -> dict[str, Hello]:
        """The first hello of each link, whose ``sheet`` has lines and lengths."""
        return {link: self._hello(link) for link in self._file.links}

    @functools.cached_property
    def skins(self) -> dict[str, Skin | None]:
        """The Skin of each link; None where only its hello is known."""
        texts = {facts.get("link"): facts.get("skin", "") for facts in self._file.metadata()}
        return {link: _skin(texts.get(link, "")) for link in self._file.links}

    def frames(self, start_s: float = 0.0, end_s: float | None = None, link: str | None = None) -> Iterator[Timed]:
        """(seconds since the beginning, link, :class:`Zones`) from ``start_s`` on and before ``end_s``, in order; with
        ``link`` of this one alone."""
        for name, value in (("start_s", start_s), ("end_s", 0.0 if end_s is None else end_s)):
            if not is_finite(value) or value < 0:
                raise ValueError(f"{name} is {value!r}; it must be a number of seconds, 0 or more")
        links = self._file.links if link is None else [link]
        every = [self._frames(one, float(start_s), math.inf if end_s is None else end_s) for one in links]
        return heapq.merge(*every, key=lambda timed: timed[0])

    def raw_bytes(self, link: str | None = None) -> Iterator[tuple[float, bytes]]:
        """(seconds since the beginning, bytes that had come by then) of a link: all that came over its port."""
        return ((self._seconds(moment_ns), data) for moment_ns, data in self._file.pieces(link))

    def _seconds(self, moment_ns: int) -> float:
        return (moment_ns - self._file.start_ns) / 1e9

    def _frames(self, link: str, start_s: float, end_s: float) -> Iterator[Timed]:
        conversation = Conversation(f"{self.path}, link {link!r}", live=False)
        start_ns = self._file.start_ns + round(start_s * 1e9) if start_s else None
        last_s = -math.inf
        for moment_ns, data in self._file.pieces(link, start_ns):
            moment_s = self._seconds(moment_ns)
            found = [zones for event in conversation.receive_runs(data, 0.0) for zones in _frames_of(event)]
            # The last one had come by then, and the board's clock says how long before it the others were scanned.
            for zones in found:
                before_s = max(0.0, (found[-1].time_us - zones.time_us) / 1e6)
                last_s = max(last_s, moment_s - before_s, 0.0)
                if last_s >= end_s:
                    return
                if last_s >= start_s:
                    yield last_s, link, zones

    def _hello(self, link: str) -> Hello:
        conversation = Conversation(str(self.path), live=False)
        for _, data in self._file.pieces(link):
            conversation.receive(data, 0.0)
            if conversation.hello is not None:
                return conversation.hello
        raise RecordingError(f"{self.path}: link {link!r} holds no hello; its frames cannot be read")


def _skin(text: str) -> Skin | None:
    try:
        return Skin(**tomllib.loads(text)) if text else None
    except (TypeError, ValueError):  # of a later version; the hello is known all the same
        return None


def _frames_of(event: object) -> Iterator[Zones]:
    if isinstance(event, Run):
        yield from event
    elif isinstance(event, Arrival):
        yield event.zones
