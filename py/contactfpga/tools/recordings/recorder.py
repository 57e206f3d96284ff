"""Records boards into one or successive MCAP files, with one thread per board."""

from __future__ import annotations

import dataclasses
import os
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType

from contactfpga.driver import driver, forks
from contactfpga.driver.address import MAX_LINKS, MAX_NAME
from contactfpga.driver.board import Board
from contactfpga.driver.transport import SimulatedPort
from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.values import is_finite, shown
from contactfpga.robot.ros.feed import Felt
from contactfpga.skin import Skin
from contactfpga.tools.recordings.link_recorder import LinkRecorder, topic_of
from contactfpga.tools.recordings.mcap import METADATA, SUFFIX, numbered
from contactfpga.tools.recordings.mcap_file import McapFile, RecordingFailed
from contactfpga.tools.recordings.messages import Mount
from contactfpga.tools.recordings.recording import UNNAMED

PATIENCE_S = 2.0
"""Wait of a new file for hellos at its beginning; boards send two per second."""


@dataclasses.dataclass(frozen=True)
class Split:
    """Limits after which a new file begins: the first to be reached, or never."""

    bytes: float | None = None
    seconds: float | None = None

    def due(self, file: McapFile) -> bool:
        """Whether this file has reached a limit."""
        full = self.bytes is not None and file.size >= self.bytes
        return file.messages > 0 and (full or (self.seconds is not None and file.seconds >= self.seconds))


class Session:
    """Records boards into ``path``: :meth:`add` each of them, then :meth:`start`; a context manager that ends it.

    ``split``: limits of a file; then ``touches.mcap`` becomes ``touches_0001.mcap`` and so on. ``bytes_only`` omits
    messages, which can be made from the bytes: about a fifth of the size. ``about``: texts to store by name. Raises
    :class:`ContactFPGAError`, also if the file exists.
    """

    file: McapFile

    def __init__(
        self,
        path: str | Path,
        split: Split | None = None,
        bytes_only: bool = False,
        *,
        about: Mapping[str, Mapping[str, str]] | None = None,
    ):
        check_new(path)
        self.links: list[LinkRecorder] = []
        self.lock = threading.RLock()
        self._path, self._split, self._bytes_only = Path(path), split, bytes_only
        self._about = list((about or {}).items())
        self._paths: list[Path] = []
        self._open: list[McapFile] = []  # the newest last; before it one of which some links still wait for a hello
        self._sizes: dict[Path, int] = {}  # of the files that are closed
        self._stop, self._ended = threading.Event(), threading.Event()
        self._begun: threading.Event | None = None
        self._failure: BaseException | None = None
        self._threads: list[threading.Thread] = []
        forks.watch(self)

    def add(
        self,
        port: str | SimulatedPort | None = None,
        skin: Skin | str | Path | None = None,
        *,
        name: str | None = None,
        baud: int | None = None,
        timeout: float = 1.0,
        mount: Mount | None = None,
        felt: Callable[[Board], Felt | None] | None = None,
    ) -> None:
        """Open a board, as :func:`contactfpga.open` does.

        ``name``: of its link, by default its Skin's. ``mount``: place of its sheet on a robot. ``felt``: from the open
        board to a function for the forces at a frame's zones.
        """
        if self._begun is not None:
            raise ContactFPGAError("this recording has begun; add all boards before start()")
        link = LinkRecorder(self, mount)
        board = driver.open(port, skin, baud=baud, record=link, timeout=timeout)
        try:
            link.name = board.hello.name or UNNAMED if name is None else name
            if link.name in {one.name for one in self.links}:
                raise ContactFPGAError(f"two links are named {link.name!r}; give their Skins different names")
            if len(self.links) == MAX_LINKS or len(link.name) > MAX_NAME:
                limits = f"a recording has at most {MAX_LINKS} links, with names of {MAX_NAME} characters"
                raise ContactFPGAError(f"link {shown(link.name)} cannot be added: {limits}")
            link.topic = topic_of(link.name, [one.topic for one in self.links])
            link.felt = None if felt is None else felt(board)
        except BaseException:
            board.close()
            raise
        self.links.append(link)
        self._about.append((METADATA, link.facts))

    def start(self, seconds: float | None = None) -> None:
        """Create the file, and record for ``seconds``, or until :meth:`stop`. Raises ValueError, and
        :class:`ContactFPGAError` without a board or if started before.
        """
        if seconds is not None and (not is_finite(seconds) or seconds <= 0):
            raise ValueError(f"seconds is {shown(seconds)}; it must be a positive number, or None until stop()")
        if self._begun is not None:
            raise ContactFPGAError("this recording was started already; make another Session")
        if not self.links:
            raise ContactFPGAError("there is no board to record; add() one first")
        # In a thread of its own, as all that writes: where Ctrl-C interrupts the main thread nothing is left half made.
        # Events are waited for, as a `join` that is interrupted forgets that its thread still runs.
        self._begun = threading.Event()
        threading.Thread(target=self._begin, args=(seconds, self._begun), name="recorder").start()
        self._begun.wait()
        if self._failure is not None:
            raise self._failure

    def _begin(self, seconds: float | None, begun: threading.Event) -> None:
        try:
            self._next_file()
            for link in self.links:
                link.begin(messages=not self._bytes_only)
        except BaseException as error:
            self._failure = error
        else:
            for link in self.links:
                thread = threading.Thread(target=self._run, args=(link, seconds), name="recorder", daemon=True)
                self._threads.append(thread)
            self._left = len(self._threads)  # links that are being recorded
            for thread in self._threads:
                thread.start()
        finally:
            begun.set()

    def _run(self, link: LinkRecorder, seconds: float | None) -> None:
        try:
            link.run(self._stop, seconds)
        finally:
            if isinstance(link.error, RecordingFailed):  # the others have no place to write to either
                self._stop.set()
            with self.lock:
                self._left -= 1
                if not self._left:
                    self._ended.set()

    def poll(self) -> None:
        """Write old buffers, and begin a new file if due; links call it often."""
        now_s = time.monotonic()
        with self.lock:
            for file in self._open:
                file.flush_old(now_s)
            if len(self._open) > 1:
                for link in self.links if now_s - self._begun_s > PATIENCE_S else ():
                    link.switch()
                if all(link.file is self.file for link in self.links):
                    self._close_file()
            elif self._split is not None and self._split.due(self.file):
                self._next_file()
                for link in self.links:
                    link.wait_for_hello()

    def _next_file(self) -> None:
        self._begun_s = time.monotonic()
        path = self._path if self._split is None else numbered(self._path, len(self._paths) + 1)
        self.file = McapFile(path)
        self._paths.append(path)
        self._open.append(self.file)
        for name, values in self._about:
            self.file.metadata(name, values)

    def _close_file(self) -> None:
        file = self._open.pop(0)
        try:
            file.close()
        finally:
            self._sizes[file.path] = file.size
        if not file.messages and len(self._paths) > 1:  # begun at the very end
            file.path.unlink(missing_ok=True)
            self._paths.remove(file.path)
            del self._sizes[file.path]

    @property
    def running(self) -> bool:
        """Whether a board is still being recorded."""
        return not self._ended.is_set()

    def wait(self, seconds: float) -> None:
        """Wait until all has ended, at most this long."""
        self._ended.wait(seconds)

    def stop(self) -> None:
        """End all, and close the file; may be called twice. Raises the error that ended a link early."""
        self._stop.set()
        if self._begun is not None:
            self._begun.wait()
        for thread in self._threads:
            thread.join()
        try:
            for link in self.links if self._threads else ():
                link.finish()
        finally:
            for link in self.links:
                link.board.close()
            with self.lock:
                for link in self.links if self._open else ():
                    link.switch()
                while self._open:
                    self._close_file()
        for link in self.links:
            if link.error is not None:
                raise link.error

    def forked(self) -> None:
        self._stop, self._ended, self._begun = threading.Event(), threading.Event(), None
        self._ended.set()
        self.links, self._threads, self._open, self.lock = [], [], [], threading.RLock()

    @property
    def files(self) -> list[Path]:
        """Its files in order; empty before it has begun."""
        return self._paths if self._threads else []

    @property
    def seconds(self) -> float:
        """Recorded time."""
        return max((link.seconds for link in self.links), default=0.0)

    @property
    def frames(self) -> int:
        """Frames read."""
        return sum(link.frames for link in self.links)

    @property
    def size(self) -> int:
        """Bytes in its files."""
        with self.lock:
            return sum(self._sizes.values()) + sum(file.size for file in self._open)

    def __enter__(self) -> Session:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self.stop()


def check_new(path: str | Path) -> None:
    """Raises :class:`ContactFPGAError` for an invalid name of a new recording."""
    if Path(path).suffix != SUFFIX:
        raise ContactFPGAError(f"{path} does not end in {SUFFIX}, by which programs know such files; name it so")
    if os.path.lexists(path):
        raise ContactFPGAError(f"{path} is there already; name a new file, or remove it first")
    if not Path(path).parent.is_dir():
        raise ContactFPGAError(f"{path} cannot be written: there is no folder {Path(path).parent}")
