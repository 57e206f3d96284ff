"""A recording that is under way: one thread for each board."""

from __future__ import annotations

import threading
from pathlib import Path
from types import TracebackType

from contactfpga.driver import driver
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

    def __init__(self, path: str | Path, split: Split | None = None, bytes_only: bool = False):
        if Path(path).suffix != SUFFIX:
            raise ContactFPGAError(f"{path} does not end in {SUFFIX}, by which programs know such files; name it so")
        self.links: list[LinkRecorder] = []
        self._recorder = Recorder(path, split)
        self._bytes_only = bytes_only
        self._stop = threading.Event()
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
        buffer = Buffer()
        board = driver.open(port, skin, baud=baud, record=buffer, timeout=timeout)
        try:
            link = self._recorder.add(link_name(board.hello) if name is None else name, board)
        except BaseException:
            board.close()
            raise
        self.links.append(LinkRecorder(board, buffer, link, self._bytes_only))

    def start(self, seconds: float | None = None) -> None:
        """Record for so long, or until :meth:`stop`."""
        for link in self.links:
            thread = threading.Thread(target=link.run, args=(self._stop, seconds), name="recorder", daemon=True)
            self._threads.append(thread)
            thread.start()

    @property
    def running(self) -> bool:
        """Whether all boards are still being recorded."""
        return all(thread.is_alive() for thread in self._threads)

    def turn(self, seconds: float) -> None:
        """Wait, at most until something ends; call it again and again while it is :attr:`running`."""
        self._recorder.turn()
        self._threads[0].join(seconds)

    def stop(self) -> None:
        """End all, and close the file; may be called twice. Raises why a link ended that was to go on."""
        self._stop.set()
        for thread in self._threads:
            thread.join()
        try:
            for link in self.links:
                link.finish()
        finally:
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
        return self._recorder.size

    @property
    def files(self) -> list[Path]:
        """Its files, the first one first."""
        return self._recorder.files

    def __enter__(self) -> Session:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self.stop()
