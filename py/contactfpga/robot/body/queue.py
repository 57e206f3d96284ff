"""Snapshots that wait for a reader."""

from __future__ import annotations

import asyncio
import collections
from collections.abc import AsyncIterator, Iterator
from typing import TYPE_CHECKING

from contactfpga.driver.subscription import checked
from contactfpga.errors import ReadTimeout
from contactfpga.robot.body.snapshot import Snapshot

if TYPE_CHECKING:
    from contactfpga.robot.body.open_body import OpenBody


class SnapshotQueue:
    """Snapshots from a moment on; at most ``maxsize`` wait, beyond, the oldest are dropped and counted."""

    def __init__(self, body: OpenBody, maxsize: int):
        if isinstance(maxsize, bool) or not isinstance(maxsize, int) or maxsize < 1:
            raise ValueError(f"maxsize is {maxsize!r}; it must be a whole number of snapshots, 1 or more")
        self._body = body
        self._waiting: collections.deque[Snapshot] = collections.deque(maxlen=maxsize)
        self.dropped = 0
        """Snapshots that were not taken in time."""

    def put(self, snapshot: Snapshot) -> None:
        """Add one; the body's lock is held."""
        self.dropped += len(self._waiting) == self._waiting.maxlen
        self._waiting.append(snapshot)

    def next(self, timeout: float = 1.0) -> Snapshot:
        """The next one, in order. Raises :class:`ReadTimeout`, :class:`BoardClosed`."""
        with self._body._changed:
            self._wait(checked(timeout))
            return self._waiting.popleft()

    def _wait(self, timeout: float) -> None:
        """Until one waits."""
        with self._body._changed:
            self._body._changed.wait_for(lambda: self._waiting or self._body._closing.is_set(), timeout)
            self._body._check_open()
            if not self._waiting:
                raise ReadTimeout(f"no link has changed within {timeout:g} s")

    def close(self) -> None:
        """Take no more."""
        with self._body._changed:
            if self in self._body._queues:
                self._body._queues.remove(self)

    def __enter__(self) -> SnapshotQueue:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[Snapshot]:
        while True:
            yield self.next()

    async def __aiter__(self) -> AsyncIterator[Snapshot]:
        while True:
            await asyncio.to_thread(self._wait, 1.0)
            yield self.next()  # which waits for nothing now, and takes none if we were canceled above
