"""Writes boards' data into one or successive MCAP files."""

from __future__ import annotations

import dataclasses
import itertools
import json
import re
import threading
import time
from collections.abc import Mapping, Set
from pathlib import Path

from contactfpga.driver.board import Board
from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.values import shown
from contactfpga.robot.ros.cdr import encode
from contactfpga.robot.ros.convert import header
from contactfpga.robot.ros.feed import offset_ns
from contactfpga.robot.ros.types import PACKAGE
from contactfpga.tools.recordings.mcap import MAX_LINKS, MAX_NAME, METADATA, numbered
from contactfpga.tools.recordings.mcap_file import McapFile
from contactfpga.wire.hello import Cutter, Hello

PATIENCE_S = 2.0
"""Wait of a new file for hellos at its beginning; boards send two per second."""
BYTES = f"{PACKAGE}/Bytes"
"""Type of the messages with a board's bytes."""


@dataclasses.dataclass(frozen=True)
class Split:
    """Limits after which a new file begins: the first to be reached, or never."""

    bytes: float | None = None
    seconds: float | None = None

    def due(self, file: McapFile) -> bool:
        """Whether this file has reached a limit."""
        full = self.bytes is not None and file.size >= self.bytes
        return file.messages > 0 and (full or (self.seconds is not None and file.seconds >= self.seconds))


class Recorder:
    """The files, and the recorded links. Thread-safe."""

    def __init__(self, path: str | Path, split: Split | None = None):
        self.path = Path(path)
        self.lock = threading.RLock()
        self._split = split
        self._links: list[LinkFile] = []
        self._about: list[tuple[str, Mapping[str, str]]] = []
        self._old: McapFile | None = None
        self._sizes: dict[Path, int] = {}  # of the files that are closed
        self.files: list[Path] = []
        """Files in order."""
        self.file = self._begin()

    @property
    def size(self) -> int:
        """Bytes in all files."""
        with self.lock:
            files = [file for file in (self._old, self.file) if file is not None and file.path in self.files]
            return sum(self._sizes.values()) + sum(file.size for file in files if file.path not in self._sizes)

    def add(self, name: str, board: Board) -> LinkFile:
        """Add a link by name; its board is open."""
        with self.lock:
            if name in {link.name for link in self._links}:
                raise ContactFPGAError(f"two links are named {name!r}; give their Skins different names")
            if len(self._links) == MAX_LINKS or len(name) > MAX_NAME:
                limits = f"a recording has at most {MAX_LINKS} links, with names of {MAX_NAME} characters"
                raise ContactFPGAError(f"link {shown(name)} cannot be added: {limits}")
            topic = topic_of(name, {link.topic for link in self._links})
            link = LinkFile(self, name, topic, facts(name, board), _epoch_ns(board))
            self._links.append(link)
            self.about(METADATA, link.facts)
            return link

    def about(self, name: str, values: Mapping[str, str]) -> None:
        """Store texts in every file."""
        self._about.append((name, values))
        self.file.metadata(name, values)

    def poll(self) -> None:
        """Write old buffers, and begin a new file if due. Call it often."""
        now_s = time.monotonic()
        with self.lock:
            for file in (self._old, self.file):
                if file is not None:
                    file.flush_old(now_s)
            if self._old is not None:
                self._end_old(now_s)
            elif self._split is not None and self._split.due(self.file):
                self._old, self.file = self.file, self._begin()
                for name, values in self._about:
                    self.file.metadata(name, values)
                for link in self._links:
                    link.wait_for_hello()

    def close(self) -> None:
        """Close the files; may be called twice."""
        with self.lock:
            for link in self._links:
                link.switch()
            for file in (self._old, self.file):
                if file is not None:
                    self._close(file)
            self._old = None

    def _end_old(self, now_s: float) -> None:
        assert self._old is not None
        if now_s - self._begun_s > PATIENCE_S:
            for link in self._links:
                link.switch()
        if all(link.file is self.file for link in self._links):
            self._close(self._old)
            self._old = None

    def _close(self, file: McapFile) -> None:
        file.close()
        self._sizes[file.path] = file.size
        if not file.messages and len(self.files) > 1:  # begun at the very end
            file.path.unlink(missing_ok=True)
            self.files.remove(file.path)
            del self._sizes[file.path]

    def _begin(self) -> McapFile:
        self._begun_s = time.monotonic()
        path = self.path
        if self._split is not None:
            path = numbered(path, len(self.files) + 1)
        file = McapFile(path)
        self.files.append(path)
        return file


class LinkFile:
    """One link's output into its current file."""

    def __init__(self, recorder: Recorder, name: str, topic: str, facts: dict[str, str], epoch_ns: int):
        self.name = name
        self.topic = topic
        self.facts = facts
        self.file = recorder.file
        self._recorder = recorder
        self._epoch_ns = epoch_ns
        self._cutter: Cutter | None = None

    def time_ns(self, clock_s: float) -> int:
        """Time in ns since 1970, of a moment on the board's :meth:`~contactfpga.Board.clock`."""
        return self._epoch_ns + round(clock_s * 1e9)

    def take_bytes(self, data: bytes, clock_s: float) -> None:
        """Add bytes that arrived by then."""
        with self._recorder.lock:
            before, after = (data, b"") if self._cutter is None else self._cutter.take(data)
            self._bytes(before, clock_s)
            if after:
                self.switch()
                self._bytes(after, clock_s)
            self._recorder.poll()

    def write(self, what: str, kind: str, data: bytes, clock_s: float) -> None:
        """Add a message; ``what`` ends its topic, or with a leading slash is all of it."""
        topic = what if what.startswith("/") else f"{self.topic}/{what}"
        link = None if what.startswith("/") else self.name
        with self._recorder.lock:
            self.file.write(topic, kind, link, self.time_ns(clock_s), data, time.monotonic())

    def poll(self) -> None:
        """Write buffers while nothing arrives."""
        self._recorder.poll()

    def wait_for_hello(self) -> None:
        """Continue in the recorder's newest file with the next hello."""
        self._cutter = Cutter()

    def switch(self) -> None:
        """Continue in the newest file now."""
        cutter, self._cutter = self._cutter, None
        if cutter is not None and cutter.held:
            self._bytes(cutter.held, self._last_s)
        self.file = self._recorder.file

    def _bytes(self, data: bytes, clock_s: float) -> None:
        self._last_s = clock_s
        if data:
            time_ns = self.time_ns(clock_s)
            self.write("bytes", BYTES, of_bytes(data, time_ns, self.name), clock_s)


def topic_of(link: str, taken: Set[str] = frozenset()) -> str:
    """Topic of a link's messages, with underscores for characters that ROS does not allow, and with a number at its end
    if the topic is ``taken`` by another link.
    """
    name = re.sub(r"\W", "_", link, flags=re.ASCII)
    topic = f"/{name}" if name and not name[0].isdigit() else f"/_{name}"
    numbered = (f"{topic}_{number}" for number in itertools.count(2))
    return next(one for one in itertools.chain([topic], numbered) if one not in taken)


def facts(name: str, board: Board) -> dict[str, str]:
    """Metadata for readers before the first byte."""
    hello = board.hello
    try:
        skin = board.skin.to_toml()
    except ContactFPGAError:
        skin = ""
    return {
        "link": name,
        "port": board.port,
        "fingerprint": hello.fingerprint.hex(),
        "sheet": json.dumps(dataclasses.asdict(hello.sheet)),
        "skin": skin,
    }


def link_name(hello: Hello) -> str:
    """Default name of a board."""
    return hello.name or "skin"


def _epoch_ns(board: Board) -> int:
    return offset_ns(time.time_ns, board.clock)


def of_bytes(data: bytes, time_ns: int, frame: str) -> bytes:
    """A message of bytes of which the last arrived then."""
    return encode(BYTES, {"header": header(time_ns, frame), "data": data})
