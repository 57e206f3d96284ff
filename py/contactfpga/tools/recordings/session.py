"""A recording in progress, with one thread per board."""

from __future__ import annotations

import dataclasses
import os
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType

from contactfpga.driver import driver, forks
from contactfpga.driver.board import Board
from contactfpga.driver.subscription import Events
from contactfpga.driver.transport import SimulatedPort
from contactfpga.errors import ContactFPGAError
from contactfpga.inputs.values import is_finite, shown
from contactfpga.robot.ros.feed import Felt
from contactfpga.skin import Skin
from contactfpga.tools.recordings.link_recorder import Buffer, LinkMessages, LinkRecorder, Mount
from contactfpga.tools.recordings.mcap import SUFFIX
from contactfpga.tools.recordings.mcap_file import RecordingFailed
from contactfpga.tools.recordings.recorder import Recorder, Split, link_name


@dataclasses.dataclass(frozen=True)
class _OpenLink:
    name: str
    board: Board
    events: Events
    buffer: Buffer
    mount: Mount | None
    felt: Felt | None


class Session:
    """Records boards into ``path``: :meth:`add` each of them, then :meth:`start`; a context manager that ends it.

    ``split``: limits of a file; then ``touches.mcap`` becomes ``touches_0001.mcap`` and so on. ``bytes_only`` omits
    messages, which can be made from the bytes: about a fifth of the size. ``about``: texts to store by name. Raises
    :class:`ContactFPGAError`, also if the file exists.
    """

    def __init__(
        self,
        path: str | Path,
        split: Split | None = None,
        bytes_only: bool = False,
        *,
        about: Mapping[str, Mapping[str, str]] | None = None,
        buffer: Callable[[], Buffer] = Buffer,
    ):
        check_new(path)
        self.links: list[LinkRecorder] = []
        self._path = Path(path)
        self._split = split
        self._opened: list[_OpenLink] = []
        self._about = dict(about or {})
        self._recorder: Recorder | None = None
        self._bytes_only = bytes_only
        self._buffer = buffer
        self._stop = threading.Event()
        self._ended = threading.Event()
        self._lock = threading.Lock()
        self._left = 0  # links that are being recorded
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
        buffer = self._buffer()
        board = driver.open(port, skin, baud=baud, record=buffer, timeout=timeout)
        try:
            force = None if felt is None else felt(board)
        except BaseException:
            board.close()
            raise
        self._opened.append(
            _OpenLink(link_name(board.hello) if name is None else name, board, buffer.events, buffer, mount, force)
        )

    def start(self, seconds: float | None = None) -> None:
        """Create the file, and record for ``seconds``, or until :meth:`stop`. Raises ValueError, and
        :class:`ContactFPGAError` without a board or if started before.
        """
        if seconds is not None and (not is_finite(seconds) or seconds <= 0):
            raise ValueError(f"seconds is {shown(seconds)}; it must be a positive number, or None until stop()")
        if self._begun is not None:
            raise ContactFPGAError("this recording was started already; make another Session")
        if not self._opened:
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
            self._recorder = Recorder(self._path, self._split)
            for name, values in self._about.items():
                self._recorder.about(name, values)
            for one in self._opened:
                file = self._recorder.add(one.name, one.board)
                said = None if self._bytes_only else LinkMessages(one.board, file, one.mount, one.felt)
                self.links.append(LinkRecorder(one.board, one.events, one.buffer, file, said, one.felt is not None))
        except BaseException as error:
            self._failure = error
        else:
            self._left = len(self.links)
            for link in self.links:
                thread = threading.Thread(target=self._run, args=(link, seconds), name="recorder", daemon=True)
                thread.start()
                self._threads.append(thread)
        finally:
            begun.set()

    def _run(self, link: LinkRecorder, seconds: float | None) -> None:
        try:
            link.run(self._stop, seconds)
        finally:
            if isinstance(link.error, RecordingFailed):  # the others have no place to write to either
                self._stop.set()
            with self._lock:
                self._left -= 1
                if not self._left:
                    self._ended.set()

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
            for link in self.links:
                link.finish()
        finally:
            for one in self._opened:
                one.board.close()
            if self._recorder is not None:
                self._recorder.close()
        for link in self.links:
            if link.error is not None:
                raise link.error

    def forked(self) -> None:
        self._stop, self._ended, self._begun = threading.Event(), threading.Event(), None
        self._ended.set()
        self._opened, self.links, self._threads, self._recorder = [], [], [], None

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
        return 0 if self._recorder is None else self._recorder.size

    @property
    def files(self) -> list[Path]:
        """Its files in order."""
        return [] if self._recorder is None else self._recorder.files

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
