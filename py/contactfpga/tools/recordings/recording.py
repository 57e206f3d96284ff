"""Reads a recording: each link's data with times."""

from __future__ import annotations

import functools
import heapq
import math
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from contactfpga import notebook
from contactfpga.choices.choice import refuse_modules
from contactfpga.driver.conversation import Conversation, frames_in
from contactfpga.driver.mcap import METADATA, McapBytes, RecordingError
from contactfpga.errors import SkinError
from contactfpga.inputs import tomlfile
from contactfpga.inputs.values import is_finite
from contactfpga.skin import Skin
from contactfpga.wire.hello import Hello
from contactfpga.zones.zone import Zones

Timed = tuple[float, str, Zones]
"""Seconds since the recording's beginning, the link, and its frame."""

LAST_S = 0.2
"""Time before the end of a recording within which each board has sent a frame, at least a keep-alive."""


class Recording:
    """The output of `contactfpga record`, closed or recovered; split files by the name recorded to.

    Every call reads the file again. Frames are made from the board's own bytes, as by the driver. Raises
    :class:`ContactFPGAError` for an unreadable file.
    """

    def __init__(self, path: str | Path):
        self.path = Path(path)
        self._file = McapBytes(path)
        self.unused: Counter[str] = Counter()
        """Bytes of each link of which :meth:`frames`, when last called, made nothing: damaged ones, and those before
        any hello."""

    @property
    def start_s(self) -> float:
        """Beginning, in seconds since 1970."""
        return self._file.start_ns / 1e9

    @property
    def duration_s(self) -> float:
        """Seconds from the first byte to the last one."""
        return (self._file.end_ns - self._file.start_ns) / 1e9

    @functools.cached_property
    def links(self) -> dict[str, Hello]:
        """The first hello of each link, whose ``sheet`` has lines and lengths, in order of addition. Links without a
        hello are omitted, as their frames are unreadable. Raises :class:`ContactFPGAError` if none is left.
        """
        found = {link: hello for link in self._file.links if (hello := self._hello(link)) is not None}
        if not found:
            raise RecordingError(f"{self.path} holds no hello; its frames cannot be read")
        return found

    @functools.cached_property
    def skins(self) -> dict[str, Skin | None]:
        """The Skin of each link; None if only its hello is known."""
        texts = {(facts.get("link"), facts.get("fingerprint")): facts.get("skin", "") for facts in self.texts(METADATA)}
        return {link: _skin(texts.get((link, one.fingerprint.hex()), "")) for link, one in self.links.items()}

    def texts(self, name: str) -> list[dict[str, str]]:
        """Texts stored by name; ``robot``: the `robot.toml` of its links, with the files it names."""
        return self._file.texts(name)

    def frames(self, start_s: float = 0.0, end_s: float | None = None, link: str | None = None) -> Iterator[Timed]:
        """(seconds since the beginning, link, :class:`Zones`) from ``start_s`` up to ``end_s``, in order; ``link``:
        only of this one.
        """
        for name, value in (("start_s", start_s), ("end_s", 0.0 if end_s is None else end_s)):
            if not is_finite(value) or value < 0:
                raise ValueError(f"{name} is {value!r}; it must be a number of seconds, 0 or more")
        links = list(self.links) if link is None else [link]
        every = [self._frames(one, float(start_s), math.inf if end_s is None else end_s) for one in links]
        return heapq.merge(*every, key=lambda timed: timed[0])

    def __repr__(self) -> str:
        return f"<Recording {self.path}: {self.duration_s:.1f} s of {', '.join(self.links)}>"

    def _repr_html_(self) -> str:
        sheets = {link: hello.sheet for link, hello in self.links.items()}
        rows = [[link, f"{sheet.rows}x{sheet.columns}", sheet.report] for link, sheet in sheets.items()]
        table = notebook.table(["link", "cells", "report"], rows, f"{self.path.name}: {self.duration_s:.1f} s")
        last = {link: zones for _, link, zones in self.frames(max(0.0, self.duration_s - LAST_S))}
        return table + notebook.beside((link, zones.svg()) for link, zones in last.items())

    def raw_bytes(self, link: str | None = None) -> Iterator[tuple[float, bytes]]:
        """(seconds since the beginning, bytes arrived by then) of a link."""
        return ((self._seconds(moment_ns), data) for moment_ns, data in self._file.pieces(link))

    def _seconds(self, moment_ns: int) -> float:
        return (moment_ns - self._file.start_ns) / 1e9

    def _frames(self, link: str, start_s: float, end_s: float) -> Iterator[Timed]:
        conversation = Conversation(f"{self.path}, link {link!r}", live=False)
        start_ns = self._file.start_ns + round(start_s * 1e9) if start_s else None
        last_s = -math.inf
        for moment_ns, data in self._file.pieces(link, start_ns):
            moment_s = self._seconds(moment_ns)
            found = frames_in(conversation.receive(data, 0.0))
            self.unused[link] = conversation.unused
            # The last one had come by then, and the board's clock says how long before it the others were scanned.
            for zones in found:
                before_s = max(0.0, (found[-1].time_us - zones.time_us) / 1e6)
                last_s = max(last_s, moment_s - before_s, 0.0)
                if last_s >= end_s:
                    return
                if last_s >= start_s:
                    yield last_s, link, zones

    def _hello(self, link: str) -> Hello | None:
        conversation = Conversation(str(self.path), live=False)
        for _, data in self._file.pieces(link):
            conversation.receive(data, 0.0)
            if conversation.hello is not None:
                return conversation.hello
        self.unused[link] = conversation.stats.bytes
        return None


def _skin(text: str) -> Skin | None:
    try:
        values = tomlfile.parse(text.encode(), "the Skin of a recording", SkinError)
        refuse_modules(values, "a recording")
        return Skin(**values) if text else None
    except (TypeError, ValueError):  # of another version, or with a module; the hello is known all the same
        return None
