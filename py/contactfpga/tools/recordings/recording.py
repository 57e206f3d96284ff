"""Reads a recording of one or many links: their bytes, frames and texts, with times."""

from __future__ import annotations

import functools
import heapq
import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from contactfpga import notebook
from contactfpga.choices.choice import refuse_modules
from contactfpga.driver.conversation import Conversation
from contactfpga.driver.pace import DeviceClock
from contactfpga.errors import SkinError, VersionMismatch
from contactfpga.inputs import tomlfile
from contactfpga.inputs.files import open_regular, reason_of
from contactfpga.inputs.values import is_finite
from contactfpga.skin import Skin
from contactfpga.skin.derived import LONGEST_PACKET
from contactfpga.tools.recordings.mcap import MAGIC, METADATA, McapPart, RecordingError, files_of
from contactfpga.wire.hello import Hello, find_hello
from contactfpga.zones.run import Run
from contactfpga.zones.zone import Zones

Timed = tuple[float, str, Zones]
"""Seconds since the recording's beginning, the link, and its frame."""

LAST_S = 0.2
"""Time before the end of a recording within which each board has sent a frame, at least a keep-alive."""
HELLO_NS = 600_000_000
"""Time within which a board sends a hello."""
CHUNK = 4096
UNNAMED = "skin"
"""Link of a board without a name."""


class Recording:
    """The output of `contactfpga record`, closed or recovered (split files by the name recorded to), or a file of
    ``open(port, record=FILE)``, which holds the bytes of one board and no arrival times.

    Every call reads the file again. Frames are made from the board's own bytes, as by the driver. ``reading`` receives
    the number of bytes read and the size of a file of bytes while its duration is measured. Raises
    :class:`ContactFPGAError` for an unreadable file.
    """

    def __init__(self, path: str | Path, reading: Callable[[int, int], object] = lambda done, of: None):
        self.path = Path(path)
        self.unused: Counter[str] = Counter()
        """Bytes of each link of which :meth:`frames`, when last called, made nothing: damaged ones, and those before
        any hello."""
        self._reading = reading
        try:
            files = files_of(self.path)
            with open_regular(files[0]) as file:
                self.timed = file.read(len(MAGIC)) == MAGIC
                """Whether arrival times are known; without them, times are the board's own since its first frame."""
        except (OSError, ValueError) as error:
            why = error.strerror or reason_of(error) if isinstance(error, OSError) else error
            raise RecordingError(f"{path} cannot be opened: {why}; is the path right?") from None
        parts = [McapPart(one) for one in files] if self.timed else []
        held = {link for part in parts for link in part.links}
        self._parts = parts
        if not self.timed:
            return
        added = [facts.get("link", "") for facts in self.texts(METADATA)]
        self._names = sorted(held, key=lambda link: (added.index(link) if link in added else len(added), link))
        if not held:
            raise RecordingError(f"{path} holds no bytes of a board; `contactfpga record` makes files that do")
        self._start_ns = min(part.start_ns for part in parts if part.links)
        self._end_ns = max(part.end_ns for part in parts if part.links)

    @property
    def start_s(self) -> float | None:
        """Beginning, in seconds since 1970; None without arrival times."""
        return self._start_ns / 1e9 if self.timed else None

    @functools.cached_property
    def duration_s(self) -> float:
        """Seconds from the first byte to the last one; without arrival times, from the first frame to the last."""
        if self.timed:
            return (self._end_ns - self._start_ns) / 1e9
        conversation, clock, last_s = Conversation(str(self.path), live=False), DeviceClock(), 0.0
        size = self.path.stat().st_size
        for _, data in self.pieces():
            for run in conversation.receive(data, 0.0):
                if isinstance(run, Run):
                    last_s = [clock.take(time_us) for time_us in run.times_us.tolist()][-1]
            self._reading(conversation.stats.bytes, size)
        return last_s

    @functools.cached_property
    def links(self) -> dict[str, Hello]:
        """The first hello of each link, whose ``sheet`` has lines and lengths, in order of addition. Links without a
        hello are omitted, as their frames are unreadable. Raises :class:`ContactFPGAError` if none is left.
        """
        hellos = {link: self._hello(link) for link in (self._names if self.timed else [UNNAMED])}
        found = {link: hello for link, hello in hellos.items() if isinstance(hello, Hello)}
        if not found:
            old = (one for one in hellos.values() if isinstance(one, VersionMismatch))
            raise next(old, RecordingError(f"{self.path} holds no hello; its frames cannot be read"))
        return found if self.timed else {hello.name or UNNAMED: hello for hello in found.values()}

    @functools.cached_property
    def skins(self) -> dict[str, Skin | None]:
        """The Skin of each link; None if only its hello is known."""
        texts = {(facts.get("link"), facts.get("fingerprint")): facts.get("skin", "") for facts in self.texts(METADATA)}
        return {link: _skin(texts.get((link, one.fingerprint.hex()), "")) for link, one in self.links.items()}

    def texts(self, name: str) -> list[dict[str, str]]:
        """Texts stored by name; ``robot``: the `robot.toml` of its links, with the files it names."""
        found: list[dict[str, str]] = []
        for part in self._parts:
            found += [one for one in part.texts(name) if one not in found]
        return found

    def frames(self, start_s: float = 0.0, end_s: float | None = None, link: str | None = None) -> Iterator[Timed]:
        """(seconds since the beginning, link, :class:`Zones`) from ``start_s`` up to ``end_s``, in order; ``link``:
        only of this one.
        """
        for name, value in (("start_s", start_s), ("end_s", 0.0 if end_s is None else end_s)):
            if not is_finite(value) or value < 0:
                raise ValueError(f"{name} is {value!r}; it must be a number of seconds, 0 or more")
        links = list(self.links) if link is None else [self.checked(link)]
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
        """(seconds since the beginning, bytes arrived by then) of a link; NaN without arrival times."""
        return self.pieces(self.checked(link))

    def checked(self, link: str | None) -> str:
        """The link of this name; None: the only one. Raises :class:`RecordingError`."""
        if link is None and not self.timed:
            return UNNAMED
        names = self._names if self.timed else list(self.links)
        if link in names:
            return link
        if link is not None:
            raise RecordingError(f"{self.path} has no link {link!r}; it has {', '.join(names)}")
        if len(names) > 1:
            raise RecordingError(f"{self.path} holds several links; name one of them: {', '.join(names)}")
        return names[0]

    def pieces(self, link: str = UNNAMED, start_s: float = 0.0) -> Iterator[tuple[float, bytes]]:
        """:meth:`raw_bytes`, from the last hello that arrived by ``start_s`` if arrival times are known."""
        if not self.timed:
            with open_regular(self.path) as file:
                while data := file.read(CHUNK):
                    yield math.nan, data
            return
        begin_ns, at = None, 0
        if start_s:
            start_ns = self._start_ns + round(start_s * 1e9)
            for begin_ns in (start_ns - HELLO_NS, start_ns - 8 * HELLO_NS, None):
                if (at := _last_hello(data for _, data in self._read(link, begin_ns, start_ns + 1))) >= 0:
                    break
        for moment_ns, data in self._read(link, begin_ns):
            if at < max(1, len(data)):
                yield (moment_ns - self._start_ns) / 1e9, data[max(0, at) :]
            at = max(0, at - len(data))

    def _read(self, link: str, begin_ns: int | None, end_ns: int | None = None) -> Iterator[tuple[int, bytes]]:
        for part in self._parts:
            yield from part.read(link, begin_ns, end_ns)

    def _frames(self, link: str, start_s: float, end_s: float) -> Iterator[Timed]:
        conversation = Conversation(f"{self.path}, link {link!r}", live=False)
        clock, last_s = DeviceClock(), 0.0
        for moment_s, data in self.pieces(link, start_s):
            runs = [event for event in conversation.receive(data, 0.0) if isinstance(event, Run)]
            self.unused[link] = conversation.unused
            # The last one had come by then, and the board's clock says how long before it the others were scanned.
            last_us = int(runs[-1].times_us[-1]) if runs else 0
            for run in runs:
                for index, time_us in enumerate(run.times_us.tolist()):
                    before_s = max(0.0, (last_us - time_us) / 1e6)
                    last_s = max(last_s, moment_s - before_s) if self.timed else clock.take(time_us)
                    if last_s >= end_s:
                        return
                    if last_s >= start_s:
                        yield last_s, link, run[index]

    def _hello(self, link: str) -> Hello | VersionMismatch | None:
        conversation, old = Conversation(str(self.path), live=False), None
        for _, data in self.pieces(link):
            events = conversation.receive(data, 0.0)
            old = next((event for event in events if isinstance(event, VersionMismatch)), old)
            if conversation.hello is not None:
                return conversation.hello
        self.unused[link] = conversation.stats.bytes
        return old


def _skin(text: str) -> Skin | None:
    try:
        values = tomlfile.parse(text.encode(), "the Skin of a recording", SkinError)
        refuse_modules(values, "a recording")
        return Skin(**values) if text else None
    except (TypeError, ValueError):  # of another version, or with a module; the hello is known all the same
        return None


def _last_hello(pieces: Iterable[bytes]) -> int:
    """Start of the last whole hello; -1: none."""
    found, before, held = -1, 0, b""
    for data in pieces:
        data = held + data
        if (at := find_hello(data, last=True)) >= 0:
            found = before + at
        held = data[data.rfind(0) + 1 :][-LONGEST_PACKET:]
        before += len(data) - len(held)
    return found
