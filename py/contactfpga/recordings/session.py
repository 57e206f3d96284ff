"""A recording that is under way: one thread for each board."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from pathlib import Path
from types import TracebackType

from contactfpga.driver import driver
from contactfpga.driver.board import Board
from contactfpga.driver.transport import SimulatedPort
from contactfpga.errors import ContactFPGAError
from contactfpga.recordings.link_recorder import Buffer, LinkRecorder
from contactfpga.recordings.recorder import Recorder, Split, link_name
from contactfpga.skin import Skin

SUFFIX = ".mcap"


class Session:
    """Records boards into ``path``: :meth:`add` each of them, then :meth:`start`; a context manager that ends it.

    ``split``: when a new file begins; then ``touches.mcap`` becomes ``touches_0001.mcap`` and so on. ``bytes_only``
    leaves messages out: a quarter of the size, and nothing is lost, as they can be made of the bytes. The file must
    not be there yet. Raises :class:`ContactFPGAError`.
    """

    def __init__(
        self,
        path: str | Path,
        split: Split | None = None,
        bytes_only: bool = False,
        *,
        buffer: Callable[[], Buffer] = Buffer,
    ):
        check_new(path)
        self.links: list[LinkRecorder] = []
        self._path = Path(path)
        self._split = split
        self._opened: list[tuple[str, Board, Buffer]] = []
        self._recorder: Recorder | None = None
        self._bytes_only = bytes_only
        self._buffer = buffer
        self._stop = threading.Event()
        self._ended = threading.Event()
        self._begun: threading.Event | None = None
        self._failure: BaseException | None = None
        self._threads: list[threading.Thread] = []

    def add(
        self,
        port: str | SimulatedPort | None = None,
        skin: Skin | str | Path | None = None,
        *,
        name: str | None = None,
        baud: int | None = None,
        timeout: float = 1.0,
    ) -> None:
        """Open a board, as :func:`contactfpga.open` does. ``name``: of its link; by default that of its Skin."""
        buffer = self._buffer()
        board = driver.open(port, skin, baud=baud, record=buffer, timeout=timeout)
        self._opened.append((link_name(board.hello) if name is None else name, board, buffer))

    def start(self, seconds: float | None = None) -> None:
        """Make the file, and record for so long, or until :meth:`stop`."""
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
            for name, board, buffer in self._opened:
                self.links.append(LinkRecorder(board, buffer, self._recorder.add(name, board), self._bytes_only))
        except BaseException as error:
            self._failure = error
        else:
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
            self._ended.set()

    @property
    def running(self) -> bool:
        """Whether all boards are still being recorded."""
        return not self._ended.is_set()

    def wait(self, seconds: float) -> None:
        """At most until something ends."""
        self._ended.wait(seconds)

    def stop(self) -> None:
        """End all, and close the file; may be called twice. Raises why a link ended that was to go on."""
        self._stop.set()
        if self._begun is not None:
            self._begun.wait()
        for thread in self._threads:
            thread.join()
        try:
            for link in self.links:
                link.finish()
        finally:
            for _, board, _ in self._opened:
                board.close()
            if self._recorder is not None:
                self._recorder.close()
        for link in self.links:
            if link.error is not None:
                raise link.error

    @property
    def seconds(self) -> float:
        """How long it has been recorded."""
        return max((link.seconds for link in self.links), default=0.0)

    @property
    def frames(self) -> int:
        """Frames that were taken."""
        return sum(link.frames for link in self.links)

    @property
    def size(self) -> int:
        """Bytes in its files."""
        return 0 if self._recorder is None else self._recorder.size

    @property
    def files(self) -> list[Path]:
        """Its files, the first one first."""
        return [] if self._recorder is None else self._recorder.files

    def __enter__(self) -> Session:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self.stop()


def check_new(path: str | Path) -> None:
    """Raises :class:`ContactFPGAError` for what cannot be the name of a new recording."""
    if Path(path).suffix != SUFFIX:
        raise ContactFPGAError(f"{path} does not end in {SUFFIX}, by which programs know such files; name it so")
    if os.path.lexists(path):
        raise ContactFPGAError(f"{path} is there already; name a new file, or remove it first")
    if not Path(path).parent.is_dir():
        raise ContactFPGAError(f"{path} cannot be written: there is no folder {Path(path).parent}")
