"""A queue of frames, and what can be done with one."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Iterator

from contactfpga.driver.link import Link
from contactfpga.driver.queue import FrameQueue
from contactfpga.errors import BoardClosed, ContactFPGAError, PortLost, ReadTimeout, ReplayEnded
from contactfpga.inputs.values import is_finite
from contactfpga.zones.batch import Batch
from contactfpga.zones.run import Run
from contactfpga.zones.zone import Zones


class Subscription:
    """Every frame of a board from a moment on: in ``for``, in ``async for``, or one by one.

    ``maxsize`` frames wait at most; beyond, the oldest ones are dropped and counted in :attr:`dropped`.
    """

    def __init__(self, link: Link, maxsize: int, board: object = None):
        if isinstance(maxsize, bool) or not isinstance(maxsize, int) or maxsize < 1:
            raise ValueError(f"maxsize is {maxsize!r}; it must be a whole number of frames, 1 or more")
        self._frames = FrameQueue(maxsize)
        self._link = link
        self._board = board  # stays open as long as someone may take frames here
        self._closed = False
        with link.changed:
            link.listeners.add(self)

    @property
    def maxsize(self) -> int:
        """Frames that wait at most."""
        return self._frames.maxsize

    @property
    def dropped(self) -> int:
        """Frames that were not taken in time."""
        return self._frames.dropped

    def next(self, timeout: float = 1.0) -> Zones:
        """The next frame, in order; errors as for :meth:`Board.next`."""
        timeout = checked(timeout)
        return frame_of(self._link.wait_for(self._pop, self._link.clock() + timeout, timeout))

    def batch(self, max_s: float = 0.01, timeout: float = 1.0) -> Batch:
        """All frames that wait after at most ``max_s`` seconds; see :meth:`Board.batch`."""
        link, until = self._link, self._link.clock() + max_s
        self._wait(timeout)
        if link.transport.live:  # of a recording, what was read at once
            with contextlib.suppress(ReadTimeout, PortLost):  # whatever is lost, the next call says so
                link.wait_for(lambda: None, until, max_s)
        with link.changed:
            frames = self._frames.pop_frames()
        return Batch.of(frames or [self.next(timeout)])

    def close(self) -> None:
        """Take no more frames."""
        with self._link.changed:
            self._closed = True
            self._link.listeners.discard(self)
            self._frames.clear()
            self._link.changed.notify_all()

    def __enter__(self) -> Subscription:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[Zones]:
        while True:
            try:
                yield self.next()
            except ReplayEnded:
                return

    async def __aiter__(self) -> AsyncIterator[Zones]:
        while True:
            try:
                if self._frames:
                    await asyncio.sleep(0)  # others get their turn
                else:
                    await asyncio.to_thread(self._wait, 1.0)
                yield self.next()  # which waits for nothing now, and takes no frame if we were canceled above
            except ReplayEnded:
                return

    def _wait(self, timeout: float) -> None:
        timeout = checked(timeout)
        self._link.wait_for(lambda: True if self._frames else None, self._link.clock() + timeout, timeout)

    def _pop(self) -> Zones | ContactFPGAError | None:
        if self._closed:
            raise BoardClosed(f"{self._link.transport.name}: this subscription was closed; subscribe again")
        return self._frames.pop()

    # ---- for the board

    def put(self, item: Zones | Run | ContactFPGAError) -> None:
        """Add what came; the board's lock is held."""
        self._frames.put(item)

    def put_back(self, zones: Zones) -> None:
        """Have this frame come next."""
        with self._link.changed:
            self._frames.put_back(zones)

    def skip_to(self, zones: Zones) -> None:
        """Drop this frame and all that came before it."""
        with self._link.changed:
            self._frames.skip_to(zones)

    def keep_last(self) -> None:
        """Drop all frames but the last one; raises what a hello gave cause for."""
        with self._link.changed:
            self._frames.keep_last()

    def raise_first(self) -> None:
        """Raise what a hello gave cause for before the first frame."""
        with self._link.changed:
            if (error := self._frames.first_error()) is not None:
                raise error


def frame_of(found: object) -> Zones:
    """The frame that was waited for; raises the error that came in its place."""
    if isinstance(found, ContactFPGAError):
        raise found
    assert isinstance(found, Zones)
    return found


def checked(timeout: float) -> float:
    """A timeout in seconds as a float; raises ValueError unless it is positive and finite."""
    if not is_finite(timeout) or timeout <= 0:
        raise ValueError(f"timeout is {timeout!r}; it must be a positive number of seconds")
    return float(timeout)
